//! A point light against luxels: its column, and the search for its best place.

use super::fit::{Column, Entry, Rows, single, support};
use super::luxels::Luxel;
use super::random::Random;
use super::spot::Cone;
use super::visibility::Occluders;
use crate::scene::clusters::cluster_at;
use glam::Vec3;

/// Irradiance/π of a light of 1 photon at distance 1, luxel units.
pub const POINT: f32 = 7500.0 / 255.0;
/// No light is nearer than this, units.
const NEAREST2: f32 = super::emitter::NEAREST * super::emitter::NEAREST;
/// Below this irradiance at power 1 even the strongest lamp leaves no trace.
const FAINT: f32 = 2e-6;

/// Irradiance/π at a luxel of an unshadowed light of 1 photon.
pub fn unshadowed(luxel: &Luxel, light: Vec3) -> f32 {
    let to = light - luxel.position;
    let d2 = to.length_squared();
    if d2 <= 0.0 {
        return 0.0;
    }
    POINT * luxel.cosine(to) / (d2.sqrt() * d2.max(NEAREST2))
}

/// What the search looks at.
pub struct Search<'a> {
    pub occluders: &'a Occluders<'a>,
    pub luxels: &'a [Luxel],
    pub rows: &'a Rows,
    pub seed: u32,
    /// Factor of each luxel on all light (`-dirty`).
    pub dirt: &'a [f32],
}

/// Rows that stand for all rows near a place.
pub struct Subset(Vec<(u32, f32)>);

/// A place with the power that fits best there.
#[derive(Clone, Copy, Debug)]
pub struct Placed {
    pub position: Vec3,
    pub power: Vec3,
    /// Cost saved.
    pub gain: f32,
}

/// Rows that a light must be carried by.
pub const LEAST_SUPPORT: f32 = 5.0;
/// Rows looked at per light while it is placed.
const REFINE_ROWS: f32 = 500.0;
/// Least cosine with which a row counts when the light may still move.
const LOOSE_COSINE: f32 = 0.2;

