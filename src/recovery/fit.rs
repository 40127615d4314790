//! Robust non-negative least squares over luxels: the residual, its weights, and coordinate descent.
//!
//! A row is a luxel. Its error has the scale 4 + 0.15·stored byte units (less than 4 on maps that are mostly darker than
//! twice that), errors beyond three of these count linearly (Huber), and a clamped luxel is a lower bound: predictions above
//! it cost nothing.

use super::luxels::Luxel;
use glam::Vec3;
use rayon::prelude::*;

/// Error scale of dark luxels, luxel units: at most this, and at most `DARK_SHARE` of what is typical, since bakes with
/// a high gamma tell values apart that are far below a byte of the others.
const ERROR_FLOOR: f32 = 4.0 / 255.0;
const DARK_SHARE: f32 = 0.5;
/// But not less than this, luxel units.
const LEAST_FLOOR: f32 = 0.25 / 255.0;
/// Growth of the error scale with what is stored.
const ERROR_SHARE: f32 = 0.15;
/// Scaled error beyond which it counts linearly.
const HUBER: f32 = 3.0;

/// What is to be explained.
#[derive(Clone, Debug)]
pub struct Rows {
    /// Stored E/π, luxel units.
    pub target: Vec<Vec3>,
    /// Inverse error scale.
    pub weight: Vec<f32>,
    pub clamped: Vec<bool>,
    /// Whether a row takes part in fitting; the others judge when to stop.
    pub train: Vec<bool>,
}

impl Rows {
    /// Rows of luxels. `typical` is what the map's median luxel stores, luxel units.
    pub fn new(luxels: &[Luxel], typical: f32, train: Vec<bool>) -> Self {
        let floor = (DARK_SHARE * typical).clamp(LEAST_FLOOR, ERROR_FLOOR);
        let weight = |l: &Luxel| (floor + ERROR_SHARE * l.stored.element_sum() / 3.0).recip();
        Self {
            target: luxels.iter().map(|l| l.stored).collect(),
            weight: luxels.iter().map(weight).collect(),
            clamped: luxels.iter().map(|l| l.clamped).collect(),
            train,
        }
    }

    /// Cost of a row at a residual (stored − predicted), summed over channels.
    pub fn cost(&self, row: usize, residual: Vec3) -> f32 {
        let r = residual * self.weight[row];
        let cost = |x: f32| {
            let x = if self.clamped[row] { x.max(0.0) } else { x.abs() };
            if x <= HUBER {
                0.5 * x * x
            } else {
                HUBER * (x - 0.5 * HUBER)
            }
        };
        cost(r.x) + cost(r.y) + cost(r.z)
    }

    /// Weights per channel that make the quadratic cost behave like the robust one near a residual.
    pub fn robust_weights(&self, row: usize, residual: Vec3) -> Vec3 {
        let w = self.weight[row];
        let weight = |x: f32| {
            if self.clamped[row] && x <= 0.0 {
                return 0.0;
            }
            let scaled = (x * w).abs();
            w * w * if scaled <= HUBER { 1.0 } else { HUBER / scaled }
        };
        Vec3::new(weight(residual.x), weight(residual.y), weight(residual.z))
    }

    /// Cost summed over the fitting rows.
    pub fn total_cost(&self, residual: &[Vec3]) -> f64 {
        let cost = |row: usize| f64::from(self.cost(row, residual[row]));
        (0..residual.len()).filter(|&row| self.train[row]).map(cost).sum()
    }

    /// Mean cost over the rows that fit (`true`) or judge.
    pub fn mean_cost(&self, residual: &[Vec3], train: bool) -> f64 {
        let (mut sum, mut n) = (0.0, 0);
        for (row, r) in residual.iter().enumerate() {
            if self.train[row] == train {
                sum += f64::from(self.cost(row, *r));
                n += 1;
            }
        }
        sum / f64::from(n.max(1))
    }
}

/// One explaining term.
#[derive(Clone, Debug)]
pub enum Column {
    /// Fixed colours, one scale in `0..=most` (kept in the coefficient's x).
    Tinted { values: Vec<Vec3>, most: f32 },
    /// A colour of its own, any non-negative one; rows ascending, others are 0.
    Free { rows: Vec<u32>, values: Vec<f32> },
}

impl Column {
    /// Adds `change` times the column to a prediction, or takes it from a residual with a negative one.
    pub fn add_to(&self, out: &mut [Vec3], change: Vec3) {
        match self {
            Self::Tinted { values, .. } => {
                for (o, v) in out.iter_mut().zip(values) {
                    *o += *v * change.x;
                }
            }
            Self::Free { rows, values } => {
                for (row, v) in rows.iter().zip(values) {
                    out[*row as usize] += change * *v;
                }
            }
        }
    }

