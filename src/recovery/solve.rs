//! The search for the few point lights that explain what known light leaves over.

use super::candidates::{Candidate, draw};
use super::fit::{Column, Model};
use super::point::{Placed, Search};
use super::spot::Cone;
use glam::Vec3;
use rayon::prelude::*;

/// How far the search goes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limits {
    /// Most lights.
    pub lights: usize,
    /// Candidates held at a time.
    pub candidates: usize,
    /// Least share of what all evidence costs unexplained that a light must save to stay.
    pub pays: f64,
}

/// Lights picked in one round stand at least this far apart, units.
const APART: f32 = 160.0;
/// Nothing is picked within this distance of a place that made things worse, units.
const TABU: f32 = 48.0;
/// Rows looked at per candidate.
const CANDIDATE_ROWS: f32 = 250.0;
/// Rounds between new candidates, and between rounds over all lights.
const REDRAW: usize = 4;
const CYCLE: usize = 6;
/// Rounds without progress that end the search.
const PATIENCE: usize = 3;
/// Share of the judging cost that counts as progress.
const PROGRESS: f64 = 0.002;
/// Reach of the search for a light's place when it is new and when it has settled, units.
const NEW_RADIUS: f32 = 32.0;
pub(super) const OLD_RADIUS: f32 = 12.0;

/// A light of the solution.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Found {
    /// World position, units.
    pub position: Vec3,
    /// Photons per channel, as the entity key `light` counts them.
    pub power: Vec3,
    /// Share of the cost that would come back without it; of a finished recovery, share of the stored light that it gives, on
    /// luxels never fitted.
    pub share: f64,
    /// What a spot lights; `None`: all around.
    pub cone: Option<Cone>,
}

/// The model of a search: `fixed` known columns, then one per light.
pub struct Solver<'a> {
    pub(super) search: &'a Search<'a>,
    pub(super) model: Model,
    pub(super) fixed: usize,
    pub(super) places: Vec<Vec3>,
    /// One per place once spots were added, none before.
    pub(super) cones: Vec<Option<Cone>>,
    limits: Limits,
    /// Cost that a light must save to stay.
    pub(super) least: f64,
    pub(super) label: u32,
}

impl<'a> Solver<'a> {
    /// Starts from a model of known columns only.
    pub fn new(search: &'a Search<'a>, model: Model, limits: Limits) -> Self {
        let rows = search.rows;
        Self {
            search,
            fixed: model.columns.len(),
            model,
            places: Vec::new(),
            cones: Vec::new(),
            limits,
            least: limits.pays * rows.total_cost(&rows.target),
            label: 0,
        }
    }

    fn judged(&self) -> f64 {
        self.search.rows.mean_cost(&self.model.residual, false)
    }

    /// So many places where lights are missing, judged by about `per_candidate` rows each.
    pub(super) fn candidates(&mut self, count: usize, per_candidate: f32) -> Vec<Candidate> {
        let rows = self.search.rows;
        self.label += 1;
        if self.places.is_empty() {
            let brightness = |i: usize| rows.target[i].max_element().min(0.63);
            draw(self.search, count, per_candidate, self.label, brightness)
        } else {
            let missing = |i: usize| {
                let r = (self.model.residual[i] * rows.weight[i]).max(Vec3::ZERO);
                r.max_element().powf(1.5)
            };
            draw(self.search, count, per_candidate, self.label, missing)
        }
    }

    /// Puts other values in the place of a known column.
    pub fn replace_fixed(&mut self, index: usize, column: Column) {
        let coefficient = self.model.coefficients[index];
        self.model.replace(index, column, coefficient);
    }

