//! Spots: lights found as points whose light ends at a cone.

use super::fit::{Column, Entry, single, support};
use super::point::{LEAST_SUPPORT, Search, reach};
use super::random::Random;
use super::solve::{OLD_RADIUS, Solver};
use glam::Vec3;
use rayon::prelude::*;

/// Width of a cone's edge, units (`physics.md` section 3: the compiler's clamp((R−r)/32, 0, 1)).
const EDGE: f32 = 32.0;

/// What a spot lights.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cone {
    /// Unit direction from the light.
    pub axis: Vec3,
    /// Radius per unit of distance along the axis, the compiler's margin included.
    pub slope: f32,
}

impl Cone {
    /// Part of the light that leaves in the direction of a vector from the light.
    pub fn part(&self, from_light: Vec3) -> f32 {
        let along = from_light.dot(self.axis);
        if along <= 0.0 {
            return 0.0;
        }
        let off = (from_light - self.axis * along).length();
        ((along * self.slope - off) / EDGE).clamp(0.0, 1.0)
    }
}

/// A place, a cone there, and what they save.
#[derive(Clone, Copy)]
struct Aimed {
    position: Vec3,
    cone: Cone,
    power: Vec3,
    gain: f32,
}

/// Slopes tried first; a light entity without a `radius` that aims 168 units far has 0.48.
const SLOPES: [f32; 4] = [0.3, 0.5, 0.75, 1.1];
/// A cone wider than this is no cone.
const WIDEST: f32 = 2.0;
/// Narrower ones reach too few luxels.
const NARROWEST: f32 = 0.1;
/// Spots tried.
const WANTED: usize = 24;
/// Candidates and rows looked at for each: with few rows, some cone among many fits their noise.
const CANDIDATES: usize = 800;
const CANDIDATE_ROWS: f32 = 1000.0;
/// Spots tried stand at least this far apart, units.
const APART: f32 = 160.0;
/// Rounds over new spots and the points within `NEIGHBOURS` units of them.
const SETTLING: usize = 4;
const NEIGHBOURS: f32 = 300.0;
/// Least part of its saving per fitting luxel that a new spot must also save per judging one.
const CONFIRMED: f64 = 0.5;

impl Solver<'_> {
    /// Adds spots for what no point explains: light that ends where nothing shades it.
    pub(super) fn add_spots(&mut self) {
        let rows = self.search.rows;
        self.cones = vec![None; self.places.len()];
        let fitting = rows.train.iter().filter(|t| **t).count();
        let per_judging = (rows.train.len() - fitting) as f64 / fitting.max(1) as f64;
        for aimed in self.pick_spots() {
            let column = self.search.spot_column(&aimed);
            // Spots taken before it may have explained what it was for.
            let mut residual = self.model.residual.clone();
            column.add_to(&mut residual, -aimed.power);
            let saved = |train: bool| {
                let saved =
                    |row: usize| f64::from(rows.cost(row, self.model.residual[row]) - rows.cost(row, residual[row]));
                (0..residual.len())
                    .filter(|&row| rows.train[row] == train)
                    .map(saved)
                    .sum::<f64>()
            };
            let (fits, judges) = (saved(true), saved(false));
            if fits > self.least && judges > CONFIRMED * per_judging * fits {
                self.model.push(column, aimed.power);
                self.places.push(aimed.position);
                self.cones.push(Some(aimed.cone));
            }
        }
        for _ in 0..SETTLING {
            self.model.refit(rows, 2, 15);
            self.aim_again();
            self.cycle_around_spots();
        }
        self.prune();
    }

    /// Every spot against what the others leave.
    fn aim_again(&mut self) {
        self.label += 1;
        for i in 0..self.cones.len() {
            let Some(cone) = self.cones[i] else { continue };
            let index = self.fixed + i;
            let power = self.model.coefficients[index];
            let mut left = self.model.residual.clone();
            self.model.columns[index].add_to(&mut left, power);
            let start = Aimed {
                position: self.places[i],
                cone,
                power,
                gain: 0.0,
            };
            let aimed = self.search.aim(&start, self.label * 1024 + i as u32, &|row| left[row]);
            if aimed.gain > 0.0 {
                let column = self.search.spot_column(&aimed);
                self.places[i] = aimed.position;
                self.cones[i] = Some(aimed.cone);
                self.model.replace(index, column, aimed.power);
            }
        }
    }

    /// Points near spots, which may have stood in for them, move to where they are needed now.
    fn cycle_around_spots(&mut self) {
        let spots: Vec<Vec3> = (0..self.cones.len())
            .filter(|&i| self.cones[i].is_some())
            .map(|i| self.places[i])
            .collect();
        let near =
            |i: &usize| self.cones[*i].is_none() && spots.iter().any(|s| s.distance(self.places[*i]) < NEIGHBOURS);
        let points: Vec<usize> = (0..self.places.len()).filter(near).collect();
        self.cycle_over(points, OLD_RADIUS);
    }

    /// Spots that save most, apart from each other, each moved and turned to where it saves most.
    fn pick_spots(&mut self) -> Vec<Aimed> {
        let candidates = self.candidates(CANDIDATES, CANDIDATE_ROWS);
        let (search, residual) = (self.search, &self.model.residual);
        let mut gains: Vec<Aimed> = candidates
            .par_iter()
            .filter_map(|c| search.best_cone(c.position, c.entries(), &|row| residual[row]))
            .collect();
        gains.sort_by(|a, b| b.gain.total_cmp(&a.gain));
        let mut picks: Vec<Aimed> = Vec::new();
        for g in gains {
            if picks.len() < WANTED && picks.iter().all(|p| p.position.distance(g.position) > APART) {
                picks.push(g);
            }
        }
        self.label += 1;
        let label = self.label * 1024;
        let mut aimed: Vec<Aimed> = picks
            .par_iter()
            .enumerate()
            .map(|(i, p)| search.aim(p, label + i as u32, &|row| residual[row]))
            .collect();
        aimed.sort_by(|a, b| b.gain.total_cmp(&a.gain));
        aimed
    }
}

