//! What a map holds, in numbers.

use super::Scene;
use super::clusters::{NUDGES, cluster_at};
use super::lights::LightSource;
use super::material::Visibility;
use super::sampling::{Sequence, key, sample2, triangle};
use crate::assets::bsp::lumps::{Lump, SURFACE_FLARE, SURFACE_PATCH, SURFACE_PLANAR, SURFACE_TRIANGLES};
use serde::Serialize;
use std::collections::BTreeMap;

/// Points per map at which receiver classification is tried.
const RECEIVER_SAMPLES: u32 = 20_000;

/// Shares of surface area by how a receiver there finds its light list.
#[derive(Clone, Debug, Default, Serialize)]
pub struct ReceiverShares {
    /// Share that lies in a cluster after each nudge (0.25, 1, 4, 8, 16 units) and not after the ones before.
    pub by_nudge: Vec<f64>,
    /// Share that uses the union over the surface's own leafs.
    pub surface_leafs: f64,
    /// Share that has to consider all lights.
    pub all_lights: f64,
}

/// Everything `q3rays info` tells.
#[derive(Clone, Debug, Serialize)]
pub struct Report {
    pub name: String,
    /// Bytes of each lump.
    pub lumps: BTreeMap<&'static str, usize>,
    pub surfaces: BTreeMap<&'static str, usize>,
    pub triangles: usize,
    pub degenerate_triangles: u32,
    /// Triangles per geometry class.
    pub geometry: BTreeMap<String, u32>,
    /// How much larger the boxes of deforming triangles are than the triangles at rest, by area: what watches over the quality of
    /// their trees, which are never refitted.
    pub deform_box_growth: Option<f64>,
    pub meshes: usize,
    pub placements: usize,
    pub clusters: u32,
    pub vised: bool,
    pub lights: BTreeMap<String, usize>,
    pub light_count: usize,
    /// Light-list rows, runs and the mean share of lights in a cluster's row.
    pub light_rows: usize,
    pub light_runs: usize,
    /// Mean over clusters of lights in the row / all lights, at culling levels 1 and 2.
    pub row_share: [f64; 2],
    pub materials: BTreeMap<&'static str, usize>,
    /// Materials by what they use of the shader language.
    pub features: BTreeMap<&'static str, usize>,
    pub unscripted_materials: usize,
    pub textures: usize,
    pub texture_bytes: usize,
    pub receivers: ReceiverShares,
    pub spawns: Vec<super::spawns::Spawn>,
    /// Entities by class.
    pub entities: BTreeMap<String, usize>,
    /// The compiler stripped its light entities (it does unless worldspawn says `_keepLights`).
    pub light_entities_stripped: bool,
    pub load_ms: BTreeMap<&'static str, f64>,
    pub warnings: Vec<String>,
}

fn count<K: Ord>(keys: impl Iterator<Item = K>) -> BTreeMap<K, usize> {
    let mut out = BTreeMap::new();
    for k in keys {
        *out.entry(k).or_default() += 1;
    }
    out
}

fn snake(value: impl Serialize) -> String {
    serde_json::to_value(value)
        .ok()
        .and_then(|v| v.as_str().map(str::to_owned))
        .unwrap_or_default()
}

