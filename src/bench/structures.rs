//! `bench structures`: what acceleration structures cost, by map: built at load, and each frame as things move.

use crate::gpu::acceleration::{BottomLevel, Refit, TopLevel};
use crate::gpu::{Commands, GpuError};
use crate::render::backend::Backend;
use crate::render::bvh_upload::{MeshTrees, instance_tree};
use crate::render::driver_structures::{DriverStructures, DynamicRefit};
use crate::render::scene_gpu::{RenderError, SceneGpu};
use crate::scene::Scene;
use crate::scene::bvh::BvhQuality;
use crate::scene::clock::Clock;
use crate::scene::records::Instance;
use serde::Serialize;
use std::fmt;
use std::time::Instant;

/// Times that each step is repeated; the median counts.
const REPEATS: u32 = 21;

/// What one map costs. Milliseconds of wall time; of the driver's, submission and waiting included.
#[derive(Clone, Debug, Serialize)]
pub struct MapStructures {
    pub map: String,
    pub triangles: usize,
    pub meshes: usize,
    pub placements: usize,
    /// Placements that move.
    pub moving: usize,
    /// Triangles that deform.
    pub dynamic: usize,
    /// What deforming triangles' boxes, which hold them at all times, have more area than the boxes of the triangles at rest: how much
    /// worse their tree is than one that is built anew in each frame. 1 is as good.
    pub box_growth: Option<f64>,
    /// Bytes that each frame uploads for what moves: instances and the tree over them.
    pub upload_bytes: usize,
    /// Own trees over all meshes, built at load.
    pub own_build_ms: f64,
    /// Own tree over the instances, built each frame.
    pub own_instances_ms: f64,
    /// The driver's, where it has ray queries.
    pub driver: Option<DriverCosts>,
}

/// What the driver's structures cost.
#[derive(Clone, Debug, Serialize)]
pub struct DriverCosts {
    /// All bottom levels, built at load.
    pub bottom_ms: f64,
    pub bottom_bytes_built: u64,
    pub bottom_bytes: u64,
    /// The top level, built each frame.
    pub top_ms: f64,
    /// Refitting what deforms, each frame; `None` where nothing does.
    pub refit_ms: Option<f64>,
    /// Building that anew instead.
    pub rebuild_ms: Option<f64>,
}

/// The measurements of a run.
#[derive(Clone, Debug, Serialize)]
pub struct StructuresReport {
    pub device: String,
    pub driver: String,
    pub maps: Vec<MapStructures>,
}

fn median(mut one: impl FnMut() -> Result<(), RenderError>) -> Result<f64, RenderError> {
    let mut times = Vec::new();
    for _ in 0..REPEATS {
        let start = Instant::now();
        one()?;
        times.push(start.elapsed().as_secs_f64() * 1e3);
    }
    times.sort_by(f64::total_cmp);
    Ok(times[times.len() / 2])
}

/// Measures a map. `gpu` holds it.
///
/// # Errors
/// [`RenderError`] of the device.
pub fn measure(scene: &Scene, gpu: &SceneGpu) -> Result<MapStructures, RenderError> {
    let g = &scene.geometry;
    let later = Clock::from_seconds(1.0).into();
    let records: Vec<Instance> = scene
        .placements
        .iter()
        .map(|p| p.record(&g.meshes, &later, &later))
        .collect();
    let tree = instance_tree(&g.meshes, &records, &scene.name)?.unwrap_or_default();
    let moves = scene.placements.iter().any(|p| p.motion.moves()) || !g.dynamic.parts.is_empty();
    Ok(MapStructures {
        map: scene.name.clone(),
        triangles: g.triangles.len(),
        meshes: g.meshes.len(),
        placements: scene.placements.len(),
        moving: scene.placements.iter().filter(|p| p.motion.moves()).count(),
        dynamic: g.dynamic.parts.iter().map(|p| p.boxes.len()).sum(),
        box_growth: g.dynamic.box_growth(g),
        upload_bytes: if moves {
            size_of_val(records.as_slice()) + size_of_val(tree.nodes.as_slice())
        } else {
            0
        },
        own_build_ms: {
            let start = Instant::now();
            MeshTrees::build(scene, BvhQuality::Balanced)?;
            start.elapsed().as_secs_f64() * 1e3
        },
        own_instances_ms: median(|| Ok(instance_tree(&g.meshes, &records, &scene.name).map(drop)?))?,
        driver: match &gpu.driver {
            Some(driver) => Some(driver_costs(gpu, driver, &records)?),
            None => None,
        },
    })
}

