//! Direct light by next-event estimation. Counterpart of `shaders/direct.comp`.

use super::branches::shown_over_lit;
use super::light_choice::{Chances, Choice, LobeChances};
use super::light_sample::{LightSample, PointSampling, Target, sample_light};
use super::renderer::CpuRenderer;
use super::surface::{SurfaceHit, classify, offset_point};
use super::trace::Tracer;
use super::visibility::visible;
use crate::render::settings::{LightSampling, LightTerm, Settings, ShownEmission};
use crate::scene::Scene;
use crate::scene::camera::Camera;
use crate::scene::clusters::LightLists;
use crate::scene::guests::GUEST_LIGHT;
use crate::scene::light_cells::place;
use crate::scene::light_power::luminance;
use crate::scene::optics::Lobe;
use crate::scene::records::{LIGHT_DOME, LIGHT_SPHERE, LIGHT_TRIANGLE};
use crate::scene::sampling::{
    DIM_CANDIDATE_PICK, DIM_CANDIDATE_POINT, DIM_EVERY_LIGHT, DIM_LIGHT_PICK, DIM_LIGHT_POINT, DIM_LOBE_PICK,
    DIM_LOBE_POINT, MAX_CANDIDATES, bits2, keep_bits, key, stratified, unit,
};
use glam::Vec3;
use std::f32::consts::PI;

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