fn receivers(scene: &Scene) -> ReceiverShares {
    let world = scene.geometry.meshes.first().map_or(0, |m| m.triangle_count);
    let area = |t: u32| {
        let [a, b, c] = scene.geometry.corners(t);
        f64::from((b - a).cross(c - a).length()) * 0.5
    };
    let mut cumulative = Vec::with_capacity(world as usize);
    let mut total = 0.0;
    for t in 0..world {
        total += area(t);
        cumulative.push(total);
    }
    let mut shares = ReceiverShares {
        by_nudge: vec![0.0; NUDGES.len()],
        ..ReceiverShares::default()
    };
    if total <= 0.0 {
        return shares;
    }
    let weight = 1.0 / f64::from(RECEIVER_SAMPLES);
    for i in 0..RECEIVER_SAMPLES {
        let target = (f64::from(i) + 0.5) * weight * total;
        let t = cumulative.partition_point(|c| *c < target) as u32;
        let [a, b, c] = scene.geometry.corners(t);
        let [b1, b2] = triangle(sample2(Sequence::Random, key(0, 0, 0), i));
        let p = a + (b - a) * b1 + (c - a) * b2;
        let n = (b - a).cross(c - a).normalize();
        let found = NUDGES
            .iter()
            .position(|d| cluster_at(&scene.bsp_nodes, p + n * *d).is_some());
        match found {
            Some(k) => shares.by_nudge[k] += weight,
            None if scene.geometry.triangles[t as usize].fallback_row == scene.rows.all_row => {
                shares.all_lights += weight;
            }
            None => shares.surface_leafs += weight,
        }
    }
    shares
}

impl Report {
    /// Gathers the numbers; receiver shares are estimated from 20,000 points spread over the world by area.
    pub fn new(scene: &Scene) -> Self {
        let bsp = &scene.bsp;
        let mut geometry: BTreeMap<String, u32> = BTreeMap::new();
        for mesh in &scene.geometry.meshes {
            *geometry.entry(snake(mesh.class)).or_default() += mesh.triangle_count;
        }
        let lights = scene.lights.lights.len();
        let share = |lists: &super::clusters::LightLists| {
            let rows = &lists.rows[..scene.clusters.count as usize];
            let sum: f64 = rows.iter().map(|r| f64::from(r.light_count)).sum();
            sum / (rows.len().max(1) as f64 * lights.max(1) as f64)
        };
        let known = scene.lights.count(LightSource::PointEntity) + scene.lights.count(LightSource::SpotEntity);
        Self {
            name: scene.name.clone(),
            lumps: Lump::ALL.iter().map(|l| (l.name(), bsp.lump_bytes(*l).len())).collect(),
            surfaces: count(bsp.surfaces.iter().map(|s| match s.kind {
                SURFACE_PLANAR => "planar",
                SURFACE_PATCH => "patch",
                SURFACE_TRIANGLES => "triangles",
                SURFACE_FLARE => "flare",
                _ => "unknown",
            })),
            triangles: scene.geometry.triangles.len(),
            degenerate_triangles: scene.geometry.degenerate,
            geometry,
            deform_box_growth: scene.geometry.dynamic.box_growth(&scene.geometry),
            meshes: scene.geometry.meshes.len(),
            placements: scene.placements.len(),
            clusters: scene.clusters.count,
            vised: bsp.visibility.is_some(),
            lights: count(scene.lights.sources.iter().map(snake)),
            light_count: lights,
            light_rows: scene.rows.pvs.rows.len(),
            light_runs: scene.rows.pvs.runs.len(),
            row_share: [share(&scene.rows.pvs), share(&scene.rows.tight)],
            materials: count(scene.material_sources.iter().map(|m| match m.visibility {
                Visibility::Opaque => "opaque",
                Visibility::AlphaTested => "alpha_tested",
                Visibility::Sky => "sky",
                Visibility::Layer => "layer",
                Visibility::Invisible => "invisible",
            })),
            features: super::features::features(scene),
            unscripted_materials: scene.material_sources.iter().filter(|m| !m.scripted).count(),
            textures: scene.textures.len(),
            texture_bytes: scene.textures.iter().flat_map(|t| &t.levels).map(|l| l.len() * 4).sum(),
            receivers: receivers(scene),
            spawns: scene.spawns.clone(),
            entities: count(scene.entities.iter().map(|e| e.class().to_owned())),
            light_entities_stripped: known == 0,
            load_ms: scene
                .timings
                .iter()
                .map(|(name, t)| (*name, t.as_secs_f64() * 1e3))
                .collect(),
            warnings: scene.warnings.clone(),
        }
    }
}
