//! Where lights might be: in front of luxels that are brighter than what is known explains.

use super::fit::{Entry, support};
use super::point::{LEAST_SUPPORT, Placed, Search};
use super::random::Random;
use glam::Vec3;
use rayon::prelude::*;
use std::collections::HashSet;

/// Distances of candidates from the luxels that they stand before, units.
const NEAR: f32 = 10.0;
const FAR: f32 = 320.0;
/// Edge of the cells in which one candidate is kept, units.
const CELL: f32 = 32.0;
/// Draws per candidate wanted.
const DRAWS: usize = 6;

/// A place and what a light there would give a sample of rows.
pub struct Candidate {
    pub position: Vec3,
    entries: Vec<Entry>,
}

impl Candidate {
    /// What a light here would give a sample of rows at power 1.
    pub fn entries(&self) -> &[Entry] {
        &self.entries
    }

    /// What a light here would save against a residual.
    pub fn gain(&self, search: &Search, residual: &[Vec3]) -> Placed {
        let (power, gain) = super::fit::single(search.rows, &self.entries, |row| residual[row]);
        Placed {
            position: self.position,
            power,
            gain,
        }
    }
}

/// Draws up to `count` candidates before rows chosen with probability proportional to `weight`, and looks at about
/// `per_candidate` rows for each.
pub fn draw(
    search: &Search,
    count: usize,
    per_candidate: f32,
    round: u32,
    weight: impl Fn(usize) -> f32,
) -> Vec<Candidate> {
    let mut random = Random::new(search.seed, 0x4341, round);
    let mut cumulative = Vec::with_capacity(search.luxels.len());
    let mut total = 0.0f64;
    for row in 0..search.luxels.len() {
        if search.rows.train[row] {
            total += f64::from(weight(row).max(0.0));
        }
        cumulative.push(total);
    }
    if total <= 0.0 {
        return Vec::new();
    }
    let mut taken = HashSet::new();
    let mut places = Vec::new();
    for _ in 0..count * DRAWS {
        let at = f64::from(random.unit()) * total;
        let row = cumulative.partition_point(|c| *c <= at).min(search.luxels.len() - 1);
        let luxel = &search.luxels[row];
        let height = NEAR * (FAR / NEAR).powf(random.unit());
        let position = luxel.position + (luxel.normal + random.cube() * 0.5) * height;
        let cell = (position / CELL).floor().as_ivec3();
        if places.len() < count && search.open(position) && taken.insert(cell) {
            places.push(position);
        }
    }
    places
        .into_par_iter()
        .enumerate()
        .filter_map(|(i, position)| {
            let mut random = Random::new(search.seed, 0x4342 + round, i as u32);
            let subset = search.subset(position, per_candidate, 0.0, &mut random);
            let mut entries = search.entries(position, &subset);
            entries.retain(|e| e.value > 0.0);
            (support(search.rows, &entries) >= LEAST_SUPPORT).then_some(Candidate { position, entries })
        })
        .collect()
}
