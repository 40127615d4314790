//! Which light of a receiver's row to sample, and with what probability. Counterpart of
//! `shaders/include/light_choice.glsl`.
//!
//! All ways choose among the lights of the row alone; probabilities are per light (a discrete measure) and are returned
//! with the choice. A light that can reach the receiver has a probability above 0 in each of them.

use super::surface::SurfaceHit;
use crate::render::settings::{LightSampling, Settings};
use crate::scene::Scene;
use crate::scene::clusters::LightLists;
use crate::scene::guests::{GUEST_LIGHT, GUEST_SHARE};
use crate::scene::light_cells::{CellView, MANY_ENTRIES, place};
use crate::scene::light_power::luminance;
use crate::scene::light_tree::LightTree;
use crate::scene::lights::LightTable;
use crate::scene::records::{CellEntry, Light, LightNode, LightRow, LightRun};
use crate::scene::sampling::{pcg, unit};
use glam::Vec3;

/// A chosen light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Choice {
    pub light: u32,
    /// Probability that it was chosen.
    pub probability: f32,
}

/// What lights are chosen by, for one receiver.
#[derive(Clone, Copy)]
pub struct Chances<'a> {
    lights: &'a LightTable,
    row: LightRow,
    runs: &'a [LightRun],
    sampling: LightSampling,
    /// The receiver's light cell where it is to be used and there is one.
    cell: CellView<'a>,
    guests: &'a [Light],
}

impl<'a> Chances<'a> {
    /// `lists` and `row` are what culling leaves; light cells know of culling by the PVS alone, and the tree stands in
    /// where there is none or no cell. `guests`: the frame's own lights.
    pub fn new(
        scene: &'a Scene,
        guests: &'a [Light],
        settings: &Settings,
        lists: &'a LightLists,
        row: u32,
        at: &SurfaceHit,
    ) -> Self {
        let by_cell = matches!(settings.light_sampling, LightSampling::Cells | LightSampling::Reservoir);
        let record = lists.rows[row as usize];
        Self {
            lights: &scene.lights,
            row: record,
            runs: &lists.runs[record.first_run as usize..(record.first_run + record.run_count) as usize],
            sampling: settings.light_sampling,
            cell: if by_cell && settings.cull_lights > 0 {
                scene.cells.find(row, place(at.position, at.geometric_normal))
            } else {
                CellView::default()
            },
            guests,
        }
    }

    /// Whether so many lights compete for the receiver that a choice of few candidates says little.
    pub fn many(&self) -> bool {
        self.cell.entries.len() > MANY_ENTRIES
    }

    /// Chooses with 32 random bits; `None` where no light can reach the receiver, as far as the way of choosing can tell.
    pub fn choose(&self, at: &SurfaceHit, bits: u32) -> Option<Choice> {
        let only = self.row.light_count == 0;
        let Some(guest) = choose_guest(self.guests, at, unit(if only { bits } else { bits << 2 })) else {
            return self.choose_of_map(at, bits);
        };
        if only {
            return Some(guest);
        }
        let taken = (GUEST_SHARE * 4_294_967_296.0) as u32;
        if bits < taken {
            return Some(Choice {
                probability: guest.probability * GUEST_SHARE,
                ..guest
            });
        }
        let choice = self.choose_of_map(at, pcg(bits))?;
        Some(Choice {
            probability: choice.probability * (1.0 - GUEST_SHARE),
            ..choice
        })
    }

    fn choose_of_map(&self, at: &SurfaceHit, bits: u32) -> Option<Choice> {
        if self.row.light_count == 0 {
            return None;
        }
        match self.sampling {
            LightSampling::Uniform => Some(choose_uniform(self.row, self.runs, bits)),
            LightSampling::Power => Some(choose_power(&self.lights.weights, self.row, self.runs, bits)),
            _ if !self.cell.entries.is_empty() => Some(choose_by_cell(&self.lights.weights, self.cell, bits)),
            _ => choose_by_tree(self.lights, self.row, self.runs, at, bits),
        }
    }
}

/// What a guest may give to a receiver.
fn guest_importance(light: &Light, at: &SurfaceHit) -> f32 {
    let to = Vec3::from(light.p0) - at.position;
    if to.dot(at.geometric_normal) + light.size <= 0.0 {
        return 0.0;
    }
    let reach = light.size * light.size;
    luminance(light.radiance) * reach / to.length_squared().max(reach)
}

