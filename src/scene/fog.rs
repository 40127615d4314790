//! Volumes of fog (`fogparms`): convex brushes that hide what is behind them by how far a ray goes through them.

use super::program::UNLIT;
use super::records::Fog;
use crate::assets::bsp::Bsp;
use crate::assets::image::decode_srgb;
use crate::assets::shader_script::ShaderLibrary;
use glam::Vec3;

/// The fogs of a map, and the planes of all of them: outward normals and distances.
#[derive(Clone, Debug, Default)]
pub struct Fogs {
    pub fogs: Vec<Fog>,
    pub planes: Vec<[f32; 4]>,
}

impl Fogs {
    /// Those of a map whose scripts say how dense they are.
    pub fn new(bsp: &Bsp, scripts: &ShaderLibrary) -> Self {
        let mut out = Self::default();
        for fog in &bsp.fogs {
            let Some(parms) = scripts.get(&fog.shader.text()).and_then(|s| s.fog) else {
                continue;
            };
            let Some(brush) = usize::try_from(fog.brush).ok().and_then(|b| bsp.brushes.get(b)) else {
                continue;
            };
            let sides = brush.first_side.max(0) as usize..(brush.first_side + brush.side_count).max(0) as usize;
            let first_plane = out.planes.len() as u32;
            for side in bsp.brush_sides.get(sides).unwrap_or_default() {
                let plane = &bsp.planes[side.plane as usize];
                let [x, y, z] = plane.normal;
                out.planes.push([x, y, z, plane.dist]);
            }
            let colour = parms.color.clamp(Vec3::ZERO, Vec3::ONE).map(decode_srgb) * UNLIT;
            out.fogs.push(Fog {
                colour: colour.into(),
                density: 1.0 / parms.depth_for_opaque.max(1.0),
                first_plane,
                plane_count: out.planes.len() as u32 - first_plane,
            });
        }
        out
    }

    /// Radiance of the fog on the first `t` of a ray (unit direction), and the share of what is behind that is left.
    /// Counterpart of `fog_at` in `shaders/include/fog.glsl`.
    pub fn at(&self, origin: Vec3, direction: Vec3, t: f32) -> (Vec3, f32) {
        let (mut light, mut left) = (Vec3::ZERO, 1.0);
        for fog in &self.fogs {
            let (mut enter, mut leave) = (0f32, t);
            for plane in &self.planes[fog.first_plane as usize..(fog.first_plane + fog.plane_count) as usize] {
                let n = Vec3::new(plane[0], plane[1], plane[2]);
                let (outside, approach) = (n.dot(origin) - plane[3], n.dot(direction));
                if approach < 0.0 {
                    enter = enter.max(-outside / approach);
                } else if approach > 0.0 {
                    leave = leave.min(-outside / approach);
                } else if outside > 0.0 {
                    leave = f32::NEG_INFINITY;
                }
            }
            // The game's table: opaque after the script's depth, by the square root.
            let hides = ((leave - enter).max(0.0) * fog.density).min(1.0).sqrt();
            light += Vec3::from(fog.colour) * (left * hides);
            left *= 1.0 - hides;
        }
        (light, left)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cube_hides_by_the_root_of_the_way_through_it() {
        let mut fogs = Fogs::default();
        for axis in [Vec3::X, Vec3::Y, Vec3::Z] {
            for n in [axis, -axis] {
                fogs.planes.push([n.x, n.y, n.z, 10.0]);
            }
        }
        fogs.fogs.push(Fog {
            colour: [0.5; 3],
            density: 1.0 / 80.0,
            first_plane: 0,
            plane_count: 6,
        });
        let (light, left) = fogs.at(Vec3::new(-50.0, 0.0, 0.0), Vec3::X, 1e6);
        assert!((left - 0.5).abs() < 1e-6 && (light.x - 0.25).abs() < 1e-6);
        assert_eq!(fogs.at(Vec3::new(-50.0, 20.0, 0.0), Vec3::X, 1e6), (Vec3::ZERO, 1.0));
        let (_, from_inside) = fogs.at(Vec3::ZERO, Vec3::X, 5.0);
        assert!((from_inside - 0.75).abs() < 1e-6);
    }
}
