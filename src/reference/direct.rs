//! Direct light by next-event estimation. Counterpart of `shaders/direct.comp`.

use super::light_sample::{LightSample, Target, sample_light};
use super::surface::{SurfaceHit, offset_point};
use super::trace::Tracer;
use crate::render::settings::Settings;
use crate::scene::Scene;
use crate::scene::clusters::LightLists;
use crate::scene::sampling::{DIM_EVERY_LIGHT, DIM_LIGHT_PICK, DIM_LIGHT_POINT, key, sample2};
use glam::Vec3;

/// Rays traced and avoided.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize)]
pub struct RayCounts {
    pub primary: u64,
    pub shadow: u64,
    /// Light samples that facing or cosine tests ended before a ray was traced.
    pub shadow_skipped: u64,
}

impl std::ops::AddAssign for RayCounts {
    fn add_assign(&mut self, other: Self) {
        self.primary += other.primary;
        self.shadow += other.shadow;
        self.shadow_skipped += other.shadow_skipped;
    }
}

/// Address of random numbers: pixel (x + y·65536) and sample index.
#[derive(Clone, Copy, Debug)]
pub struct SampleAddress {
    pub pixel: u32,
    pub index: u32,
}

/// Lists and row that a receiver uses at a culling level; level 0 does not look at the PVS.
pub fn light_row<'a>(scene: &'a Scene, settings: &Settings, row: u32) -> (&'a LightLists, u32) {
    match settings.cull_lights {
        0 => (&scene.rows.pvs, scene.rows.all_row),
        1 => (&scene.rows.pvs, row),
        _ => (&scene.rows.tight, row),
    }
}

/// Number of the k-th light of a row.
fn kth_light(lists: &LightLists, row: u32, k: u32) -> u32 {
    let row = lists.rows[row as usize];
    let runs = &lists.runs[row.first_run as usize..(row.first_run + row.run_count) as usize];
    let run = runs[runs.partition_point(|r| r.before <= k) - 1];
    run.first_light + (k - run.before)
}

fn visible(scene: &Scene, tracer: &Tracer, at: &SurfaceHit, sample: &LightSample) -> bool {
    let origin = offset_point(at.position, at.geometric_normal);
    match sample.target {
        Target::Point(point) => !tracer.occluded(scene, origin, point - origin, 1.0),
        Target::Sky(direction) => tracer.sees_sky(scene, origin, direction),
    }
}

/// Irradiance/π at a surface in luxel units: all lights of the row, or N of them at random.
pub fn direct_light(
    scene: &Scene,
    tracer: &Tracer,
    settings: &Settings,
    at: &SurfaceHit,
    address: SampleAddress,
    counts: &mut RayCounts,
) -> Vec3 {
    let (lists, row) = light_row(scene, settings, at.row);
    let light_count = lists.rows[row as usize].light_count;
    let mut sum = Vec3::ZERO;
    let mut add = |light: u32, dimension: u32, weight: f32, sum: &mut Vec3| {
        let u = sample2(
            settings.sequence,
            key(settings.seed, address.pixel, dimension),
            address.index,
        );
        let record = &scene.lights.lights[light as usize];
        match sample_light(scene, record, at, u, settings.soft_shadows) {
            Some(sample) => {
                counts.shadow += 1;
                if visible(scene, tracer, at, &sample) {
                    *sum += sample.value * weight;
                }
            }
            None => counts.shadow_skipped += 1,
        }
    };
    if settings.random_lights == 0 {
        for light in lists.lights(row) {
            add(light, DIM_EVERY_LIGHT + light, 1.0, &mut sum);
        }
    } else if light_count > 0 {
        let n = settings.random_lights;
        let weight = light_count as f32 / n as f32;
        for i in 0..n {
            let k = key(settings.seed, address.pixel, DIM_LIGHT_PICK + i);
            let [u, _] = sample2(settings.sequence, k, address.index);
            let pick = ((u * light_count as f32) as u32).min(light_count - 1);
            add(kth_light(lists, row, pick), DIM_LIGHT_POINT + i, weight, &mut sum);
        }
    }
    sum
}
