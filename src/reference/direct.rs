//! Direct light by next-event estimation. Counterpart of `shaders/direct.comp`.

use super::light_choice::choose;
use super::light_sample::{LightSample, Target, sample_light};
use super::surface::{SurfaceHit, offset_point};
use super::trace::Tracer;
use crate::render::settings::{LightSampling, Settings};
use crate::scene::Scene;
use crate::scene::clusters::LightLists;
use crate::scene::light_power::luminance;
use crate::scene::sampling::{
    DIM_CANDIDATE_PICK, DIM_CANDIDATE_POINT, DIM_EVERY_LIGHT, DIM_LIGHT_PICK, DIM_LIGHT_POINT, MAX_CANDIDATES, bits2,
    key, unit,
};
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
    let estimator = Estimator {
        scene,
        tracer,
        settings,
        at,
        address,
    };
    let (lists, row) = light_row(scene, settings, at.row);
    if settings.random_lights == 0 {
        return lists
            .lights(row)
            .map(|light| estimator.one(light, DIM_EVERY_LIGHT + light, 1.0, counts))
            .sum();
    }
    let share = 1.0 / settings.random_lights as f32;
    (0..settings.random_lights)
        .map(|i| match settings.light_sampling {
            LightSampling::Reservoir => estimator.resampled(lists, row, i, counts) * share,
            _ => {
                let bits = estimator.bits(DIM_LIGHT_PICK + i)[0];
                match choose(settings.light_sampling, &scene.lights, lists, row, at, bits) {
                    Some(c) => estimator.one(c.light, DIM_LIGHT_POINT + i, share / c.probability, counts),
                    None => Vec3::ZERO,
                }
            }
        })
        .sum()
}

struct Estimator<'a> {
    scene: &'a Scene,
    tracer: &'a Tracer,
    settings: &'a Settings,
    at: &'a SurfaceHit,
    address: SampleAddress,
}

impl Estimator<'_> {
    fn bits(&self, dimension: u32) -> [u32; 2] {
        let key = key(self.settings.seed, self.address.pixel, dimension);
        bits2(self.settings.sequence, key, self.address.index)
    }

    fn sample(&self, light: u32, dimension: u32) -> Option<LightSample> {
        let record = &self.scene.lights.lights[light as usize];
        let u = self.bits(dimension).map(unit);
        sample_light(self.scene, record, self.at, u, self.settings.soft_shadows)
    }

    fn traced(&self, sample: Option<LightSample>, weight: f32, counts: &mut RayCounts) -> Vec3 {
        let Some(sample) = sample else {
            counts.shadow_skipped += 1;
            return Vec3::ZERO;
        };
        counts.shadow += 1;
        if visible(self.scene, self.tracer, self.at, &sample) {
            sample.value * weight
        } else {
            Vec3::ZERO
        }
    }

    /// Contribution of one light, times a weight.
    fn one(&self, light: u32, dimension: u32, weight: f32, counts: &mut RayCounts) -> Vec3 {
        self.traced(self.sample(light, dimension), weight, counts)
    }

    /// Contribution of one light resampled from candidates in proportion to what they give without visibility (Talbot,
    /// Cline and Egbert 2005, "Importance Resampling for Global Illumination").
    fn resampled(&self, lists: &LightLists, row: u32, i: u32, counts: &mut RayCounts) -> Vec3 {
        let n = self.settings.candidates.clamp(1, MAX_CANDIDATES);
        let (mut kept, mut kept_target, mut sum) = (None, 0.0, 0.0);
        for c in i * MAX_CANDIDATES..i * MAX_CANDIDATES + n {
            let [pick, keep] = self.bits(DIM_CANDIDATE_PICK + c);
            let sampling = LightSampling::Reservoir;
            let Some(choice) = choose(sampling, &self.scene.lights, lists, row, self.at, pick) else {
                continue;
            };
            let Some(sample) = self.sample(choice.light, DIM_CANDIDATE_POINT + c) else {
                continue;
            };
            let target = luminance(sample.value.into());
            let weight = target / choice.probability;
            sum += weight;
            if unit(keep) * sum < weight {
                (kept, kept_target) = (Some(sample), target);
            }
        }
        let weight = if kept_target > 0.0 {
            sum / (kept_target * n as f32)
        } else {
            0.0
        };
        self.traced(kept, weight, counts)
    }
}
