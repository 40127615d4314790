//! Fills the light cells of a scene: what the receivers of a cell get from each part of the light tree, by the tree's own
//! estimate and by traced samples.

use super::light_choice::{Part, importance, sun_importance};
use super::light_sample::{PointSampling, sample_light};
use super::surface::{SurfaceHit, classify, offset_point};
use super::trace::{Tracer, point_to_world};
use super::visibility::visible;
use crate::scene::Scene;
use crate::scene::clusters::cluster_at;
use crate::scene::light_cells::{LightCells, place};
use crate::scene::light_power::luminance;
use crate::scene::records::{CellEntry, LightRun, MATERIAL_SKY, NONE};
use crate::scene::sampling::{key, pcg, triangle, unit};
use glam::Vec3;
use rayon::prelude::*;
use std::collections::HashMap;

/// Distance between the points of a surface that stand for its receivers, units.
const SPACING: f32 = 24.0;
/// Most points that a triangle gets, so that a wall of a sky box costs no more than it is worth.
const MOST_POINTS: u32 = 4096;
/// Points that stand for the receivers of a cell.
const RECEIVERS: usize = 12;
/// Most entries of a cell, suns apart.
const MOST_ENTRIES: usize = 64;
/// A part of the tree that is estimated to give less than this share of the light is not split.
const WORTH_SPLITTING: f32 = 1.0 / 512.0;
/// Traced samples of an entry, by its share of the estimate.
const MOST_SAMPLES: u32 = 16;
const SAMPLES_BY_SHARE: f32 = 192.0;
/// Most by which traced samples raise the tree's estimate where they were not taken.
const MOST_RATIO: f32 = 4.0;
/// Share of the tree's estimate that counts along with the traced samples: what they found hidden may be in view from where
/// they did not look.
const TRUST_IN_ESTIMATE: f32 = 0.1;
/// Share of the whole that every entry gets by power, since the points are not all receivers there are.
const BY_POWER: f32 = 0.02;

/// A point on a surface, seen from one side.
#[derive(Clone, Copy)]
struct Receiver {
    position: Vec3,
    normal: Vec3,
}

impl Receiver {
    fn hit(&self) -> SurfaceHit {
        SurfaceHit::receiver(self.position, self.normal, NONE)
    }
}

/// Points on all surfaces, by row and place. Which ones a full cell keeps depends on their order alone.
fn receivers(scene: &Scene, tracer: &Tracer) -> Vec<((u32, u32), Vec<Receiver>)> {
    let mut cells: HashMap<(u32, u32), (u32, Vec<Receiver>)> = HashMap::new();
    let mut put = |row: u32, receiver: Receiver| {
        let at = (row, place(receiver.position, receiver.normal));
        let (seen, kept) = cells.entry(at).or_default();
        // Reservoir sampling (Vitter 1985, algorithm R).
        if kept.len() < RECEIVERS {
            kept.push(receiver);
        } else {
            let slot = (u64::from(pcg(*seen)) * u64::from(*seen + 1)) >> 32;
            if let Some(old) = kept.get_mut(slot as usize) {
                *old = receiver;
            }
        }
        *seen += 1;
    };
    for instance in &tracer.instances {
        let mesh = &scene.geometry.meshes[instance.mesh as usize];
        for index in mesh.first_triangle..mesh.first_triangle + mesh.triangle_count {
            let t = &scene.geometry.triangles[index as usize];
            if scene.materials[t.material as usize].flags & MATERIAL_SKY != 0 {
                continue;
            }
            let [a, b, c] = scene.geometry.corners(index).map(|p| point_to_world(instance, p));
            let cross = (b - a).cross(c - a);
            let Some(normal) = cross.try_normalize() else { continue };
            let wanted = cross.length() * 0.5 / (SPACING * SPACING);
            let count = (wanted.ceil() as u32).clamp(1, MOST_POINTS);
            for i in 0..count {
                let [b1, b2] = triangle(plastic(i));
                let position = a + (b - a) * b1 + (c - a) * b2;
                for normal in [normal, -normal] {
                    // The side of a wall that no ray sees is in solid.
                    if cluster_at(&scene.bsp_nodes, position + normal).is_some() {
                        let (_, row) = classify(scene, position, normal, t.fallback_row);
                        put(row, Receiver { position, normal });
                    }
                }
            }
        }
    }
    let mut cells: Vec<_> = cells.into_iter().map(|(at, (_, kept))| (at, kept)).collect();
    cells.sort_unstable_by_key(|c| c.0);
    cells
}