    /// Adds lights until they stop paying, then settles, merges and prunes so many times. `progress` gets the share done,
    /// 0..1.
    pub fn run(&mut self, settling: usize, progress: &(dyn Fn(f32) + Sync)) {
        let rows = self.search.rows;
        self.model.refit(rows, 4, 30);
        let mut best = self.judged();
        let mut marked = best;
        let mut tabu: Vec<Vec3> = Vec::new();
        let mut idle = 0;
        let mut candidates = Vec::new();
        let mut round = 0;
        while self.places.len() < self.limits.lights && idle < PATIENCE {
            if round % REDRAW == 0 {
                candidates = self.candidates(self.limits.candidates, CANDIDATE_ROWS);
            }
            let wanted = match self.places.len() {
                0..6 => 2,
                6..24 => 4,
                _ => 8,
            };
            let picks = self.pick(&candidates, wanted, &tabu);
            if picks.is_empty() {
                idle += 1;
                round = round.next_multiple_of(REDRAW).max(round + 1);
                continue;
            }
            let kept = (self.model.clone(), self.places.clone());
            for p in &picks {
                let column = self.search.column(p.position, p.power);
                self.model.push(column, p.power);
                self.places.push(p.position);
            }
            self.model.refit(rows, 3, 15);
            if round % CYCLE == CYCLE - 1 {
                self.merge();
                self.cycle(OLD_RADIUS);
            }
            let now = self.judged();
            if now > best {
                (self.model, self.places) = kept;
                tabu.extend(picks.iter().map(|p| p.position));
            } else {
                best = now;
            }
            if best < marked * (1.0 - PROGRESS) {
                marked = best;
                idle = 0;
            } else {
                idle += 1;
            }
            round += 1;
            progress(0.9 * (1.0 - (-(round as f32) / 20.0).exp()));
        }
        for _ in 0..settling {
            self.settle();
        }
        if settling > 1 {
            self.merge_with_neighbours();
            self.polish();
            self.model.refit(rows, 2, 20);
            self.add_spots();
        }
        self.model.refit(rows, 4, 40);
        progress(1.0);
    }

    /// The most saving places, apart from each other, each moved to where it saves most.
    fn pick(&mut self, candidates: &[Candidate], wanted: usize, tabu: &[Vec3]) -> Vec<Placed> {
        let residual = &self.model.residual;
        let mut gains: Vec<Placed> = candidates.par_iter().map(|c| c.gain(self.search, residual)).collect();
        gains.retain(|g| g.gain > 0.0 && tabu.iter().all(|t| t.distance(g.position) > TABU));
        gains.sort_by(|a, b| b.gain.total_cmp(&a.gain));
        let mut picks: Vec<Placed> = Vec::new();
        for g in gains {
            if picks.len() == wanted {
                break;
            }
            if picks.iter().all(|p| p.position.distance(g.position) > APART) {
                picks.push(g);
            }
        }
        self.label += 1;
        let label = self.label * 1024;
        let moved: Vec<Placed> = picks
            .par_iter()
            .enumerate()
            .map(|(i, p)| {
                self.search
                    .refine(p.position, NEW_RADIUS, label + i as u32, |row| residual[row])
            })
            .collect();
        moved.into_iter().filter(|p| f64::from(p.gain) > self.least).collect()
    }

    /// Moves every light to its best place given the others, those far apart at once.
    fn cycle(&mut self, radius: f32) {
        self.cycle_over((0..self.places.len()).collect(), radius);
    }