    /// Diagonal of the normal equations.
    fn curvature(&self, q: &[Vec3]) -> Vec3 {
        match self {
            Self::Tinted { values, .. } => {
                let sum: f32 = values.iter().zip(q).map(|(v, q)| (*q * *v * *v).element_sum()).sum();
                Vec3::splat(sum)
            }
            Self::Free { rows, values } => rows
                .iter()
                .zip(values)
                .map(|(row, v)| q[*row as usize] * (*v * *v))
                .sum(),
        }
    }

    /// Negative gradient of half the weighted squared residual.
    fn slope(&self, q: &[Vec3], residual: &[Vec3]) -> Vec3 {
        match self {
            Self::Tinted { values, .. } => {
                let sum: f32 = (0..values.len())
                    .map(|i| (q[i] * values[i] * residual[i]).element_sum())
                    .sum();
                Vec3::splat(sum)
            }
            Self::Free { rows, values } => rows
                .iter()
                .zip(values)
                .map(|(row, v)| q[*row as usize] * residual[*row as usize] * *v)
                .sum(),
        }
    }

    fn most(&self) -> f32 {
        match self {
            Self::Tinted { most, .. } => *most,
            Self::Free { .. } => f32::INFINITY,
        }
    }
}

/// Columns with their coefficients and what they leave unexplained.
#[derive(Clone, Debug)]
pub struct Model {
    pub columns: Vec<Column>,
    pub coefficients: Vec<Vec3>,
    /// Stored − predicted.
    pub residual: Vec<Vec3>,
}

/// A change of a coefficient below this share of it ends the descent.
const CONVERGED: f32 = 1e-3;

impl Model {
    /// No columns: everything is residual.
    pub fn new(rows: &Rows) -> Self {
        Self {
            columns: Vec::new(),
            coefficients: Vec::new(),
            residual: rows.target.clone(),
        }
    }

    /// Appends a column with a coefficient.
    pub fn push(&mut self, column: Column, coefficient: Vec3) {
        column.add_to(&mut self.residual, -coefficient);
        self.columns.push(column);
        self.coefficients.push(coefficient);
    }

    /// Removes a column and what it explained.
    pub fn remove(&mut self, index: usize) {
        let column = self.columns.remove(index);
        let coefficient = self.coefficients.remove(index);
        column.add_to(&mut self.residual, coefficient);
    }

    /// Puts another column in a place.
    pub fn replace(&mut self, index: usize, column: Column, coefficient: Vec3) {
        self.columns[index].add_to(&mut self.residual, self.coefficients[index]);
        column.add_to(&mut self.residual, -coefficient);
        self.columns[index] = column;
        self.coefficients[index] = coefficient;
    }

    /// Fits all coefficients: `passes` times new robust weights, each followed by coordinate descent.
    pub fn refit(&mut self, rows: &Rows, passes: usize, sweeps: usize) {
        for _ in 0..passes {
            let q: Vec<Vec3> = (0..rows.target.len())
                .into_par_iter()
                .map(|i| {
                    if rows.train[i] {
                        rows.robust_weights(i, self.residual[i])
                    } else {
                        Vec3::ZERO
                    }
                })
                .collect();
            let curvature: Vec<Vec3> = self.columns.par_iter().map(|c| c.curvature(&q)).collect();
            for _ in 0..sweeps {
                let mut largest: f32 = 0.0;
                for (j, column) in self.columns.iter().enumerate() {
                    let old = self.coefficients[j];
                    let step = column.slope(&q, &self.residual) / curvature[j].max(Vec3::splat(f32::MIN_POSITIVE));
                    let new = (old + step).clamp(Vec3::ZERO, Vec3::splat(column.most()));
                    if !new.is_finite() || new == old {
                        continue;
                    }
                    column.add_to(&mut self.residual, old - new);
                    self.coefficients[j] = new;
                    let change = (new - old).abs().max_element() / new.max_element().max(old.max_element());
                    largest = largest.max(change);
                }
                if largest < CONVERGED {
                    break;
                }
            }
        }
    }
}

/// One row as one light sees it.
#[derive(Clone, Copy, Debug)]
pub struct Entry {
    pub row: u32,
    /// Irradiance at power 1.
    pub value: f32,
    /// Rows that this one stands for.
    pub multiplicity: f32,
}

/// The best non-negative power (per channel) of a single light against a residual, and the cost that it saves.
pub fn single(rows: &Rows, entries: &[Entry], residual: impl Fn(usize) -> Vec3) -> (Vec3, f32) {
    const PASSES: usize = 4;
    let mut power = Vec3::ZERO;
    for pass in 0..PASSES {
        let (mut slope, mut curvature) = (Vec3::ZERO, Vec3::ZERO);
        for e in entries {
            let row = e.row as usize;
            // Bounds have their say about a power that the others suggest: at no power at all every bound pulls it down.
            if pass == 0 && rows.clamped[row] {
                continue;
            }
            let r = residual(row);
            let q = rows.robust_weights(row, r - power * e.value) * (e.multiplicity * e.value);
            slope += q * r;
            curvature += q * e.value;
        }
        power = (slope / curvature.max(Vec3::splat(f32::MIN_POSITIVE))).max(Vec3::ZERO);
        if !power.is_finite() {
            return (Vec3::ZERO, 0.0);
        }
    }
    let saved = entries
        .iter()
        .map(|e| {
            let row = e.row as usize;
            let r = residual(row);
            (rows.cost(row, r) - rows.cost(row, r - power * e.value)) * e.multiplicity
        })
        .sum();
    (power, saved)
}