impl Search<'_> {
    /// Whether a light may stand at a place.
    pub fn open(&self, position: Vec3) -> bool {
        cluster_at(&self.occluders.scene.bsp_nodes, position).is_some()
    }

    /// The whole column of a light of about a power.
    pub fn column(&self, position: Vec3, power: Vec3) -> Column {
        self.shaped_column(position, None, reach(power))
    }

    /// The same with a reach of its own, and a cone for a spot.
    pub(super) fn shaped_column(&self, position: Vec3, cone: Option<&Cone>, reach: f32) -> Column {
        let (rows, mut values) = column(self.occluders, self.luxels, position, reach, cone);
        values
            .iter_mut()
            .zip(&rows)
            .for_each(|(v, row)| *v *= self.dirt[*row as usize]);
        Column::Free { rows, values }
    }

    /// About `count` fitting rows, chosen by how much a light at a place (or within `slack` units of it) could matter there.
    pub fn subset(&self, position: Vec3, count: f32, slack: f32, random: &mut Random) -> Subset {
        let scene = self.occluders.scene;
        let Some(cluster) = cluster_at(&scene.bsp_nodes, position) else {
            return Subset(Vec::new());
        };
        let visible = scene.clusters.visible_from(cluster);
        let mut total = 0.0;
        let mut found = Vec::new();
        for (row, luxel) in self.luxels.iter().enumerate() {
            if !self.rows.train[row] || !visible.contains(luxel.cluster) {
                continue;
            }
            let to = position - luxel.position;
            let d = to.length();
            let mut cosine = luxel.cosine(to / d.max(f32::MIN_POSITIVE));
            if slack > 0.0 {
                if luxel.normal.dot(to) < -slack && !luxel.two_sided {
                    continue;
                }
                cosine = cosine.max(LOOSE_COSINE);
            }
            let near = (d - slack).max(super::emitter::NEAREST);
            let importance = self.rows.weight[row] * cosine / (near * near);
            if importance > 0.0 {
                total += importance;
                found.push((row as u32, importance));
            }
        }
        let scale = count / total.max(f32::MIN_POSITIVE);
        Subset(
            found
                .into_iter()
                .filter_map(|(row, importance)| {
                    let p = (importance * scale).min(1.0);
                    (random.unit() < p).then_some((row, p.recip()))
                })
                .collect(),
        )
    }

    /// What a light at a place gives the rows of a subset.
    pub fn entries(&self, position: Vec3, subset: &Subset) -> Vec<Entry> {
        let value = |row: u32| {
            let luxel = &self.luxels[row as usize];
            let value = unshadowed(luxel, position);
            if value > FAINT && self.occluders.sees(luxel.origin(position - luxel.position), position) {
                value * self.dirt[row as usize]
            } else {
                0.0
            }
        };
        let Subset(rows) = subset;
        rows.iter()
            .map(|&(row, multiplicity)| Entry {
                row,
                value: value(row),
                multiplicity,
            })
            .collect()
    }

    /// The power of a light at a place and what it saves; nothing where too few rows carry it.
    fn judge(&self, position: Vec3, entries: &[Entry], residual: &impl Fn(usize) -> Vec3) -> Placed {
        let (power, gain) = if support(self.rows, entries) < LEAST_SUPPORT {
            (Vec3::ZERO, 0.0)
        } else {
            single(self.rows, entries, residual)
        };
        Placed { position, power, gain }
    }

    /// Moves a light to where it saves most, within about `radius` units. `residual` is what is unexplained without it.
    pub fn refine(&self, start: Vec3, radius: f32, label: u32, residual: impl Fn(usize) -> Vec3) -> Placed {
        const ROUNDS: usize = 3;
        const PROPOSALS: usize = 7;
        let mut random = Random::new(self.seed, 0x5245, label);
        let subset = self.subset(start, REFINE_ROWS, radius, &mut random);
        let mut entries = self.entries(start, &subset);
        let mut best = self.judge(start, &entries, &residual);
        let mut radius = radius;
        for _ in 0..ROUNDS {
            let proposals = (0..PROPOSALS).map(|_| best.position + random.cube() * radius);
            for p in proposals.collect::<Vec<_>>() {
                self.try_place(p, &subset, &residual, &mut best, &mut entries);
            }
            let slid = self.slide(&best, &entries, radius, &residual);
            self.try_place(slid, &subset, &residual, &mut best, &mut entries);
            radius *= 0.5;
        }
        best
    }

    fn try_place(
        &self,
        position: Vec3,
        subset: &Subset,
        residual: &impl Fn(usize) -> Vec3,
        best: &mut Placed,
        entries: &mut Vec<Entry>,
    ) {
        if position == best.position || !self.open(position) {
            return;
        }
        let new = self.entries(position, subset);
        let placed = self.judge(position, &new, residual);
        if placed.gain > best.gain {
            *best = placed;
            *entries = new;
        }
    }

    /// The best place by compass search while every row keeps its visibility: needs no rays.
    fn slide(&self, from: &Placed, entries: &[Entry], reach: f32, residual: &impl Fn(usize) -> Vec3) -> Vec3 {
        const FINEST: f32 = 0.5;
        let mut seen: Vec<Entry> = entries.iter().filter(|e| e.value > 0.0).copied().collect();
        let (mut at, mut gain) = (from.position, from.gain);
        let mut step = reach * 0.5;
        while step >= FINEST {
            let mut moved = false;
            for axis in [Vec3::X, Vec3::Y, Vec3::Z] {
                for sign in [step, -step] {
                    let p = at + axis * sign;
                    if p.distance(from.position) > reach || !self.open(p) {
                        continue;
                    }
                    for e in &mut seen {
                        e.value = unshadowed(&self.luxels[e.row as usize], p) * self.dirt[e.row as usize];
                    }
                    let placed = self.judge(p, &seen, residual);
                    if placed.gain > gain {
                        (at, gain, moved) = (p, placed.gain, true);
                        break;
                    }
                }
            }
            if !moved {
                step *= 0.5;
            }
        }
        at
    }
}

/// How far the compiler lets a light act: where it gives a byte at most, units.
pub fn reach(power: Vec3) -> f32 {
    (7500.0 * power.max_element()).sqrt()
}

/// Rows that a light reaches and its irradiance there at power 1. `cone` makes a spot of it.
pub fn column(
    occluders: &Occluders,
    luxels: &[Luxel],
    position: Vec3,
    reach: f32,
    cone: Option<&Cone>,
) -> (Vec<u32>, Vec<f32>) {
    let given = |l: &Luxel| unshadowed(l, position) * cone.map_or(1.0, |c| c.part(l.position - position));
    let scene = occluders.scene;
    let Some(cluster) = cluster_at(&scene.bsp_nodes, position) else {
        return (Vec::new(), Vec::new());
    };
    let visible = scene.clusters.visible_from(cluster);
    luxels
        .iter()
        .enumerate()
        .filter_map(|(row, luxel)| {
            if !visible.contains(luxel.cluster) || luxel.position.distance_squared(position) > reach * reach {
                return None;
            }
            if given(luxel) <= FAINT {
                return None;
            }
            let lit = occluders.lit(luxel, position, given);
            (lit > 0.0).then_some((row as u32, lit))
        })
        .unzip()
}