    /// The same for some lights.
    pub(super) fn cycle_over(&mut self, mut waiting: Vec<usize>, radius: f32) {
        const INDEPENDENT: f32 = 400.0;
        self.label += 1;
        while !waiting.is_empty() {
            let mut batch: Vec<usize> = Vec::new();
            waiting.retain(|&i| {
                let free = batch
                    .iter()
                    .all(|&j| self.places[i].distance(self.places[j]) > INDEPENDENT);
                if free {
                    batch.push(i);
                }
                !free
            });
            let moved: Vec<(usize, Option<(Placed, Column)>)> = batch
                .par_iter()
                .map(|&i| {
                    let index = self.fixed + i;
                    let power = self.model.coefficients[index];
                    let mut own = vec![Vec3::ZERO; self.model.residual.len()];
                    self.model.columns[index].add_to(&mut own, power);
                    let residual = |row: usize| self.model.residual[row] + own[row];
                    let label = self.label * 1024 + i as u32;
                    let placed = self.search.refine(self.places[i], radius, label, residual);
                    let changed = placed.position != self.places[i] && placed.gain > 0.0;
                    (
                        i,
                        changed.then(|| (placed, self.search.column(placed.position, placed.power))),
                    )
                })
                .collect();
            for (i, change) in moved {
                if let Some((placed, column)) = change {
                    self.places[i] = placed.position;
                    self.model.replace(self.fixed + i, column, placed.power);
                }
            }
        }
        self.model.refit(self.search.rows, 2, 10);
    }

    /// A round over all lights; near ones become one, and those that don't pay go.
    fn settle(&mut self) {
        self.cycle(OLD_RADIUS);
        self.merge();
        self.prune();
    }

    /// Rounds over all lights until they stand still: neighbours share what both reach, and only agree step by step.
    fn polish(&mut self) {
        const ROUNDS: usize = 18;
        const STILL: f64 = 2e-4;
        let mut cost = self.search.rows.total_cost(&self.model.residual);
        let mut still = 0;
        for round in 0..ROUNDS {
            self.cycle(OLD_RADIUS / (1 + round / 6) as f32);
            let now = self.search.rows.total_cost(&self.model.residual);
            // One round may have drawn poor proposals.
            still = if now > cost * (1.0 - STILL) { still + 1 } else { 0 };
            if still == 2 {
                break;
            }
            cost = now;
        }
    }

    /// Cost (sum over fitting rows) that would come back without each light.
    fn worth(&self) -> Vec<f64> {
        let rows = self.search.rows;
        (0..self.places.len())
            .into_par_iter()
            .map(|i| {
                let index = self.fixed + i;
                let power = self.model.coefficients[index];
                let Column::Free { rows: lit, values } = &self.model.columns[index] else {
                    return 0.0;
                };
                lit.iter()
                    .zip(values)
                    .filter(|(row, _)| rows.train[**row as usize])
                    .map(|(row, v)| {
                        let row = *row as usize;
                        let r = self.model.residual[row];
                        f64::from(rows.cost(row, r + power * *v) - rows.cost(row, r))
                    })
                    .sum()
            })
            .collect()
    }

    pub(super) fn prune(&mut self) {
        let rows = self.search.rows;
        loop {
            let worth = self.worth();
            // A few at a time: what one light explained, its neighbour may take over.
            let mut poor: Vec<usize> = (0..worth.len()).filter(|&i| worth[i] < self.least).collect();
            poor.sort_by(|a, b| worth[*a].total_cmp(&worth[*b]));
            poor.truncate(1 + self.places.len() / 20);
            if poor.is_empty() {
                return;
            }
            poor.sort_unstable();
            for i in poor.into_iter().rev() {
                self.model.remove(self.fixed + i);
                self.places.remove(i);
                if i < self.cones.len() {
                    self.cones.remove(i);
                }
            }
            self.model.refit(rows, 2, 15);
        }
    }

    /// The lights found.
    pub fn found(&self) -> Vec<Found> {
        let worth = self.worth();
        let total = self.search.rows.total_cost(&self.search.rows.target);
        self.places
            .iter()
            .zip(&self.model.coefficients[self.fixed..])
            .zip(worth)
            .enumerate()
            .map(|(i, ((position, power), worth))| Found {
                position: *position,
                power: *power,
                share: worth / total.max(f64::MIN_POSITIVE),
                cone: self.cones.get(i).copied().flatten(),
            })
            .collect()
    }

    /// The model as it stands: the known columns, then one per light.
    pub fn into_model(self) -> Model {
        self.model
    }
}