/// A guest in proportion to its importance.
fn choose_guest(guests: &[Light], at: &SurfaceHit, u: f32) -> Option<Choice> {
    let sum: f32 = guests.iter().map(|g| guest_importance(g, at)).sum();
    let mut below = 0.0;
    let mut chosen = None;
    for (i, guest) in (0u32..).zip(guests) {
        let one = guest_importance(guest, at);
        below += one;
        if one > 0.0 {
            chosen = Some(Choice {
                light: GUEST_LIGHT + i,
                probability: one / sum,
            });
        }
        if u * sum < below {
            break;
        }
    }
    chosen
}

/// An entry of the cell by its bounds, and a light of its range by power.
fn choose_by_cell(sums: &[u32], cell: CellView<'_>, bits: u32) -> Choice {
    let entry = &cell.entries[cell.bounds.partition_point(|b| *b <= bits) - 1];
    if entry.light_count == 1 {
        return Choice {
            light: entry.first_light,
            probability: entry.probability,
        };
    }
    let x = scaled(pcg(bits), entry.weight) + sums[entry.first_light as usize];
    let range = entry.first_light as usize..(entry.first_light + entry.light_count) as usize;
    let light = entry.first_light + sums[range].partition_point(|s| *s <= x) as u32 - 1;
    let weight = sums[light as usize + 1] - sums[light as usize];
    Choice {
        light,
        probability: entry.probability * (weight as f32 / entry.weight as f32),
    }
}

/// 32 random bits → 0..n.
fn scaled(bits: u32, n: u32) -> u32 {
    ((u64::from(bits) * u64::from(n)) >> 32) as u32
}

fn choose_uniform(row: LightRow, runs: &[LightRun], bits: u32) -> Choice {
    let k = scaled(bits, row.light_count);
    let run = runs[runs.partition_point(|r| r.before <= k) - 1];
    Choice {
        light: run.first_light + (k - run.before),
        probability: 1.0 / row.light_count as f32,
    }
}

fn choose_power(sums: &[u32], row: LightRow, runs: &[LightRun], bits: u32) -> Choice {
    let x = scaled(bits, row.weight);
    let run = runs[runs.partition_point(|r| r.weight_before <= x) - 1];
    let x = x - run.weight_before + sums[run.first_light as usize];
    let range = run.first_light as usize..(run.first_light + run.count) as usize;
    let light = run.first_light + sums[range].partition_point(|s| *s <= x) as u32 - 1;
    let weight = sums[light as usize + 1] - sums[light as usize];
    Choice {
        light,
        probability: weight as f32 / row.weight as f32,
    }
}

/// What the lights of a lobe are chosen by: the light cell of its surface, where there is one, else power.
#[derive(Clone, Copy)]
pub struct LobeChances<'a> {
    lights: &'a LightTable,
    row: LightRow,
    runs: &'a [LightRun],
    cell: CellView<'a>,
}

impl<'a> LobeChances<'a> {
    /// `lists` and `row` are what culling leaves, `place` is [`place`] of the surface.
    pub fn new(scene: &'a Scene, settings: &Settings, lists: &'a LightLists, row: u32, place: u32) -> Self {
        let record = lists.rows[row as usize];
        Self {
            lights: &scene.lights,
            row: record,
            runs: &lists.runs[record.first_run as usize..(record.first_run + record.run_count) as usize],
            cell: if settings.cull_lights > 0 {
                scene.cells.find(row, place)
            } else {
                CellView::default()
            },
        }
    }

    /// Chooses with 32 random bits.
    pub fn choose(&self, bits: u32) -> Option<Choice> {
        if !self.cell.entries.is_empty() {
            return Some(choose_by_cell(&self.lights.weights, self.cell, bits));
        }
        (self.row.weight > 0).then(|| choose_power(&self.lights.weights, self.row, self.runs, bits))
    }

    /// Probability that a light is chosen; 0 for lights outside the row.
    pub fn chance(&self, light: u32) -> f32 {
        let weight = (self.lights.weights[light as usize + 1] - self.lights.weights[light as usize]) as f32;
        if !self.cell.entries.is_empty() {
            let holds = |e: &&CellEntry| light >= e.first_light && light < e.first_light + e.light_count;
            let share = |e: &CellEntry| match e.light_count {
                1 => e.probability,
                _ => e.probability * (weight / e.weight as f32),
            };
            return self.cell.entries.iter().filter(holds).map(share).sum();
        }
        let at = self.runs.partition_point(|r| r.first_light <= light);
        let listed = at
            .checked_sub(1)
            .is_some_and(|i| light < self.runs[i].first_light + self.runs[i].count);
        if !listed || self.row.weight == 0 {
            return 0.0;
        }
        weight / self.row.weight as f32
    }
}

