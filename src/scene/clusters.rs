//! PVS clusters: which lights can reach which receivers.
//!
//! A *row* lists lights in ascending order as runs of consecutive indices (lights stand in the order of a tree over space,
//! so that those of one place come together). Rows 0..clusters belong to the PVS clusters;
//! behind them stand the fall-back rows of surfaces whose receivers may lie in solid; the last row holds every light.

use super::records::{BspNode, LightRow, LightRun};
use crate::assets::bsp::{Bounds, Bsp};
use glam::{Affine3A, Vec3};
use rayon::prelude::*;
use std::collections::HashMap;
use std::sync::Arc;

/// How far a receiver is moved along its geometric normal, in turn, until it lies in open space (units).
pub const NUDGES: [f32; 5] = [0.25, 1.0, 4.0, 8.0, 16.0];

/// A set of clusters as a bit row.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub struct ClusterSet(pub Vec<u64>);

impl ClusterSet {
    /// The empty set of a map with `clusters` clusters.
    pub fn new(clusters: u32) -> Self {
        Self(vec![0; (clusters as usize).div_ceil(64)])
    }

    /// Adds a cluster.
    pub fn insert(&mut self, cluster: u32) {
        self.0[cluster as usize / 64] |= 1 << (cluster % 64);
    }

    /// Whether the cluster is in the set.
    pub fn contains(&self, cluster: u32) -> bool {
        self.0[cluster as usize / 64] >> (cluster % 64) & 1 == 1
    }

    /// Adds another set.
    pub fn unite(&mut self, other: &Self) {
        for (a, b) in self.0.iter_mut().zip(&other.0) {
            *a |= b;
        }
    }

    /// Whether the sets share a cluster.
    pub fn meets(&self, other: &Self) -> bool {
        self.0.iter().zip(&other.0).any(|(a, b)| a & b != 0)
    }

    /// No cluster at all.
    pub fn is_empty(&self) -> bool {
        self.0.iter().all(|&w| w == 0)
    }

    /// The clusters in ascending order.
    pub fn iter(&self) -> impl Iterator<Item = u32> + '_ {
        self.0.iter().enumerate().flat_map(|(i, &word)| {
            (0..64)
                .filter(move |b| word >> b & 1 == 1)
                .map(move |b| i as u32 * 64 + b)
        })
    }
}

/// The map's cluster structure without lights.
#[derive(Clone, Debug)]
pub struct ClusterMap {
    pub count: u32,
    /// Row of each cluster: what may be seen from it.
    visible: Vec<ClusterSet>,
    /// Bounds of each cluster's leafs.
    pub bounds: Vec<Bounds>,
    /// Clusters of the leafs that list each surface.
    pub of_surface: Vec<ClusterSet>,
}

impl ClusterMap {
    /// Reads clusters and PVS. `far_plane`: the map's `_farplanedist`, beyond which its vis was cut (units).
    pub fn new(bsp: &Bsp, far_plane: Option<f32>) -> Self {
        let count = bsp.cluster_count();
        let mut bounds = vec![Bounds::EMPTY; count as usize];
        let mut of_surface = vec![ClusterSet::new(count); bsp.surfaces.len()];
        for leaf in &bsp.leafs {
            let Ok(cluster) = u32::try_from(leaf.cluster) else {
                continue;
            };
            let b = Bounds {
                min: Vec3::from(leaf.mins.map(|x| x as f32)),
                max: Vec3::from(leaf.maxs.map(|x| x as f32)),
            };
            bounds[cluster as usize] = bounds[cluster as usize].union(b);
            let first = leaf.first_leaf_surface as usize;
            for &s in &bsp.leaf_surfaces[first..first + leaf.leaf_surface_count as usize] {
                of_surface[s as usize].insert(cluster);
            }
        }
        let visible = (0..count)
            .into_par_iter()
            .map(|from| {
                let mut row = ClusterSet::new(count);
                for to in 0..count {
                    let seen = bsp.visibility.as_ref().is_none_or(|v| v.sees(from, to));
                    let cut = far_plane.is_some_and(|far| bounds[from as usize].gap(bounds[to as usize]) > far);
                    if seen || cut || from == to {
                        row.insert(to);
                    }
                }
                row
            })
            .collect();
        Self {
            count,
            visible,
            bounds,
            of_surface,
        }
    }