/// Lights chosen uniformly are sampled by area, as the thesis does; the ways that choose with more care sample with more.
pub fn point_sampling(settings: &Settings) -> PointSampling {
    match settings.light_sampling {
        _ if !settings.soft_shadows => PointSampling::Centre,
        LightSampling::Uniform => PointSampling::Area,
        _ => PointSampling::SolidAngle,
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
    let estimator = Estimator::new(scene, tracer, settings, at, address);
    let (lists, row) = light_row(scene, settings, at.row);
    if let Some(light) = settings.solo_light {
        return match (light as usize) < scene.lights.lights.len() {
            true => estimator.one(light, DIM_EVERY_LIGHT + light, 1.0, counts),
            false => Vec3::ZERO,
        };
    }
    if settings.random_lights == 0 {
        let guests = (0..tracer.guests.len() as u32).map(|g| GUEST_LIGHT + g);
        return lists
            .lights(row)
            .chain(guests)
            .map(|light| estimator.one(light, DIM_EVERY_LIGHT + light, 1.0, counts))
            .sum();
    }
    let chances = estimator.chances();
    let share = 1.0 / settings.random_lights as f32;
    (0..settings.random_lights)
        .map(|i| match estimator.taken(&chances, i, 0) {
            Some(taken) => estimator.traced(taken.sample, taken.weight * share, counts),
            None => Vec3::ZERO,
        })
        .sum()
}

/// A light sample that an estimate takes.
#[derive(Clone, Copy, Debug)]
pub struct Taken {
    pub light: u32,
    /// Random numbers of its point.
    pub u: [f32; 2],
    /// `None` where it gives nothing.
    pub sample: Option<LightSample>,
    /// Inverse of the probability that the light was chosen, or what resampling puts in its place.
    pub weight: f32,
}

/// The sample that an estimate at a surface takes for its `i`-th random light; `None` for none at all. `steps` moves the
/// numbers that choose by as many steps of a float: 0 but where the choice itself is examined.
pub fn taken_sample(
    scene: &Scene,
    tracer: &Tracer,
    settings: &Settings,
    at: &SurfaceHit,
    address: SampleAddress,
    i: u32,
    steps: i32,
) -> Option<Taken> {
    let estimator = Estimator::new(scene, tracer, settings, at, address);
    estimator.taken(&estimator.chances(), i, steps)
}

/// The light that gives most to what a camera sees, by a few samples of a small image; 0 where none gives anything.
pub fn strongest_light(scene: &Scene, camera: &Camera) -> u32 {
    const SIZE: (u32, u32) = (48, 27);
    const SAMPLES: u32 = 8;
    let settings = Settings::default();
    let tracer = Tracer::new(scene);
    let aovs = CpuRenderer::new(scene).aovs(camera, SIZE, &settings);
    let mut given = vec![0.0; scene.lights.lights.len()];
    for (pixel, (position, normal)) in (0u32..).zip(aovs.position.iter().zip(&aovs.geo_normal)) {
        let (position, normal) = (Vec3::from(*position), Vec3::from(*normal));
        if normal == Vec3::ZERO {
            continue;
        }
        let (_, row) = classify(scene, position, normal, scene.rows.all_row);
        let at = SurfaceHit::receiver(position, normal, row);
        for index in 0..SAMPLES {
            let address = SampleAddress { pixel, index };
            let taken = taken_sample(scene, &tracer, &settings, &at, address, 0, 0);
            let Some((taken, sample)) = taken.and_then(|t| Some((t, t.sample?))) else {
                continue;
            };
            let arrives = visible(scene, &tracer, offset_point(position, normal), &sample);
            if let Some(sum) = given.get_mut(taken.light as usize) {
                *sum += luminance((sample.value * arrives).into()) * taken.weight;
            }
        }
    }
    let most = given.iter().enumerate().max_by(|a, b| a.1.total_cmp(b.1));
    most.map_or(0, |(light, _)| light as u32)
}

/// Radiance over Fresnel's factor that a surface's lobe reflects of one light, sampled by area; lights
/// that the lobe's own directions find, too, are weighted by the balance heuristic.
pub fn lobe_light(
    scene: &Scene,
    tracer: &Tracer,
    settings: &Settings,
    at: &SurfaceHit,
    lobe: &Lobe,
    address: SampleAddress,
    counts: &mut RayCounts,
) -> Vec3 {
    let mut estimator = Estimator::new(scene, tracer, settings, at, address);
    estimator.points = if settings.soft_shadows {
        PointSampling::Area
    } else {
        PointSampling::Centre
    };
    let (lists, row) = light_row(scene, settings, at.row);
    let chances = LobeChances::new(scene, settings, lists, row, place(at.position, at.geometric_normal));
    let choice = match settings.solo_light {
        None => chances.choose(estimator.bits(DIM_LOBE_PICK)[0]),
        Some(light) => ((light as usize) < scene.lights.lights.len()).then_some(Choice {
            light,
            probability: 1.0,
        }),
    };
    let Some(choice) = choice else {
        return Vec3::ZERO;
    };
    let Some(sample) = estimator.sample(choice.light, DIM_LOBE_POINT) else {
        counts.shadow_skipped += 1;
        return Vec3::ZERO;
    };
    let light = tracer.light(scene, choice.light);
    let direction = match sample.target {
        Target::Sky(d) => d,
        Target::Point(p) => (p - at.position).normalize_or_zero(),
    };
    // What the eye does not see has no image in a lobe either.
    let unseen = matches!(light.kind, LIGHT_SPHERE | LIGHT_DOME);
    if settings.shown_emission == ShownEmission::Game && unseen {
        return Vec3::ZERO;
    }
    let mut weight = Vec3::splat(PI * lobe.brdf(direction) / choice.probability);
    if light.kind == LIGHT_TRIANGLE {
        let Target::Point(point) = sample.target else {
            return Vec3::ZERO;
        };
        let normal = Vec3::from(light.p1).cross(light.p2.into()).normalize_or_zero();
        let cosine = normal.dot(direction).abs();
        let own =
            choice.probability * (point - at.position).length_squared() / (cosine * light.size).max(f32::MIN_POSITIVE);
        // With hard shadows a lamp is a point to light samples, and the lobe's directions find all of it.
        let share = own / (own + lobe.pdf(direction));
        weight *= if settings.soft_shadows { share } else { 0.0 };
        weight *= shown_over_lit(&scene.materials[light.material as usize], settings.shown_emission);
        if settings.shown_emission == ShownEmission::Game {
            weight /= light.scale;
        }
    }
    if weight.max_element() <= 0.0 || !weight.is_finite() {
        return Vec3::ZERO;
    }
    weight * estimator.traced(Some(sample), 1.0, counts)
}

struct Estimator<'a> {
    scene: &'a Scene,
    tracer: &'a Tracer,
    settings: &'a Settings,
    at: &'a SurfaceHit,
    address: SampleAddress,
    points: PointSampling,
}

