//! Fills the light cells of a scene: what the receivers of a cell get from each part of the light tree, by the tree's own
//! estimate and by traced samples.

use super::light_choice::{Part, importance, sun_importance};
use super::light_sample::{PointSampling, sample_light};
use super::surface::{SurfaceHit, classify, offset_point};
use super::trace::{Tracer, point_to_world};
use super::visibility::visible;
use crate::scene::Scene;
use crate::scene::clusters::cluster_at;
use crate::scene::light_cells::{CELL_SIZE, LIFT, LightCells, place};
use crate::scene::light_power::luminance;
use crate::scene::records::{CellEntry, LightNode, LightRun, MATERIAL_SKY, NONE};
use crate::scene::sampling::{key, pcg, triangle, unit};
use glam::Vec3;
use rayon::prelude::*;
use std::cmp::Ordering;
use std::collections::{BinaryHeap, HashMap};

/// Changes whenever the same scene would get other cells than before: kept ones are made anew then.
pub const VERSION: u32 = 2;

/// Distance between the points of a surface that stand for its receivers, units.
const SPACING: f32 = 24.0;
/// Most points that a triangle gets, so that a wall of a sky box costs no more than it is worth.
const MOST_POINTS: u32 = 4096;
/// Points that stand for the receivers of a cell.
const RECEIVERS: usize = 24;
/// Lights of a cell that are looked at one by one, suns apart. Where there are more, those that promise least are looked at in
/// the tree's groups.
const MOST_SEEN: usize = 1024;
/// Most entries of a cell, suns apart.
const MOST_ENTRIES: usize = 128;
/// Traced samples that each of a cell's lights gets at first.
const FIRST_SAMPLES: u32 = 4;
/// Traced samples of a light in the end, by its share of the choices.
const MOST_SAMPLES: u32 = 16;
const SAMPLES_BY_SHARE: f32 = 512.0;
/// Most by which traced samples raise the estimate where they were not taken.
const MOST_RATIO: f32 = 4.0;
/// Share of the estimate that counts along with the traced samples: what they found hidden may be in view from where they
/// did not look.
const TRUST_IN_ESTIMATE: f32 = 0.03;
/// Share of the choices by what lights might give anywhere in the cell, since the points are not all receivers there are.
/// As much of it goes by that bound as by its root, for places where what gives most is hidden.
const BY_BOUND: f32 = 0.15;
/// Lights are taken to be no nearer than this, units.
const CLOSE: f32 = 16.0;
/// Entries are split until the estimate's second moment is this close to what single lights would reach, relative to it.
const GOOD_ENOUGH: f32 = 1e-5;

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

/// A light as a cell sees it, or several near each other where there are too many: a node of the tree, or a sun.
struct Seen {
    /// `None` for a sun.
    node: Option<usize>,
    first: u32,
    count: u32,
    /// Those of its lights that are in the row.
    part: Part,
    /// Unshadowed irradiance/π at each receiver by the tree's estimate.
    expected: [f32; RECEIVERS],
    /// What it is taken to give to each receiver, irradiance/π.
    values: [f32; RECEIVERS],
    /// What it might give to some receiver of the cell if nothing hid it, irradiance/π.
    bound: f32,
    /// The share of the choices that it deserves.
    share: f32,
}

impl Seen {
    /// What it promises.
    fn promise(&self) -> f32 {
        self.bound + self.expected.iter().sum::<f32>()
    }
}

/// Ordered by what it promises.
struct Promise(Seen);

impl PartialEq for Promise {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

impl Eq for Promise {}

impl PartialOrd for Promise {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Promise {
    fn cmp(&self, other: &Self) -> Ordering {
        self.0
            .promise()
            .total_cmp(&other.0.promise())
            .then(other.0.first.cmp(&self.0.first))
    }
}

struct Filler<'a> {
    scene: &'a Scene,
    tracer: &'a Tracer,
    runs: &'a [LightRun],
    receivers: &'a [SurfaceHit],
    /// Middle of the cell's cube.
    middle: Vec3,
    /// Salt of the random numbers.
    salt: u32,
}

impl Filler<'_> {
    /// Weight by power of a range of lights.
    fn weight(&self, first: u32, count: u32) -> u32 {
        let sums = &self.scene.lights.weights;
        sums[(first + count) as usize] - sums[first as usize]
    }

    fn node(&self, node: usize, part: Part) -> Seen {
        let lights = &self.scene.lights;
        let record = &lights.tree.nodes[node];
        let power = part.weight() as f32 * lights.strength_of_one;
        let mut expected = [0.0; RECEIVERS];
        for (e, at) in expected.iter_mut().zip(self.receivers) {
            *e = importance(record, at) * power;
        }
        Seen {
            node: Some(node),
            first: record.first,
            count: record.count,
            part,
            values: expected,
            expected,
            bound: self.nearness(record) * power,
            share: 0.0,
        }
    }