/// Estimated irradiance/π that the node's lights give per strength: cosines at both ends at their best, over a squared
/// distance between those to the middle and to the box. 0 only where the node cannot light the receiver.
pub fn importance(node: &LightNode, at: &SurfaceHit) -> f32 {
    let half = Vec3::from(node.half_size);
    let axis = Vec3::from(node.axis);
    let to = Vec3::from(node.centre) - at.position;
    // All of it below the receiver's horizon, or the receiver behind all of it.
    let highest = at.shading_normal.dot(to) + at.shading_normal.abs().dot(half);
    if highest <= 0.0 || axis.dot(at.position) <= node.front {
        return 0.0;
    }
    let (d2, r2) = (to.length_squared(), half.length_squared());
    let gap = (to.abs() - half).max(Vec3::ZERO);
    let distance = (0.5 * (d2 + gap.length_squared())).max(0.5 * r2);
    if d2 <= r2 {
        return 1.0 / distance;
    }
    let direction = to / d2.sqrt();
    // The sphere is seen under this half angle.
    let (sin_sphere, cos_sphere) = ((r2 / d2).sqrt(), (1.0 - r2 / d2).max(0.0).sqrt());
    let receiver = widened(at.shading_normal.dot(direction), sin_sphere, cos_sphere);
    if receiver <= 0.0 {
        return 0.0;
    }
    if node.cos_cone <= -1.0 {
        return receiver / distance;
    }
    let sin_cone = (1.0 - node.cos_cone * node.cos_cone).max(0.0).sqrt();
    let (sin, cos) = (
        sin_cone * cos_sphere + node.cos_cone * sin_sphere,
        node.cos_cone * cos_sphere - sin_cone * sin_sphere,
    );
    let emitter = if sin <= 0.0 {
        1.0
    } else {
        widened(-axis.dot(direction), sin, cos)
    };
    receiver * emitter.max(0.0) / distance
}

/// Cosine of an angle that has been made smaller by another, down to 0. The other is between 0 and π.
fn widened(cos: f32, sin_by: f32, cos_by: f32) -> f32 {
    if cos >= cos_by {
        1.0
    } else {
        cos * cos_by + (1.0 - cos * cos).max(0.0).sqrt() * sin_by
    }
}

/// Estimated irradiance/π of a sun at a receiver. 0 only where no point of it is above the horizon.
pub fn sun_importance(light: &Light, at: &SurfaceHit) -> f32 {
    // A disc in azimuth and elevation reaches no farther than its radius from its middle.
    let (sin, cos) = light.p1[2].sin_cos();
    widened(at.shading_normal.dot(Vec3::from(light.p0)), sin, cos).max(0.0) * sun_strength(light)
}

/// Luminance of the irradiance/π at normal incidence.
fn sun_strength(light: &Light) -> f32 {
    luminance(light.radiance).max(0.0)
}

/// The part of a row's runs that lies in a node.
#[derive(Clone, Copy)]
pub struct Part {
    /// Runs `from..to` of the row.
    pub from: usize,
    pub to: usize,
    /// Weight of the row's lights before the node and before its end.
    pub before: u32,
    pub after: u32,
}

impl Part {
    /// Weight of the row's lights in the part.
    pub fn weight(&self) -> u32 {
        self.after - self.before
    }

    /// The parts in front of light `middle` and from it on.
    pub fn split(&self, sums: &[u32], runs: &[LightRun], middle: u32) -> (Self, Self) {
        let k = self.from + runs[self.from..self.to].partition_point(|r| r.first_light < middle);
        if k == self.from {
            let left = Self {
                to: k,
                after: self.before,
                ..*self
            };
            return (left, *self);
        }
        let run = runs[k - 1];
        let end = run.first_light + run.count;
        let at = run.weight_before + sums[middle.min(end) as usize] - sums[run.first_light as usize];
        // The run may begin before the node, and end behind it.
        let at = at.clamp(self.before, self.after);
        let left = Self {
            to: k,
            after: at,
            ..*self
        };
        let right = Self {
            from: if end > middle { k - 1 } else { k },
            before: at,
            ..*self
        };
        (left, right)
    }
}

/// A random number that choices are made with, one after the other. Bits that choices have used up are replaced.
struct Chooser {
    u: f32,
    /// Distance between the values that `u` can have.
    grain: f32,
    bits: u32,
}

const FINE: f32 = 1.0 / 16_777_216.0;
const COARSE: f32 = 1.0 / 4096.0;

impl Chooser {
    fn new(bits: u32) -> Self {
        Self {
            u: unit(bits),
            grain: FINE,
            bits,
        }
    }

