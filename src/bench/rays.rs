//! `bench rays`: traversal only. Rays are made beforehand, so that a timed dispatch reads rays, traces, and writes hits.

use super::ray_buffers::{HitRecord, RayBuffers, device_buffer};
use super::ray_report::{Agreement, MapReport, Rate};
use crate::gpu::{
    Access, Barrier, Buffer, Commands, ComputePipeline, ComputePipelineDesc, GpuError, Timestamps, shader_table,
};
use crate::render::backend::Backend;
use crate::render::frame_constants::{FrameConstants, Push};
use crate::render::scene_gpu::{RenderError, SceneGpu};
use crate::scene::Scene;
use crate::scene::camera::Camera;
use crate::scene::records::NONE;
use serde::Serialize;
use std::time::{Duration, Instant};

/// What walks the scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Tree {
    /// Own traversal of the compressed 8-wide tree.
    Cwbvh,
    /// Own traversal of the binary tree.
    Bvh2,
    /// The driver's ray queries.
    RayQuery,
}

impl Tree {
    /// All of them; the first is what the others are compared with.
    pub const ALL: [Self; 3] = [Self::Cwbvh, Self::Bvh2, Self::RayQuery];

    /// Name in tables and in the shaders' compiled forms.
    pub fn name(self) -> &'static str {
        match self {
            Self::Cwbvh => "cwbvh",
            Self::Bvh2 => "bvh2",
            Self::RayQuery => "rayquery",
        }
    }
}

/// How much of the scene takes part.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Level {
    /// The world alone, everything opaque.
    Single,
    /// World and placed meshes, everything opaque.
    Two,
    /// World and placed meshes with alpha tests.
    Alpha,
}

impl Level {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Single, Self::Two, Self::Alpha];

    fn name(self) -> &'static str {
        match self {
            Self::Single => "single",
            Self::Two => "two",
            Self::Alpha => "alpha",
        }
    }
}

/// Which rays.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Workload {
    /// P: from the eye through the pixel centres.
    Primary,
    /// S: from each primary hit to a point on an emitter, any hit.
    Shadow,
    /// D: from each primary hit one cosine-weighted bounce.
    Diffuse,
}

impl Workload {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Primary, Self::Shadow, Self::Diffuse];

    fn name(self) -> &'static str {
        match self {
            Self::Primary => "primary",
            Self::Shadow => "shadow",
            Self::Diffuse => "diffuse",
        }
    }

    fn secondary(self) -> bool {
        self != Self::Primary
    }

    fn any_hit(self) -> bool {
        self == Self::Shadow
    }
}

/// How to measure.
#[derive(Clone, Copy, Debug)]
pub struct RaysOptions {
    pub size: (u32, u32),
    /// Timed dispatches of each combination.
    pub dispatches: u32,
}

/// Moves the eye off round coordinates: on them rays run along edges of the map's grid, where the trees rightly differ.
pub const EYE_JITTER: [f32; 3] = [0.137, 0.071, 0.219];
/// Edge of the tiles of pixels that work groups hold.
const TILE: u32 = 8;
/// Wall time that a combination runs untimed, so that clocks are up: without it figures wander by a factor of two.
const WARM_UP: Duration = Duration::from_millis(200);
/// Wall time of one submission, well below what watchdogs tolerate.
const SUBMISSION: Duration = Duration::from_millis(200);
/// Relative difference of distances that counts as the same hit.
const SAME_DISTANCE: f32 = 1e-3;

/// A scene with rays, ready to be measured.
pub struct RaysBench<'a> {
    scene: &'a SceneGpu,
    buffers: RayBuffers,
    _constants: Buffer,
    push: Push,
    groups: [u32; 3],
    options: RaysOptions,
}