    /// What may be seen from `cluster`.
    pub fn visible_from(&self, cluster: u32) -> &ClusterSet {
        &self.visible[cluster as usize]
    }

    /// Clusters of all leafs that a triangle touches.
    pub fn at_triangle(&self, bsp: &Bsp, corners: [Vec3; 3]) -> ClusterSet {
        let mut set = ClusterSet::new(self.count);
        bsp.leafs_at_triangle(corners, |leaf| {
            if let Ok(cluster) = u32::try_from(bsp.leafs[leaf].cluster) {
                set.insert(cluster);
            }
        });
        set
    }

    /// Clusters of all leafs that a box touches.
    pub fn in_box(&self, bsp: &Bsp, bounds: Bounds) -> ClusterSet {
        let mut set = ClusterSet::new(self.count);
        bsp.leafs_in_box(bounds, |leaf| {
            if let Ok(cluster) = u32::try_from(bsp.leafs[leaf].cluster) {
                set.insert(cluster);
            }
        });
        set
    }
}

/// Where a light can act, for list building.
#[derive(Clone, Debug)]
pub struct LightReach {
    /// Clusters the light touches; `None`: unknown or everywhere, it is in every row.
    pub clusters: Option<ClusterSet>,
    /// One-sided emitters: nothing on or behind this plane (unit normal, distance) is lit.
    pub front: Option<(Vec3, f32)>,
    /// Poses of a light that moves, relative to where its record has it; those between lie within the bounds of all. None: it
    /// stands still.
    pub sweep: Option<Arc<[Affine3A]>>,
}

impl LightReach {
    /// Of a light that stands still.
    pub fn still(clusters: Option<ClusterSet>, front: Option<(Vec3, f32)>) -> Self {
        Self {
            clusters,
            front,
            sweep: None,
        }
    }
}

/// Light lists of all rows at one culling level.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LightLists {
    pub rows: Vec<LightRow>,
    pub runs: Vec<LightRun>,
}

impl LightLists {
    fn push(&mut self, lights: impl Iterator<Item = u32>, sums: &[u32]) -> u32 {
        let first_run = self.runs.len() as u32;
        let (mut light_count, mut weight) = (0, 0);
        for light in lights {
            match self.runs.get_mut(first_run as usize..).and_then(<[_]>::last_mut) {
                Some(run) if run.first_light + run.count == light => run.count += 1,
                _ => self.runs.push(LightRun {
                    first_light: light,
                    count: 1,
                    before: light_count,
                    weight_before: weight,
                }),
            }
            light_count += 1;
            weight += sums[light as usize + 1] - sums[light as usize];
        }
        self.rows.push(LightRow {
            first_run,
            run_count: self.runs.len() as u32 - first_run,
            light_count,
            weight,
        });
        self.rows.len() as u32 - 1
    }

    /// The lights of a row in ascending order.
    pub fn lights(&self, row: u32) -> impl Iterator<Item = u32> + '_ {
        let row = self.rows[row as usize];
        self.runs[row.first_run as usize..(row.first_run + row.run_count) as usize]
            .iter()
            .flat_map(|run| run.first_light..run.first_light + run.count)
    }
}

/// Rows for clusters, for surfaces in need of a fall-back, and for "all lights".
#[derive(Clone, Debug, Default)]
pub struct LightRows {
    /// Culling by PVS (`rt_cullLights 1`).
    pub pvs: LightLists,
    /// Also without lights that face away from the whole cluster (`rt_cullLights 2`); same row numbers.
    pub tight: LightLists,
    /// Row of each surface for receivers in solid.
    pub surface_row: Vec<u32>,
    /// Row that holds every light; the last one.
    pub all_row: u32,
}

impl LightRows {
    /// Row of receivers on a surface of the map that lie in no cluster; of all lights for what is no such surface.
    pub fn fallback(&self, surface: u32) -> u32 {
        self.surface_row.get(surface as usize).copied().unwrap_or(self.all_row)
    }
}

/// Margin by which a cluster's receivers may lie outside its leafs: the largest nudge, and rounding of leaf bounds.
const RECEIVER_MARGIN: f32 = NUDGES[NUDGES.len() - 1] + 1.0;