/// How many rows carry a column: (Σg²)²/Σg⁴ with the rows' weights.
pub fn support(rows: &Rows, entries: &[Entry]) -> f32 {
    let (mut s2, mut s4) = (0.0, 0.0);
    for e in entries {
        let g = e.value * rows.weight[e.row as usize];
        s2 += g * g * e.multiplicity;
        s4 += g * g * g * g * e.multiplicity;
    }
    if s4 > 0.0 { s2 * s2 / s4 } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rows(target: Vec<Vec3>, clamped: Vec<bool>) -> Rows {
        Rows {
            weight: vec![30.0; target.len()],
            train: vec![true; target.len()],
            target,
            clamped,
        }
    }

    fn dense(values: &[f32]) -> Column {
        Column::Free {
            rows: (0..values.len() as u32).collect(),
            values: values.to_vec(),
        }
    }

    fn values(phase: f32) -> Vec<f32> {
        (0..40).map(|i| 0.5 + 0.5 * (i as f32 * 0.7 + phase).sin()).collect()
    }

    #[test]
    fn overlapping_columns_are_told_apart() {
        let (a, b) = (values(0.0), values(1.0));
        let truth = [Vec3::new(0.2, 0.0, 0.5), Vec3::new(0.1, 0.3, 0.0)];
        let target = a.iter().zip(&b).map(|(a, b)| truth[0] * *a + truth[1] * *b).collect();
        let rows = rows(target, vec![false; 40]);
        let mut model = Model::new(&rows);
        model.push(dense(&a), Vec3::ZERO);
        model.push(dense(&b), Vec3::ONE);
        model.refit(&rows, 5, 300);
        for (found, truth) in model.coefficients.iter().zip(truth) {
            assert!(found.abs_diff_eq(truth, 5e-3), "{found} {truth}");
        }
    }

    #[test]
    fn nothing_becomes_negative_and_bounds_hold() {
        let rows = rows(vec![Vec3::new(-1.0, 2.0, 0.1); 40], vec![false; 40]);
        let mut model = Model::new(&rows);
        model.push(dense(&values(0.0)), Vec3::ZERO);
        model.push(
            Column::Tinted {
                values: vec![Vec3::splat(0.1); 40],
                most: 1.0,
            },
            Vec3::ZERO,
        );
        model.refit(&rows, 3, 50);
        assert_eq!(model.coefficients[0].x, 0.0);
        assert!((0.0..=1.0).contains(&model.coefficients[1].x));
    }

    #[test]
    fn clamped_rows_are_lower_bounds() {
        let a = values(0.0);
        // What is stored stops at 0.3, the light goes on.
        let target: Vec<Vec3> = a.iter().map(|a| Vec3::splat(a.min(0.3))).collect();
        let clamped: Vec<bool> = a.iter().map(|a| *a >= 0.3).collect();
        let entries: Vec<Entry> = (0..40)
            .map(|i| Entry {
                row: i,
                value: a[i as usize],
                multiplicity: 1.0,
            })
            .collect();
        let bounded = rows(target.clone(), clamped);
        let (power, saved) = single(&bounded, &entries, |row| bounded.target[row]);
        assert!(power.abs_diff_eq(Vec3::ONE, 1e-3), "{power}");
        assert!(saved > 0.0);
        let taken_literally = rows(target, vec![false; 40]);
        let (power, _) = single(&taken_literally, &entries, |row| taken_literally.target[row]);
        assert!(power.x < 0.8, "{power}");
    }

    #[test]
    fn removing_a_column_gives_back_what_it_explained() {
        let rows = rows(vec![Vec3::ONE; 40], vec![false; 40]);
        let mut model = Model::new(&rows);
        model.push(dense(&values(0.3)), Vec3::splat(0.5));
        model.remove(0);
        assert!(model.residual.iter().all(|r| r.abs_diff_eq(Vec3::ONE, 1e-6)));
    }

    #[test]
    fn support_counts_the_rows_that_carry() {
        let rows = rows(vec![Vec3::ONE; 40], vec![false; 40]);
        let entry = |row, value| Entry {
            row,
            value,
            multiplicity: 1.0,
        };
        let even: Vec<Entry> = (0..10).map(|r| entry(r, 1.0)).collect();
        assert!((support(&rows, &even) - 10.0).abs() < 1e-3);
        let lone: Vec<Entry> = (0..10).map(|r| entry(r, if r == 0 { 100.0 } else { 1.0 })).collect();
        assert!(support(&rows, &lone) < 1.1);
        assert_eq!(support(&rows, &[]), 0.0);
    }
}