    fn sun(&self, light: u32, part: Part) -> Seen {
        let record = &self.scene.lights.lights[light as usize];
        let mut expected = [0.0; RECEIVERS];
        for (e, at) in expected.iter_mut().zip(self.receivers) {
            *e = sun_importance(record, at);
        }
        Seen {
            node: None,
            first: light,
            count: 1,
            part,
            values: expected,
            expected,
            bound: luminance(record.radiance).max(0.0),
            share: 0.0,
        }
    }

    /// What a node's lights give at most in the cell per strength, roughly: as if they were as near as the boxes allow, and
    /// faced it.
    fn nearness(&self, node: &LightNode) -> f32 {
        let (axis, half) = (Vec3::from(node.axis), Vec3::splat(0.5 * CELL_SIZE + LIFT));
        if axis.dot(self.middle) + axis.abs().dot(half) <= node.front {
            return 0.0;
        }
        let to = (Vec3::from(node.centre) - self.middle).abs();
        let gap = (to - half - Vec3::from(node.half_size)).max(Vec3::ZERO);
        1.0 / gap.length_squared().max(CLOSE * CLOSE)
    }

    /// All lights of the row; those that promise least together where there are more than `MOST_SEEN`.
    fn row(&self, weight: u32) -> Vec<Seen> {
        let lights = &self.scene.lights;
        let whole = Part {
            from: 0,
            to: self.runs.len(),
            before: 0,
            after: weight,
        };
        let (finite, suns) = whole.split(&lights.weights, self.runs, lights.tree.finite);
        let mut done = Vec::new();
        let mut open = BinaryHeap::new();
        if finite.weight() > 0 {
            open.push(Promise(self.node(0, finite)));
        }
        while done.len() + open.len() < MOST_SEEN {
            let Some(Promise(seen)) = open.pop() else { break };
            let Some(node) = seen.node.filter(|_| seen.count > 1) else {
                done.push(seen);
                continue;
            };
            let (l, r) = (node + 1, lights.tree.nodes[node].right as usize);
            let (left, right) = seen.part.split(&lights.weights, self.runs, lights.tree.nodes[r].first);
            for (child, part) in [(l, left), (r, right)] {
                if part.weight() > 0 {
                    open.push(Promise(self.node(child, part)));
                }
            }
        }
        done.extend(open.into_iter().map(|p| p.0));
        for r in &self.runs[suns.from..suns.to] {
            for sun in r.first_light.max(lights.tree.finite)..r.first_light + r.count {
                done.push(self.sun(sun, suns));
            }
        }
        // In the tree's order neighbours are near each other, and numbers that are spread evenly spread over space.
        done.sort_unstable_by_key(|s| s.first);
        done
    }

    /// One traced sample of what lights give to a receiver, irradiance/π; the `i`-th of `samples` that are stratified by power.
    fn traced(&self, seen: &Seen, at: &SurfaceHit, i: u32, samples: u32) -> f32 {
        let (lights, sums) = (&self.scene.lights, &self.scene.lights.weights);
        let base = sums[seen.first as usize];
        let weight = self.weight(seen.first, seen.count);
        let random = |d: u32| key(self.salt, seen.first.wrapping_mul(31).wrapping_add(i), d);
        let x = ((u64::from(random(0)) + (u64::from(i) << 32)) / u64::from(samples) * u64::from(weight)) >> 32;
        let x = base + (x as u32).min(weight - 1);
        let span = &sums[seen.first as usize..(seen.first + seen.count) as usize];
        let light = seen.first + span.partition_point(|s| *s <= x) as u32 - 1;
        let u = [unit(random(1)), unit(random(2))];
        let record = &lights.lights[light as usize];
        match sample_light(self.scene, record, at, u, PointSampling::SolidAngle) {
            Some(s) => {
                let origin = offset_point(at.position, at.geometric_normal);
                let value = luminance((s.value * visible(self.scene, self.tracer, origin, &s)).into());
                value * weight as f32 / self.weight(light, 1) as f32
            }
            None => 0.0,
        }
    }

    /// Finds what a light gives to each receiver: traced samples where there are some, else what is expected in the ratio
    /// that the traced ones tell.
    fn look(&self, seen: &mut Seen, samples: u32) {
        let n = self.receivers.len();
        let mut found = [(0.0, 0u32); RECEIVERS];
        let (mut got, mut hoped) = (0.0, 0.0);
        let mut left = samples;
        for i in 0..samples.max(n as u32) {
            let r = (i as usize + seen.first as usize) % n;
            if left > 0 && seen.expected[r] > 0.0 {
                let value = self.traced(seen, &self.receivers[r], samples - left, samples);
                left -= 1;
                found[r].0 += value;
                found[r].1 += 1;
                got += value;
                hoped += seen.expected[r];
            }
        }
        let ratio = if hoped > 0.0 {
            (got / hoped).min(MOST_RATIO)
        } else {
            1.0
        };
        for (r, value) in seen.values.iter_mut().enumerate().take(n) {
            let (expected, (sum, count)) = (seen.expected[r], found[r]);
            // A receiver that was looked from in vain still stands for others.
            let own = if count > 0 {
                sum / count as f32
            } else {
                expected * ratio
            };
            *value = 0.5 * (own + expected * ratio) + TRUST_IN_ESTIMATE * expected;
        }
    }