impl<'a> Estimator<'a> {
    fn new(
        scene: &'a Scene,
        tracer: &'a Tracer,
        settings: &'a Settings,
        at: &'a SurfaceHit,
        address: SampleAddress,
    ) -> Self {
        Self {
            scene,
            tracer,
            settings,
            at,
            address,
            points: point_sampling(settings),
        }
    }

    fn bits(&self, dimension: u32) -> [u32; 2] {
        let key = key(self.settings.seed, self.address.pixel, dimension);
        bits2(self.settings.sequence, key, self.address.index)
    }

    fn chances(&self) -> Chances<'_> {
        let (lists, row) = light_row(self.scene, self.settings, self.at.row);
        Chances::new(self.scene, &self.tracer.guests, self.settings, lists, row, self.at)
    }

    fn sample(&self, light: u32, dimension: u32) -> Option<LightSample> {
        self.sample_at(light, self.bits(dimension).map(unit))
    }

    fn sample_at(&self, light: u32, u: [f32; 2]) -> Option<LightSample> {
        let record = self.tracer.light(self.scene, light);
        sample_light(self.scene, &record, self.at, u, self.points)
    }

    fn traced(&self, sample: Option<LightSample>, weight: f32, counts: &mut RayCounts) -> Vec3 {
        let Some(sample) = sample else {
            counts.shadow_skipped += 1;
            return Vec3::ZERO;
        };
        match self.settings.light_term {
            LightTerm::Geometry => return Vec3::splat(sample.geometry * weight),
            LightTerm::Emission => return sample.value / sample.geometry * weight,
            LightTerm::All | LightTerm::Visibility => {}
        }
        counts.shadow += 1;
        let origin = offset_point(self.at.position, self.at.geometric_normal);
        let arrives = visible(self.scene, self.tracer, origin, &sample) * weight;
        match self.settings.light_term {
            LightTerm::Visibility => arrives,
            _ => sample.value * arrives,
        }
    }

    /// Contribution of one light, times a weight.
    fn one(&self, light: u32, dimension: u32, weight: f32, counts: &mut RayCounts) -> Vec3 {
        self.traced(self.sample(light, dimension), weight, counts)
    }

    fn taken(&self, chances: &Chances<'_>, i: u32, steps: i32) -> Option<Taken> {
        if self.settings.light_sampling == LightSampling::Reservoir {
            return self.resampled(chances, i, steps);
        }
        let [bits, _] = self.bits(DIM_LIGHT_PICK + i);
        let choice = chances.choose(self.at, bits.saturating_add_signed(steps << 8))?;
        Some(Taken {
            light: choice.light,
            u: self.bits(DIM_LIGHT_POINT + i).map(unit),
            sample: self.sample(choice.light, DIM_LIGHT_POINT + i),
            weight: 1.0 / choice.probability,
        })
    }

    /// One light resampled from candidates in proportion to what they give without visibility (Talbot, Cline and Egbert
    /// 2005, "Importance Resampling for Global Illumination"). The candidates stratify one random number, and all are looked at
    /// where another pair says: the mean needs no more of them than that each by itself is as likely as its probability says.
    fn resampled(&self, chances: &Chances<'_>, i: u32, steps: i32) -> Option<Taken> {
        let n = self.settings.candidates * if chances.many() { 2 } else { 1 };
        let n = n.clamp(1, MAX_CANDIDATES);
        let [pick, keep] = self.bits(DIM_CANDIDATE_PICK + i);
        let u = self.bits(DIM_CANDIDATE_POINT + i).map(unit);
        let (mut kept, mut kept_target, mut sum) = (None, 0.0, 0.0);
        for c in 0..n {
            let [pick, keep] =
                [stratified(pick, c, n), keep_bits(keep, c)].map(|b| b.saturating_add_signed(steps << 8));
            let Some(choice) = chances.choose(self.at, pick) else {
                continue;
            };
            let Some(sample) = self.sample_at(choice.light, u) else {
                continue;
            };
            let target = luminance(sample.value.into());
            let weight = target / choice.probability;
            sum += weight;
            if unit(keep) * sum < weight {
                (kept, kept_target) = (Some((choice.light, sample)), target);
            }
        }
        let (light, sample) = kept.filter(|_| kept_target > 0.0)?;
        Some(Taken {
            light,
            u,
            sample: Some(sample),
            weight: sum / (kept_target * n as f32),
        })
    }
}
