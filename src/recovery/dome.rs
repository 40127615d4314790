//! Sky domes (`q3map_skylight`) as the compiler has them: so many faint suns, evenly in azimuth and elevation.
//!
//! A scene holds one light per dome and sky triangle. Here a dome is one term, and directions are drawn as the compiler
//! draws its suns: v is V times the mean of the cosine over those that leave through the sky.

use super::luxels::Luxel;
use super::random::Random;
use super::visibility::Occluders;
use crate::scene::lights::{LightSource, LightTable};
use crate::scene::records::{Light, NONE};
use glam::Vec3;
use std::f32::consts::{FRAC_PI_2, TAU};

/// Directions per luxel, which all domes share.
const RAYS: u32 = 32;

/// The domes of a scene.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Domes {
    /// V/255 × colour of each dome, in an order that does not depend on that of the lights.
    pub strengths: Vec<Vec3>,
    /// The dome that each light of the scene belongs to; [`NONE`] for other lights.
    pub of_light: Vec<u32>,
}

impl Domes {
    /// Sorts a scene's lights into domes: those of one radiance are one, or several alike ones that act as one.
    pub fn new(lights: &LightTable) -> Self {
        let dome = |i: usize| (lights.sources[i] == LightSource::SkyDome).then(|| &lights.lights[i]);
        let bits = |light: &Light| light.radiance.map(f32::to_bits);
        let mut kinds: Vec<[u32; 3]> = (0..lights.lights.len()).filter_map(dome).map(bits).collect();
        kinds.sort_unstable();
        kinds.dedup();
        let of_light: Vec<u32> = (0..lights.lights.len())
            .map(|i| dome(i).map_or(NONE, |l| kinds.binary_search(&bits(l)).map_or(NONE, |k| k as u32)))
            .collect();
        let strengths = (0..kinds.len() as u32)
            .map(|k| {
                let mut members = (0..of_light.len())
                    .filter(|&i| of_light[i] == k)
                    .map(|i| &lights.lights[i]);
                members.next().map_or(Vec3::ZERO, |first| {
                    let alike = members
                        .filter(|l| (l.p0, l.p1, l.p2) == (first.p0, first.p1, first.p2))
                        .count();
                    Vec3::from(first.radiance) * (alike + 1) as f32
                })
            })
            .collect();
        Self { strengths, of_light }
    }
}

/// Irradiance/π at a luxel of a dome of strength 1, seen through the sky's surfaces.
pub fn irradiance(occluders: &Occluders, luxel: &Luxel, random: &mut Random) -> f32 {
    let turn = random.unit();
    let mut sum = 0.0;
    for i in 0..RAYS {
        // A rank-1 lattice, moved at random.
        let (se, ce) = (FRAC_PI_2 * (i as f32 + 0.5) / RAYS as f32).sin_cos();
        let (sa, ca) = (TAU * (i as f32 * 0.618_034 + turn).fract()).sin_cos();
        let direction = Vec3::new(ca * ce, sa * ce, se);
        let cosine = luxel.cosine(direction);
        if cosine > 0.0 {
            let place = occluders.spread(luxel, random);
            if occluders.sees_sky(place.origin(direction), direction) {
                sum += cosine;
            }
        }
    }
    sum / RAYS as f32
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::clusters::LightReach;
    use crate::scene::records::{LIGHT_DOME, LIGHT_TWO_SIDED};

    fn table(lights: &[(LightSource, [f32; 3], f32)]) -> LightTable {
        let mut table = LightTable::default();
        for (source, radiance, x) in lights {
            let light = Light {
                kind: LIGHT_DOME,
                flags: LIGHT_TWO_SIDED,
                triangle: NONE,
                material: NONE,
                p0: [*x, 0.0, 0.0],
                size: 1.0,
                p1: [1.0, 0.0, 0.0],
                instance: NONE,
                p2: [0.0, 1.0, 0.0],
                padding: 0,
                radiance: *radiance,
                scale: 1.0,
            };
            table.push(*source, light, LightReach::still(None, None));
        }
        table
    }

    #[test]
    fn triangles_of_a_sky_are_one_dome_whatever_their_order() {
        let (a, b) = ([0.4; 3], [0.2, 0.3, 0.4]);
        let dome = |radiance, x| (LightSource::SkyDome, radiance, x);
        let sun = (LightSource::Sun, a, 0.0);
        let forth = [dome(a, 0.0), dome(b, 0.0), sun, dome(a, 1.0), dome(b, 1.0)];
        let mut back = forth;
        back.reverse();
        let (forth, back) = (Domes::new(&table(&forth)), Domes::new(&table(&back)));
        assert_eq!(forth.strengths, [Vec3::from(b), Vec3::from(a)]);
        assert_eq!(forth.of_light, [1, 0, NONE, 1, 0]);
        assert_eq!(back.strengths, forth.strengths);
        assert_eq!(back.of_light, [0, 1, NONE, 0, 1]);
    }

    #[test]
    fn two_domes_alike_are_twice_as_strong() {
        let dome = (LightSource::SkyDome, [0.4; 3], 0.0);
        let other = (LightSource::SkyDome, [0.4; 3], 1.0);
        let domes = Domes::new(&table(&[dome, other, dome, other]));
        assert_eq!(domes.strengths, [Vec3::splat(0.8)]);
    }
}