fn driver_costs(gpu: &SceneGpu, driver: &DriverStructures, records: &[Instance]) -> Result<DriverCosts, RenderError> {
    let submit = |record: &mut dyn FnMut(&Commands<'_>) -> Result<(), GpuError>| -> Result<(), RenderError> {
        Ok(gpu.device.submit_once("bench structures", |cmd| record(cmd))?)
    };
    let placed = driver.placed(records);
    let mut top = TopLevel::new(&gpu.device, "bench top level", placed.len().max(1) as u32, 1)?;
    let refits: Vec<(&DynamicRefit, &BottomLevel)> = driver
        .refits
        .iter()
        .filter_map(|r| Some((r, driver.bottom(r.mesh)?)))
        .collect();
    let update = |rebuild: bool| {
        let all = |cmd: &Commands<'_>| {
            refits.iter().try_for_each(|(refit, bottom)| {
                let one = Refit {
                    bottom,
                    geometries: &refit.geometries,
                    rebuild,
                };
                BottomLevel::record_refits(cmd, &[one], &refit.scratch)
            })
        };
        match refits.is_empty() {
            true => Ok(None),
            false => median(|| submit(&mut |cmd| all(cmd))).map(Some),
        }
    };
    Ok(DriverCosts {
        bottom_ms: driver.statistics.milliseconds,
        bottom_bytes_built: driver.statistics.bytes_built,
        bottom_bytes: driver.statistics.bytes_final,
        top_ms: median(|| submit(&mut |cmd| top.record_build(cmd, &placed, 0).map(drop)))?,
        refit_ms: update(false)?,
        rebuild_ms: update(true)?,
    })
}

impl StructuresReport {
    /// The backend to load scenes for: the driver's structures are made where it has any.
    pub fn backend(ray_query: bool) -> Backend {
        if ray_query { Backend::RayQuery } else { Backend::Bvh }
    }
}

impl fmt::Display for StructuresReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let optional = |v: Option<f64>| v.map_or("–".to_owned(), |v| format!("{v:.3}"));
        writeln!(f, "{} ({})\n", self.device, self.driver)?;
        writeln!(
            f,
            "| map | triangles | meshes | placed | moving | deforming | box growth | upload a frame, bytes | own trees, ms | own \
             instance tree, ms | driver's bottom levels, ms | KiB built | KiB compacted | top level, ms | refit, ms | rebuild, ms |"
        )?;
        writeln!(f, "|{}", "---|".repeat(16))?;
        for m in &self.maps {
            write!(
                f,
                "| {} | {} | {} | {} | {} | {} | {} | {} | {:.1} | {:.4} |",
                m.map,
                m.triangles,
                m.meshes,
                m.placements,
                m.moving,
                m.dynamic,
                m.box_growth.map_or("–".to_owned(), |g| format!("{g:.2}")),
                m.upload_bytes,
                m.own_build_ms,
                m.own_instances_ms,
            )?;
            match &m.driver {
                Some(d) => writeln!(
                    f,
                    " {:.1} | {} | {} | {:.3} | {} | {} |",
                    d.bottom_ms,
                    d.bottom_bytes_built / 1024,
                    d.bottom_bytes / 1024,
                    d.top_ms,
                    optional(d.refit_ms),
                    optional(d.rebuild_ms)
                )?,
                None => writeln!(f, " – | – | – | – | – | – |")?,
            }
        }
        Ok(())
    }
}