impl<'a> RaysBench<'a> {
    /// Makes the buffers.
    ///
    /// # Errors
    /// [`RenderError`] of the device.
    pub fn new(
        scene: &Scene,
        gpu: &'a SceneGpu,
        camera: &Camera,
        options: RaysOptions,
        seed: u32,
    ) -> Result<Self, RenderError> {
        let groups = [options.size.0.div_ceil(TILE), options.size.1.div_ceil(TILE), 1];
        let count = u64::from(groups[0]) * u64::from(groups[1]) * u64::from(TILE * TILE);
        let buffers = RayBuffers::new(&gpu.device, scene, count)?;
        let constants = device_buffer(
            &gpu.device,
            "bench constants",
            &[FrameConstants {
                seed,
                ..gpu.constants(camera, options.size)
            }],
        )?;
        Ok(Self {
            scene: gpu,
            buffers,
            push: Push {
                frame: constants.address(),
                sample_index: 0,
                accumulated: 0,
                level: 0,
                padding: 0,
            },
            _constants: constants,
            groups,
            options,
        })
    }

    /// Number of combinations that [`Self::run`] measures.
    pub fn combinations(ray_query: bool) -> u64 {
        let combinations = |tree: &Tree| {
            Level::ALL
                .iter()
                .filter(|&&level| possible(*tree, level, ray_query))
                .count()
        };
        (Tree::ALL.iter().map(combinations).sum::<usize>() * Workload::ALL.len()) as u64
    }

    /// Measures everything. `step` is called after each combination.
    ///
    /// # Errors
    /// [`RenderError`] of the device.
    pub fn run(&self, scene: &Scene, step: &dyn Fn()) -> Result<MapReport, RenderError> {
        let mut report = MapReport {
            map: scene.name.clone(),
            triangles: scene.geometry.triangles.len(),
            instances: self.scene.instance_count,
            rates: Vec::new(),
            agreements: Vec::new(),
        };
        let ray_query = self.scene.backend == Backend::RayQuery;
        let (w, h) = self.options.size;
        let mut rays = u64::from(w) * u64::from(h);
        for workload in Workload::ALL {
            if workload.secondary() {
                // The rays' origins are the opaque scene's hits, whatever was measured last.
                let origins = self.pipeline("bench_rays_cwbvh_two", false)?;
                self.submit(1, None, |cmd| self.record(cmd, &origins, false))?;
                let hits = self.buffers.hits(false)?;
                rays = hits.iter().filter(|hit| hit[1] != NONE).count() as u64;
            }
            let generate = self.pipeline(&format!("bench_generate_{}", workload.name()), false)?;
            self.submit(1, None, |cmd| self.record(cmd, &generate, workload.secondary()))?;
            for level in Level::ALL {
                let mut expected = None;
                for tree in Tree::ALL {
                    if !possible(tree, level, ray_query) {
                        continue;
                    }
                    let form = format!("bench_rays_{}_{}", tree.name(), level.name());
                    let milliseconds = self.measure(&self.pipeline(&form, workload.any_hit())?, workload)?;
                    report.rates.push(Rate {
                        tree,
                        level,
                        workload,
                        milliseconds,
                        rays,
                        mrays_per_second: rays as f64 / (milliseconds * 1e3),
                    });
                    let hits = self.buffers.hits(workload.secondary())?;
                    let expected = expected.get_or_insert_with(|| hits.clone());
                    report
                        .agreements
                        .push(agreement(tree, level, workload, expected, &hits, rays));
                    step();
                }
            }
        }
        Ok(report)
    }

    fn pipeline(&self, form: &str, any_hit: bool) -> Result<ComputePipeline, GpuError> {
        let spirv = shader_table::load_spirv(form)?;
        ComputePipeline::new(
            &self.scene.device,
            &ComputePipelineDesc {
                name: form,
                spirv: &spirv,
                layouts: &[&self.scene.layout, &self.buffers.layout],
                push_constant_bytes: size_of::<Push>() as u32,
                specialization: &[(0, u32::from(any_hit))],
                cache: None,
            },
        )
    }

    fn record(&self, cmd: &Commands<'_>, pipeline: &ComputePipeline, secondary: bool) -> Result<(), GpuError> {
        pipeline.bind(cmd, &[self.scene.sets.raw(0), self.buffers.set(secondary)])?;
        pipeline.push(cmd, &self.push)?;
        pipeline.dispatch(cmd, self.groups)
    }