    /// The share of the choices that each light deserves: the mean of what it would be for each receiver alone, so that dark
    /// ones count like bright ones, and a part by what it might give where no receiver is.
    fn weigh(&self, lights: &mut [Seen]) {
        let (mut all, mut roots) = (0.0, 0.0);
        for light in &*lights {
            all += light.bound;
            roots += light.bound.sqrt();
        }
        let q = if all > 0.0 { BY_BOUND } else { 0.0 };
        let half = |sum: f32| 0.5 * q / sum.max(f32::MIN_POSITIVE);
        let (by_bound, by_root) = (half(all), half(roots));
        for light in &mut *lights {
            light.share = by_bound * light.bound + by_root * light.bound.sqrt();
        }
        let mut totals = [0.0; RECEIVERS];
        for light in &*lights {
            totals.iter_mut().zip(light.values).for_each(|(t, v)| *t += v);
        }
        let usable = |t: &f32| *t > 0.0 && t.is_finite();
        let lit = totals.iter().filter(|t| usable(t)).count() as f32;
        let scales = totals.map(|t| if usable(&t) { (1.0 - q) / (lit * t) } else { 0.0 });
        for light in lights {
            light.share += light.values.iter().zip(scales).map(|(v, s)| v * s).sum::<f32>();
        }
    }

    /// The lights of a row, with the share of each.
    fn seen(&self, weight: u32) -> Vec<Seen> {
        let mut lights = self.row(weight);
        lights.iter_mut().for_each(|l| self.look(l, FIRST_SAMPLES));
        self.weigh(&mut lights);
        for light in &mut lights {
            let samples = ((light.share * SAMPLES_BY_SHARE).ceil() as u32).min(MOST_SAMPLES);
            if samples > FIRST_SAMPLES {
                self.look(light, samples);
            }
        }
        self.weigh(&mut lights);
        lights
    }

    /// A distribution for all receivers.
    fn entries(&self, row_weight: u32) -> Vec<CellEntry> {
        let lights = self.seen(row_weight);
        let tree = &self.scene.lights.tree;
        // Sums over the lights in front of each: of shares, and of squared shares over weights.
        let mut sums = vec![(0.0f64, 0.0f64)];
        for light in &lights {
            let (share, weight) = (f64::from(light.share), f64::from(self.weight(light.first, light.count)));
            let (shares, squares) = sums[sums.len() - 1];
            sums.push((shares + share, squares + share * share / weight));
        }
        let range = |node: usize| {
            let record = &tree.nodes[node];
            let place = |light: u32| lights.partition_point(|l| l.first < light);
            let (from, to) = (place(record.first), place(record.first + record.count));
            let (share, squares) = (sums[to].0 - sums[from].0, sums[to].1 - sums[from].1);
            let weight = self.weight(record.first, record.count);
            // Lights of an entry are chosen by power: how far the second moment is above that of each by its share.
            let whole = to > from && lights[from].node == Some(node);
            let excess = if share > 0.0 && !whole {
                f64::from(weight) * squares / share - share
            } else {
                0.0
            };
            let entry = CellEntry {
                first_light: record.first,
                light_count: record.count,
                probability: share as f32,
                weight,
            };
            (excess, node, entry)
        };
        let mut open = Vec::new();
        if tree.finite > 0 {
            open.push(range(0));
        }
        while open.len() < MOST_ENTRIES {
            let worst = (0..open.len()).max_by(|a, b| open[*a].0.total_cmp(&open[*b].0));
            let Some(worst) = worst.filter(|w| open[*w].0 > 0.0) else {
                break;
            };
            if open.iter().map(|o| o.0).sum::<f64>() <= f64::from(GOOD_ENOUGH) {
                break;
            }
            let (_, node, _) = open.swap_remove(worst);
            open.push(range(node + 1));
            open.push(range(tree.nodes[node].right as usize));
        }
        let suns = lights.iter().filter(|l| l.node.is_none()).map(|l| CellEntry {
            first_light: l.first,
            light_count: 1,
            probability: l.share,
            weight: self.weight(l.first, 1),
        });
        let entries = open.into_iter().map(|o| o.2).chain(suns);
        let mut entries: Vec<_> = entries.filter(|e| e.probability > 0.0).collect();
        entries.sort_unstable_by_key(|e| e.first_light);
        entries
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
            if record.light_count == 0 {
                return (row, place, Vec::new());
            }
            let cube = ((points[0].position + points[0].normal * LIFT) / CELL_SIZE).floor();
            let hits: Vec<SurfaceHit> = points.iter().map(Receiver::hit).collect();
            let filler = Filler {
                scene,
                tracer,
                runs: &lists.runs[record.first_run as usize..(record.first_run + record.run_count) as usize],
                receivers: &hits,
                middle: (cube + 0.5) * CELL_SIZE,
                salt: pcg(row ^ place),
            };
            (row, place, filler.entries(record.weight))
        })
        .collect();
    LightCells::new(cells)
}

/// Makes the light cells of a scene that has none yet.
pub fn fill(scene: &mut Scene) {
    let tracer = Tracer::new(scene);
    scene.cells = build(scene, &tracer);
}