/// The i-th point of the R2 sequence.
fn plastic(i: u32) -> [f32; 2] {
    // 2³² over the plastic number and over its square.
    let at = |step: u32| unit(0x8000_0000u32.wrapping_add(step.wrapping_mul(i)));
    [at(3_242_174_889), at(2_447_445_414)]
}

/// A range of lights on its way to being an entry.
#[derive(Clone, Copy)]
struct Range {
    /// Node of the tree; `None` for a sun.
    node: Option<usize>,
    first: u32,
    count: u32,
    part: Part,
    /// Irradiance/π by the tree's estimate, mean over the receivers.
    estimate: f32,
}

struct Filler<'a> {
    scene: &'a Scene,
    tracer: &'a Tracer,
    runs: &'a [LightRun],
    receivers: &'a [SurfaceHit],
    /// Salt of the random numbers.
    salt: u32,
}

impl Filler<'_> {
    fn estimated(&self, range: Range) -> Range {
        let sum: f32 = self.receivers.iter().map(|at| self.expected(&range, at)).sum();
        Range {
            estimate: sum / self.receivers.len() as f32,
            ..range
        }
    }

    fn node(&self, node: usize, part: Part) -> Range {
        let record = &self.scene.lights.tree.nodes[node];
        self.estimated(Range {
            node: Some(node),
            first: record.first,
            count: record.count,
            part,
            estimate: 0.0,
        })
    }

    /// Ranges that hold all lights of the row.
    fn ranges(&self, row_weight: u32) -> Vec<Range> {
        let lights = &self.scene.lights;
        let whole = Part {
            from: 0,
            to: self.runs.len(),
            before: 0,
            after: row_weight,
        };
        let (finite, suns) = whole.split(&lights.weights, self.runs, lights.tree.finite);
        let mut done = Vec::new();
        let mut open = Vec::new();
        if finite.weight() > 0 {
            open.push(self.node(0, finite));
        }
        while !open.is_empty() && open.len() + done.len() < MOST_ENTRIES {
            let total: f32 = open.iter().chain(&done).map(|r: &Range| r.estimate).sum();
            let best = (0..open.len()).max_by(|a, b| open[*a].estimate.total_cmp(&open[*b].estimate));
            let Some(best) = best else { break };
            if open[best].estimate <= total * WORTH_SPLITTING {
                break;
            }
            let range = open.swap_remove(best);
            let Some(node) = range.node.filter(|_| range.count > 1) else {
                done.push(range);
                continue;
            };
            let (l, r) = (node + 1, lights.tree.nodes[node].right as usize);
            let (left, right) = range.part.split(&lights.weights, self.runs, lights.tree.nodes[r].first);
            open.extend(
                [self.node(l, left), self.node(r, right)]
                    .into_iter()
                    .filter(|c| c.part.weight() > 0),
            );
        }
        done.append(&mut open);
        for r in &self.runs[suns.from..suns.to] {
            for sun in r.first_light.max(lights.tree.finite)..r.first_light + r.count {
                done.push(self.estimated(Range {
                    node: None,
                    first: sun,
                    count: 1,
                    part: suns,
                    estimate: 0.0,
                }));
            }
        }
        done
    }

    /// One traced sample of what a range gives to a receiver, irradiance/π; the `i`-th of `samples` that are stratified by
    /// power.
    fn traced(&self, range: &Range, at: &SurfaceHit, i: u32, samples: u32) -> f32 {
        let (lights, sums) = (&self.scene.lights, &self.scene.lights.weights);
        let base = sums[range.first as usize];
        let weight = self.weight(range);
        let random = |d: u32| key(self.salt, range.first.wrapping_mul(31).wrapping_add(i), d);
        let x = ((u64::from(random(0)) + (u64::from(i) << 32)) / u64::from(samples) * u64::from(weight)) >> 32;
        let x = base + (x as u32).min(weight - 1);
        let span = &sums[range.first as usize..(range.first + range.count) as usize];
        let light = range.first + span.partition_point(|s| *s <= x) as u32 - 1;
        let own = sums[light as usize + 1] - sums[light as usize];
        let u = [unit(random(1)), unit(random(2))];
        let record = &lights.lights[light as usize];
        match sample_light(self.scene, record, at, u, PointSampling::SolidAngle) {
            Some(s) => {
                let share = visible(
                    self.scene,
                    self.tracer,
                    offset_point(at.position, at.geometric_normal),
                    &s,
                );
                luminance((s.value * share).into()) * weight as f32 / own as f32
            }
            None => 0.0,
        }
    }

    fn weight(&self, range: &Range) -> u32 {
        let sums = &self.scene.lights.weights;
        sums[(range.first + range.count) as usize] - sums[range.first as usize]
    }

    /// What the tree expects a range to give to a receiver.
    fn expected(&self, range: &Range, at: &SurfaceHit) -> f32 {
        let lights = &self.scene.lights;
        match range.node {
            Some(node) => {
                importance(&lights.tree.nodes[node], at) * range.part.weight() as f32 * lights.strength_of_one
            }
            None => sun_importance(&lights.lights[range.first as usize], at),
        }
    }

    /// What a range gives to each receiver: traced samples where there are some, else what is expected in the ratio that
    /// the traced ones tell.
    fn values(&self, range: &Range, share: f32) -> Vec<f32> {
        let n = self.receivers.len();
        let expected: Vec<f32> = self.receivers.iter().map(|at| self.expected(range, at)).collect();
        let samples = ((share * SAMPLES_BY_SHARE).ceil() as u32).clamp(1, MOST_SAMPLES);
        let mut seen = vec![(0.0, 0u32); n];
        let (mut got, mut hoped) = (0.0, 0.0);
        for i in 0..samples {
            let r = (i as usize + range.first as usize) % n;
            if expected[r] > 0.0 {
                let value = self.traced(range, &self.receivers[r], i, samples);
                seen[r].0 += value;
                seen[r].1 += 1;
                got += value;
                hoped += expected[r];
            }
        }
        let ratio = if hoped > 0.0 {
            (got / hoped).min(MOST_RATIO)
        } else {
            1.0
        };
        (0..n)
            .map(|r| {
                let (sum, count) = seen[r];
                // A receiver that was looked from in vain still stands for others.
                let own = if count > 0 {
                    sum / count as f32
                } else {
                    expected[r] * ratio
                };
                0.5 * (own + expected[r] * ratio) + TRUST_IN_ESTIMATE * expected[r]
            })
            .collect()
    }

    /// A distribution for all receivers: the mean of what would be each one's own.
    fn entries(&self, row_weight: u32) -> Vec<CellEntry> {
        let mut ranges = self.ranges(row_weight);
        // In the tree's order neighbours are near each other, and numbers that are spread evenly spread over space.
        ranges.sort_unstable_by_key(|r| r.first);
        let total: f32 = ranges.iter().map(|r| r.estimate).sum();
        let values: Vec<Vec<f32>> = ranges.iter().map(|r| self.values(r, r.estimate / total)).collect();
        let mut shares = vec![0.0; ranges.len()];
        let mut lit = 0.0;
        for r in 0..self.receivers.len() {
            let sum: f32 = values.iter().map(|v| v[r]).sum();
            if sum > 0.0 && sum.is_finite() {
                lit += 1.0;
                shares.iter_mut().zip(&values).for_each(|(s, v)| *s += v[r] / sum);
            }
        }
        if lit == 0.0 {
            return Vec::new();
        }
        let all: f32 = ranges.iter().map(|r| self.weight(r) as f32).sum();
        ranges
            .iter()
            .zip(&shares)
            .map(|(r, share)| CellEntry {
                first_light: r.first,
                light_count: r.count,
                probability: (1.0 - BY_POWER) * share / lit + BY_POWER * self.weight(r) as f32 / all,
                weight: self.weight(r),
            })
            .collect()
    }
}

/// Makes the light cells of a scene. The same scene gives the same cells.
pub fn build(scene: &Scene, tracer: &Tracer) -> LightCells {
    if scene.lights.lights.is_empty() {
        return LightCells::default();
    }
    let lists = &scene.rows.pvs;
    let cells: Vec<(u32, u32, Vec<CellEntry>)> = receivers(scene, tracer)
        .into_par_iter()
        .map(|((row, place), points)| {
            let record = lists.rows[row as usize];
            let runs = &lists.runs[record.first_run as usize..(record.first_run + record.run_count) as usize];
            let hits: Vec<SurfaceHit> = points.iter().map(Receiver::hit).collect();
            let filler = Filler {
                scene,
                tracer,
                runs,
                receivers: &hits,
                salt: pcg(row ^ place),
            };
            let entries = if record.light_count == 0 {
                Vec::new()
            } else {
                filler.entries(record.weight)
            };
            (row, place, entries)
        })
        .collect();
    LightCells::new(cells)
}

/// Makes the light cells of a scene that has none yet.
pub fn fill(scene: &mut Scene) {
    let tracer = Tracer::new(scene);
    scene.cells = build(scene, &tracer);
}