    /// Runs a dispatch `count` times, one after the other; returns the wall time.
    fn submit(
        &self,
        count: u32,
        timestamps: Option<&Timestamps>,
        record: impl Fn(&Commands<'_>) -> Result<(), GpuError>,
    ) -> Result<Duration, GpuError> {
        let begun = Instant::now();
        self.scene.device.submit_once("bench rays", |cmd| {
            if let Some(timestamps) = timestamps {
                timestamps.reset(cmd);
            }
            for _ in 0..count {
                cmd.barrier(&Barrier::between(Access::ComputeWrite, Access::ComputeReadWrite));
                match timestamps {
                    Some(timestamps) => timestamps.scope(cmd, "rays", &record)?,
                    None => record(cmd)?,
                }
            }
            Ok(())
        })?;
        Ok(begun.elapsed())
    }

    /// Median milliseconds of a dispatch: on the GPU's clock, or on the CPU's where the queue has none.
    fn measure(&self, pipeline: &ComputePipeline, workload: Workload) -> Result<f64, GpuError> {
        let record = |cmd: &Commands<'_>| self.record(cmd, pipeline, workload.secondary());
        let once = self.submit(1, None, record)?;
        let batch = (SUBMISSION.as_secs_f64() / once.as_secs_f64().max(1e-6)) as u32;
        let batch = batch.clamp(1, self.options.dispatches);
        let begun = Instant::now();
        while begun.elapsed() + once < WARM_UP {
            self.submit(batch, None, record)?;
        }
        let timestamps = Timestamps::new(&self.scene.device, batch)?;
        let mut times = Vec::new();
        while times.len() < self.options.dispatches as usize {
            let count = batch.min(self.options.dispatches - times.len() as u32);
            let wall = self.submit(count, Some(&timestamps), record)?;
            match timestamps.read()? {
                Some(scopes) if scopes.len() == count as usize => times.extend(scopes.iter().map(|s| s.milliseconds)),
                _ => times.extend((0..count).map(|_| wall.as_secs_f64() * 1e3 / f64::from(count))),
            }
        }
        times.sort_by(f64::total_cmp);
        let middle = times.len() / 2;
        Ok(if times.len().is_multiple_of(2) {
            (times[middle - 1] + times[middle]) * 0.5
        } else {
            times[middle]
        })
    }
}

/// The driver has no walk over the world alone, and may have none at all.
fn possible(tree: Tree, level: Level, ray_query: bool) -> bool {
    tree != Tree::RayQuery || (ray_query && level != Level::Single)
}

/// Whether two traversals found the same: the same triangle, or one at the same distance.
fn same_hit(a: &HitRecord, b: &HitRecord, any_hit: bool) -> bool {
    if a[1] == NONE || b[1] == NONE || any_hit {
        return (a[1] == NONE) == (b[1] == NONE);
    }
    let (ta, tb) = (f32::from_bits(a[0]), f32::from_bits(b[0]));
    (a[1], a[2]) == (b[1], b[2]) || (ta - tb).abs() <= SAME_DISTANCE * ta.max(tb)
}

fn agreement(
    tree: Tree,
    level: Level,
    workload: Workload,
    expected: &[HitRecord],
    hits: &[HitRecord],
    rays: u64,
) -> Agreement {
    let pairs = expected.iter().zip(hits);
    let different = pairs.filter(|(a, b)| !same_hit(a, b, workload.any_hit())).count();
    let share = |count: usize| count as f64 / rays.max(1) as f64;
    Agreement {
        tree,
        level,
        workload,
        disagreement: share(different),
        hits: share(hits.iter().filter(|hit| hit[1] != NONE).count()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hits_are_the_same_by_triangle_or_distance() {
        let hit = |t: f32, triangle: u32| [t.to_bits(), triangle, 0, 0];
        assert!(same_hit(&hit(10.0, 3), &hit(10.5, 3), false));
        assert!(same_hit(&hit(10.0, 3), &hit(10.001, 4), false));
        assert!(!same_hit(&hit(10.0, 3), &hit(10.5, 4), false));
        assert!(!same_hit(&hit(10.0, 3), &hit(10.0, NONE), false));
        assert!(same_hit(&hit(10.0, 3), &hit(90.0, 7), true));
        assert!(!same_hit(&hit(10.0, 3), &hit(90.0, NONE), true));
        assert!(same_hit(&hit(0.0, NONE), &hit(1.0, NONE), false));
    }
}
