//! Lights that were found in parts become one.

use super::fit::Column;
use super::solve::{OLD_RADIUS, Solver};
use glam::Vec3;

/// Lights nearer to each other than this may be one that was found in parts, units.
const MERGE: f32 = 72.0;

impl Solver<'_> {
    /// Makes one light of neighbours wherever one explains about as much.
    pub(super) fn merge(&mut self) {
        let mut pairs: Vec<(f32, usize, usize)> = Vec::new();
        for i in 0..self.places.len() {
            for j in i + 1..self.places.len() {
                let d = self.places[i].distance(self.places[j]);
                if d < MERGE {
                    pairs.push((d, i, j));
                }
            }
        }
        pairs.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut gone = vec![false; self.places.len()];
        for (distance, i, j) in pairs {
            if !gone[i] && !gone[j] && self.merge_pair(i, j, distance) {
                gone[j] = true;
            }
        }
        for j in (0..gone.len()).rev().filter(|&j| gone[j]) {
            self.model.remove(self.fixed + j);
            self.places.remove(j);
        }
        self.model.refit(self.search.rows, 2, 15);
    }

    /// Tries one light for two where their neighbours must give way for it to do, the nearest pairs first.
    pub(super) fn merge_with_neighbours(&mut self) {
        const REACH: f32 = 96.0;
        const NEIGHBOURS: f32 = 300.0;
        const TRIALS: usize = 24;
        const ROUNDS: usize = 3;
        let rows = self.search.rows;
        let mut refused: Vec<(Vec3, Vec3)> = Vec::new();
        for _ in 0..TRIALS {
            let mut nearest: Option<(f32, usize, usize)> = None;
            for i in 0..self.places.len() {
                for j in i + 1..self.places.len() {
                    let d = self.places[i].distance(self.places[j]);
                    let tried = refused.contains(&(self.places[i], self.places[j]));
                    if d < REACH && !tried && nearest.is_none_or(|(n, ..)| d < n) {
                        nearest = Some((d, i, j));
                    }
                }
            }
            let Some((_, i, j)) = nearest else { return };
            let before = rows.total_cost(&self.model.residual);
            let kept = (self.model.clone(), self.places.clone());
            // The weaker one goes; all around it move to fill its place.
            let power = |k: usize| self.model.coefficients[self.fixed + k].element_sum();
            let weaker = if power(i) < power(j) { i } else { j };
            let around = self.places[weaker];
            self.model.remove(self.fixed + weaker);
            self.places.remove(weaker);
            let near = |k: &usize| self.places[*k].distance(around) < NEIGHBOURS;
            let neighbours: Vec<usize> = (0..self.places.len()).filter(near).collect();
            self.model.refit(rows, 1, 15);
            for _ in 0..ROUNDS {
                self.cycle_over(neighbours.clone(), OLD_RADIUS);
            }
            if rows.total_cost(&self.model.residual) > before + self.least {
                refused.push((kept.1[i], kept.1[j]));
                (self.model, self.places) = kept;
            }
        }
    }

    /// Tries one light for two; where that is good enough the second is left without power.
    fn merge_pair(&mut self, i: usize, j: usize, distance: f32) -> bool {
        let rows = self.search.rows;
        let (a, b) = (self.fixed + i, self.fixed + j);
        let (pa, pb) = (self.model.coefficients[a], self.model.coefficients[b]);
        let (wa, wb) = (pa.element_sum(), pb.element_sum());
        let mut residual = self.model.residual.clone();
        self.model.columns[a].add_to(&mut residual, pa);
        self.model.columns[b].add_to(&mut residual, pb);
        let middle = (self.places[i] * wa + self.places[j] * wb) / (wa + wb).max(f32::MIN_POSITIVE);
        let start = if self.search.open(middle) {
            middle
        } else {
            self.places[if wa >= wb { i } else { j }]
        };
        self.label += 1;
        let placed = self
            .search
            .refine(start, distance * 0.5 + 8.0, self.label * 1024, |row| residual[row]);
        let column = self.search.column(placed.position, placed.power);
        column.add_to(&mut residual, -placed.power);
        let before = rows.total_cost(&self.model.residual);
        if rows.total_cost(&residual) > before + self.least {
            return false;
        }
        self.model.replace(
            b,
            Column::Free {
                rows: Vec::new(),
                values: Vec::new(),
            },
            Vec3::ZERO,
        );
        self.model.replace(a, column, placed.power);
        self.places[i] = placed.position;
        true
    }
}
