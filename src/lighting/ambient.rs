//! What the light grid holds and no light of the scene explains.
//!
//! The compiler stored at each point of the grid the light that arrives there: a directed part with its direction, and the
//! rest. The volume holds, for the six axes, that light less what the scene's own lights give there by traced samples,
//! smoothed over neighbouring points and never below zero. Bounced light is in it only where the compiler put it there
//! (`-bouncegrid`).

use crate::recovery::LightsFile;
use crate::recovery::encoding::{Encoding, grid_direction, lights_kept_unasked};
use crate::reference::direct::{RayCounts, SampleAddress, direct_light};
use crate::reference::surface::SurfaceHit;
use crate::reference::trace::Tracer;
use crate::render::settings::{LightSampling, Settings};
use crate::scene::Scene;
use crate::scene::ambient::{Ambient, AmbientVolume};
use crate::scene::clusters::cluster_at;
use crate::scene::records::AmbientCube;
use glam::{UVec3, Vec3};
use rayon::prelude::*;

/// Distance between grid points where the map says nothing, units.
const DEFAULT_STEP: Vec3 = Vec3::new(64.0, 64.0, 128.0);
/// Light samples per axis and point.
const SAMPLES: u32 = 4;
const AXES: [Vec3; 6] = [Vec3::X, Vec3::NEG_X, Vec3::Y, Vec3::NEG_Y, Vec3::Z, Vec3::NEG_Z];

/// The constant term: of a lights file, else of worldspawn's keys.
fn constant(scene: &Scene, file: Option<&LightsFile>) -> Vec3 {
    if let Some(file) = file {
        return file.ambient;
    }
    let Some(w) = scene.entities.iter().find(|e| e.class() == "worldspawn") else {
        return Vec3::ZERO;
    };
    let value = w.number("_ambient").or(w.number("ambient")).unwrap_or(0.0);
    // Not normalised, unlike the colours of lights.
    w.vector("_color").unwrap_or(Vec3::ONE) * (value.max(0.0) / 255.0)
}

/// Part of the directed light that the compiler added to the ambient part, by its generation.
fn share_in_ambient(scene: &Scene) -> f32 {
    let worldspawn = scene.entities.iter().find(|e| e.class() == "worldspawn");
    if worldspawn.is_some_and(|w| w.get("_q3map2_cmdline").is_some_and(|c| c.contains("-light"))) {
        0.0
    } else if lights_kept_unasked(&scene.entities, &scene.lights) {
        0.25
    } else {
        0.125
    }
}

/// The grid's layout; `None` where the map has no grid or not the one that its bounds ask for.
fn layout(scene: &Scene) -> Option<AmbientVolume> {
    let model = scene.bsp.models.first()?;
    let worldspawn = scene.entities.iter().find(|e| e.class() == "worldspawn");
    let step = worldspawn
        .and_then(|w| w.vector("gridsize"))
        .filter(|s| s.min_element() >= 1.0)
        .unwrap_or(DEFAULT_STEP);
    let origin = step * (Vec3::from(model.mins) / step).ceil();
    let last = step * (Vec3::from(model.maxs) / step).floor();
    let size = ((last - origin) / step + 1.0).max(Vec3::ZERO).as_uvec3();
    let points = u64::from(size.x) * u64::from(size.y) * u64::from(size.z);
    (points > 0 && points == scene.bsp.light_grid.len() as u64).then_some(AmbientVolume {
        origin,
        step,
        size,
        cubes: Vec::new(),
    })
}

/// What is left over of the light grid, and the constant term.
pub fn left_over(scene: &Scene, tracer: &Tracer, file: Option<&LightsFile>) -> Ambient {
    let constant = constant(scene, file);
    let Some(mut volume) = layout(scene) else {
        return Ambient {
            constant,
            ..Ambient::default()
        };
    };
    let encoding = Encoding::of(&scene.bsp, &scene.entities, &scene.lights);
    let share = share_in_ambient(scene);
    let settings = Settings {
        light_sampling: LightSampling::Bvh,
        random_lights: SAMPLES,
        ..Settings::default()
    };
    let place = |i: usize| -> UVec3 {
        let (i, s) = (i as u32, volume.size);
        UVec3::new(i % s.x, i / s.x % s.y, i / (s.x * s.y))
    };
    let rest: Vec<Option<[Vec3; 6]>> = scene
        .bsp
        .light_grid
        .par_iter()
        .enumerate()
        .map(|(i, point)| {
            if point.ambient == [0; 3] && point.directed == [0; 3] {
                return None;
            }
            let position = volume.origin + place(i).as_vec3() * volume.step;
            let row = cluster_at(&scene.bsp_nodes, position)?;
            let decode = |b: [u8; 3]| Vec3::from(b.map(|b| encoding.decode_byte(b)));
            let (ambient, directed) = (decode(point.ambient), decode(point.directed));
            let direction = grid_direction(point.direction);
            let mut counts = RayCounts::default();
            Some(std::array::from_fn(|axis| {
                let normal = AXES[axis];
                let stored = (ambient - directed * share).max(Vec3::ZERO) + directed * normal.dot(direction).max(0.0);
                let at = SurfaceHit::receiver(position, normal, row);
                let address = SampleAddress {
                    pixel: i as u32,
                    index: axis as u32,
                };
                stored - direct_light(scene, tracer, &settings, &at, address, &mut counts)
            }))
        })
        .collect();
    volume.cubes = (0..rest.len())
        .into_par_iter()
        .map(|i| smoothed(&rest, volume.size, place(i), i))
        .collect();
    Ambient { constant, volume }
}

/// Weighted mean over the points around one, in the open all of them; what is below zero then is noise or explained.
fn smoothed(rest: &[Option<[Vec3; 6]>], size: UVec3, at: UVec3, index: usize) -> AmbientCube {
    if rest[index].is_none() {
        return AmbientCube {
            axes: [[0.0; 3]; 6],
            open: 0.0,
        };
    }
    let (mut sum, mut whole) = ([Vec3::ZERO; 6], 0.0);
    for n in 0..27i32 {
        let offset = glam::IVec3::new(n % 3 - 1, n / 3 % 3 - 1, n / 9 - 1);
        let p = at.as_ivec3() + offset;
        if p.cmplt(glam::IVec3::ZERO).any() || p.cmpge(size.as_ivec3()).any() {
            continue;
        }
        let p = p.as_uvec3();
        let j = (p.z * size.y + p.y) * size.x + p.x;
        if let Some(axes) = &rest[j as usize] {
            let weight = 0.5f32.powi(offset.abs().element_sum());
            sum.iter_mut().zip(axes).for_each(|(s, a)| *s += *a * weight);
            whole += weight;
        }
    }
    AmbientCube {
        axes: sum.map(|s| (s / whole).max(Vec3::ZERO).into()),
        open: 1.0,
    }
}