/// Lists lights by cluster, by fall-back set and overall. `sums`: prefix sums of the lights' weights.
pub fn build_light_rows(map: &ClusterMap, reach: &[LightReach], sums: &[u32]) -> LightRows {
    // Lights of one surface share their clusters: each distinct set is tested once per row.
    let mut sets: HashMap<&ClusterSet, u32> = HashMap::new();
    let mut distinct: Vec<&ClusterSet> = Vec::new();
    let set_of: Vec<u32> = reach
        .iter()
        .map(|r| match &r.clusters {
            None => u32::MAX,
            Some(set) => *sets.entry(set).or_insert_with(|| {
                distinct.push(set);
                distinct.len() as u32 - 1
            }),
        })
        .collect();
    let lights_seen = |visible: &ClusterSet| -> Vec<u32> {
        let seen: Vec<bool> = distinct.iter().map(|set| visible.meets(set)).collect();
        (0..reach.len() as u32)
            .filter(|&i| set_of[i as usize] == u32::MAX || seen[set_of[i as usize] as usize])
            .collect()
    };
    let faces = |light: u32, bounds: Bounds| {
        reach[light as usize].front.is_none_or(|(normal, dist)| {
            let b = bounds.grown(RECEIVER_MARGIN);
            let farthest = Vec3::select(normal.cmpgt(Vec3::ZERO), b.max, b.min);
            normal.dot(farthest) > dist
        })
    };
    let cluster_lights: Vec<(Vec<u32>, Vec<u32>)> = (0..map.count)
        .into_par_iter()
        .map(|c| {
            let pvs = lights_seen(map.visible_from(c));
            let bounds = map.bounds[c as usize];
            let tight = pvs.iter().copied().filter(|&l| faces(l, bounds)).collect();
            (pvs, tight)
        })
        .collect();
    let mut rows = LightRows::default();
    for (pvs, tight) in cluster_lights {
        rows.pvs.push(pvs.into_iter(), sums);
        rows.tight.push(tight.into_iter(), sums);
    }
    // Fall-back rows: the union over a surface's own leafs, shared between surfaces with the same leafs.
    let mut fallback: HashMap<&ClusterSet, u32> = HashMap::new();
    let mut pending = Vec::new();
    for set in &map.of_surface {
        let row = if set.is_empty() {
            u32::MAX
        } else {
            *fallback.entry(set).or_insert_with(|| {
                let mut visible = ClusterSet::new(map.count);
                for c in set.iter() {
                    visible.unite(map.visible_from(c));
                }
                let lights = lights_seen(&visible);
                rows.tight.push(lights.iter().copied(), sums);
                rows.pvs.push(lights.into_iter(), sums)
            })
        };
        pending.push(row);
    }
    rows.tight.push(0..reach.len() as u32, sums);
    rows.all_row = rows.pvs.push(0..reach.len() as u32, sums);
    rows.surface_row = pending
        .into_iter()
        .map(|row| if row == u32::MAX { rows.all_row } else { row })
        .collect();
    rows
}

/// The BSP tree with leafs replaced by their clusters; a map without nodes gets one node whose both sides are its leaf.
pub fn bsp_records(bsp: &Bsp) -> Vec<BspNode> {
    let leaf = |leaf: usize| {
        let cluster = bsp.leafs.get(leaf).map_or(-1, |l| l.cluster.max(-1));
        -1 - (cluster + 1)
    };
    if bsp.nodes.is_empty() {
        return vec![BspNode {
            normal: [0.0, 0.0, 1.0],
            dist: 0.0,
            children: [leaf(0); 2],
        }];
    }
    bsp.nodes
        .iter()
        .map(|node| {
            let plane = &bsp.planes[node.plane as usize];
            BspNode {
                normal: plane.normal,
                dist: plane.dist,
                children: node.children.map(|c| if c >= 0 { c } else { leaf((-1 - c) as usize) }),
            }
        })
        .collect()
}

/// Cluster at a point by the records above; `None` in solid.
pub fn cluster_at(nodes: &[BspNode], point: Vec3) -> Option<u32> {
    let mut at = 0i32;
    loop {
        let node = &nodes[at as usize];
        let side = Vec3::from(node.normal).dot(point) - node.dist;
        at = node.children[usize::from(side < 0.0)];
        if at < 0 {
            return u32::try_from(-2 - at).ok();
        }
    }
}