/// Reach of the search for a spot's place, units, and rows looked at there.
const REACH: f32 = 64.0;
const ROWS: f32 = 4000.0;
const PROPOSALS: usize = 240;
/// What the search's reach shrinks by from one proposal to the next.
const SHRINKS: f32 = 0.988;

impl Search<'_> {
    /// The whole column of a spot.
    fn spot_column(&self, spot: &Aimed) -> Column {
        self.shaped_column(spot.position, Some(&spot.cone), reach(spot.power))
    }

    /// The best of a few cones at a place.
    fn best_cone(&self, position: Vec3, entries: &[Entry], residual: &impl Fn(usize) -> Vec3) -> Option<Aimed> {
        let cones = self
            .axes(position, entries, residual)
            .into_iter()
            .flat_map(|axis| SLOPES.map(|slope| Cone { axis, slope }));
        cones
            .map(|cone| self.judge_spot(position, cone, entries, residual))
            .filter(|a| a.gain > 0.0)
            .max_by(|a, b| a.gain.total_cmp(&b.gain))
    }

    /// Moves, turns and widens a spot to where it saves most.
    fn aim(&self, start: &Aimed, label: u32, residual: &impl Fn(usize) -> Vec3) -> Aimed {
        let mut random = Random::new(self.seed, 0x5350, label);
        let subset = self.subset(start.position, ROWS, REACH, &mut random);
        let mut entries = self.entries(start.position, &subset);
        let mut best = self.judge_spot(start.position, start.cone, &entries, residual);
        let mut size = 1.0f32;
        for k in 0..PROPOSALS {
            size *= SHRINKS;
            let turned = best.cone.axis + random.cube() * (0.4 * size);
            let cone = Cone {
                axis: turned.normalize_or(best.cone.axis),
                slope: (best.cone.slope * (1.0 + 0.5 * size * random.cube().x)).clamp(NARROWEST, WIDEST),
            };
            // Every other proposal keeps the place, and needs no rays.
            if k % 2 == 0 {
                let aimed = self.judge_spot(best.position, cone, &entries, residual);
                if aimed.gain > best.gain {
                    best = aimed;
                }
                continue;
            }
            let position = best.position + random.cube() * (REACH * size);
            if !self.open(position) {
                continue;
            }
            let moved = self.entries(position, &subset);
            let aimed = self.judge_spot(position, cone, &moved, residual);
            if aimed.gain > best.gain {
                (best, entries) = (aimed, moved);
            }
        }
        best
    }

    /// Directions that a spot at a place may aim in: along the world's axes, and where the most is unexplained.
    fn axes(&self, position: Vec3, entries: &[Entry], residual: &impl Fn(usize) -> Vec3) -> Vec<Vec3> {
        let mean: Vec3 = entries
            .iter()
            .map(|e| {
                let row = e.row as usize;
                let missing = (residual(row) * self.rows.weight[row]).element_sum().max(0.0);
                let to = self.luxels[row].position - position;
                to.normalize_or_zero() * (missing * e.value * e.multiplicity)
            })
            .sum();
        let mut out = vec![Vec3::Z, Vec3::NEG_Z, Vec3::X, Vec3::NEG_X, Vec3::Y, Vec3::NEG_Y];
        out.extend(mean.try_normalize());
        out
    }

    fn judge_spot(&self, position: Vec3, cone: Cone, entries: &[Entry], residual: &impl Fn(usize) -> Vec3) -> Aimed {
        let shaped: Vec<Entry> = entries
            .iter()
            .map(|e| Entry {
                value: e.value * cone.part(self.luxels[e.row as usize].position - position),
                ..*e
            })
            .filter(|e| e.value > 0.0)
            .collect();
        let (power, gain) = if support(self.rows, &shaped) < LEAST_SUPPORT {
            (Vec3::ZERO, 0.0)
        } else {
            single(self.rows, &shaped, residual)
        };
        Aimed {
            position,
            cone,
            power,
            gain,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cone_ends_as_the_compilers_does() {
        let cone = Cone {
            axis: Vec3::Z,
            slope: 0.5,
        };
        assert_eq!(cone.part(Vec3::new(0.0, 0.0, 200.0)), 1.0);
        // R = 100 at 200 units: 84 off the axis is half way through the edge of 32 units.
        assert!((cone.part(Vec3::new(84.0, 0.0, 200.0)) - 0.5).abs() < 1e-6);
        assert_eq!(cone.part(Vec3::new(101.0, 0.0, 200.0)), 0.0);
        assert_eq!(cone.part(Vec3::new(0.0, 0.0, -1.0)), 0.0);
    }
}