    /// True with probability `p`, 0 < p < 1.
    fn take(&mut self, p: f32) -> bool {
        let taken = self.u < p;
        let share = if taken {
            self.u /= p;
            p
        } else {
            self.u = (self.u - p) / (1.0 - p);
            1.0 - p
        };
        self.grain /= share;
        if self.grain > COARSE {
            self.bits = pcg(self.bits);
            self.u += self.grain * unit(self.bits);
            self.grain = FINE;
        }
        self.u = self.u.clamp(0.0, 1.0 - FINE);
        taken
    }
}

/// Where both suns and other lights may light a receiver, suns get at most half of the samples: an estimate of either from
/// afar is too rough to weigh them by. They get less as they graze it.
const SUN_SHARE: f32 = 0.5;
const LEAST_SUN_SHARE: f32 = 1.0 / 1024.0;

fn choose_by_tree(lights: &LightTable, row: LightRow, runs: &[LightRun], at: &SurfaceHit, bits: u32) -> Option<Choice> {
    let (tree, sums) = (&lights.tree, &lights.weights);
    let whole = Part {
        from: 0,
        to: runs.len(),
        before: 0,
        after: row.weight,
    };
    let (finite, suns) = whole.split(sums, runs, tree.finite);
    let mut chooser = Chooser::new(bits);
    let (total_sun, overhead) = sun_sums(lights, runs, &suns, at);
    let sun_share = (SUN_SHARE * total_sun / overhead.max(f32::MIN_POSITIVE)).max(LEAST_SUN_SHARE);
    let root = if finite.weight() > 0 {
        importance(&tree.nodes[0], at)
    } else {
        0.0
    };
    let mut probability = 1.0;
    if total_sun > 0.0 && (root <= 0.0 || chooser.take(sun_share)) {
        if root > 0.0 {
            probability = sun_share;
        }
        return choose_sun(lights, runs, &suns, at, total_sun, probability, &mut chooser);
    }
    if root <= 0.0 {
        return None;
    }
    if total_sun > 0.0 {
        probability = 1.0 - sun_share;
    }
    descend(tree, sums, runs, finite, at, probability, &mut chooser)
}

fn suns_of<'a>(runs: &'a [LightRun], part: &Part, finite: u32) -> impl Iterator<Item = u32> + 'a {
    runs[part.from..part.to]
        .iter()
        .flat_map(move |r| r.first_light.max(finite)..r.first_light + r.count)
}

/// Sums of the suns' importances, and of what these would be if each stood overhead.
fn sun_sums(lights: &LightTable, runs: &[LightRun], suns: &Part, at: &SurfaceHit) -> (f32, f32) {
    suns_of(runs, suns, lights.tree.finite)
        .map(|s| &lights.lights[s as usize])
        .fold((0.0, 0.0), |(sum, overhead), sun| {
            (sum + sun_importance(sun, at), overhead + sun_strength(sun))
        })
}

fn choose_sun(
    lights: &LightTable,
    runs: &[LightRun],
    suns: &Part,
    at: &SurfaceHit,
    total: f32,
    probability: f32,
    chooser: &mut Chooser,
) -> Option<Choice> {
    let wanted = chooser.u * total;
    let mut sum = 0.0;
    let mut chosen = None;
    for sun in suns_of(runs, suns, lights.tree.finite) {
        let one = sun_importance(&lights.lights[sun as usize], at);
        sum += one;
        if one > 0.0 {
            chosen = Some(Choice {
                light: sun,
                probability: probability * (one / total),
            });
            if wanted < sum {
                break;
            }
        }
    }
    chosen
}

fn descend(
    tree: &LightTree,
    sums: &[u32],
    runs: &[LightRun],
    mut part: Part,
    at: &SurfaceHit,
    mut probability: f32,
    chooser: &mut Chooser,
) -> Option<Choice> {
    let mut here = 0usize;
    loop {
        let node = &tree.nodes[here];
        if node.right == 0 {
            return Some(Choice {
                light: node.first,
                probability,
            });
        }
        let (l, r) = (here + 1, node.right as usize);
        let (left, right) = part.split(sums, runs, tree.nodes[r].first);
        let weigh = |node: usize, part: &Part| match part.weight() {
            0 => 0.0,
            weight => weight as f32 * importance(&tree.nodes[node], at),
        };
        let (wl, wr) = (weigh(l, &left), weigh(r, &right));
        if wl <= 0.0 && wr <= 0.0 {
            return None;
        }
        let take_left = if wr <= 0.0 {
            true
        } else if wl <= 0.0 {
            false
        } else {
            let p = wl / (wl + wr);
            // Rounding may leave nothing for the lesser one.
            let p = p.clamp(FINE, 1.0 - FINE);
            let taken = chooser.take(p);
            probability *= if taken { p } else { 1.0 - p };
            taken
        };
        (here, part) = if take_left { (l, left) } else { (r, right) };
    }
}
