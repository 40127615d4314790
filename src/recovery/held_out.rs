//! Scores on luxels that were never fitted.

use super::encoding::Encoding;
use super::fit::{Column, Model, Rows};
use super::luxels::Luxel;
use super::point::{column, reach};
use super::recover::{FIRST_TERM, INDIRECT, SKY};
use super::score::{Score, Scores, score};
use super::solve::Found;
use super::visibility::Occluders;
use glam::Vec3;
use rayon::prelude::*;

/// A prediction as the compiler would have stored it and we would have read it: no channel over 1, hue kept, in whole bytes.
fn as_stored(value: Vec3, encoding: &Encoding) -> Vec3 {
    Vec3::from(encoding.encode(value).map(|b| encoding.decode_byte(b)))
}

/// Luxels that were never fitted, with the columns of the final model there.
pub struct HeldOut<'a> {
    luxels: &'a [Luxel],
    encoding: Encoding,
    /// One per column of the model.
    pub columns: Vec<Column>,
}

impl<'a> HeldOut<'a> {
    /// `columns` are the known ones there; those of the lights found are added.
    pub fn new(
        occluders: &Occluders,
        luxels: &'a [Luxel],
        encoding: Encoding,
        dirt: &[f32],
        found: &[Found],
        mut columns: Vec<Column>,
    ) -> Self {
        let lights: Vec<Column> = found
            .par_iter()
            .map(|f| {
                let (rows, mut values) = column(occluders, luxels, f.position, reach(f.power), f.cone.as_ref());
                values
                    .iter_mut()
                    .zip(&rows)
                    .for_each(|(v, row)| *v *= dirt[*row as usize]);
                Column::Free { rows, values }
            })
            .collect();
        columns.extend(lights);
        Self {
            luxels,
            encoding,
            columns,
        }
    }

    /// Share of all light stored that each column gives.
    pub fn shares(&self, coefficients: &[Vec3]) -> Vec<f64> {
        let sum = |values: &mut dyn Iterator<Item = Vec3>| values.map(|v| f64::from(v.element_sum())).sum::<f64>();
        let stored = sum(&mut self.luxels.iter().map(|l| l.stored));
        self.columns
            .par_iter()
            .zip(coefficients)
            .map(|(column, c)| {
                let mut given = vec![Vec3::ZERO; self.luxels.len()];
                column.add_to(&mut given, *c);
                sum(&mut given.into_iter()) / stored.max(f64::MIN_POSITIVE)
            })
            .collect()
    }

    fn score(&self, coefficients: &[Vec3]) -> Score {
        let mut predicted = vec![Vec3::ZERO; self.luxels.len()];
        for (column, c) in self.columns.iter().zip(coefficients) {
            column.add_to(&mut predicted, *c);
        }
        let (p, s): (Vec<Vec3>, Vec<Vec3>) = predicted
            .iter()
            .zip(self.luxels)
            .filter(|(_, l)| !l.clamped)
            .map(|(p, l)| (as_stored(*p, &self.encoding), l.stored))
            .unzip();
        score(&p, &s)
    }

    /// Scores of a model whose first columns are ambient, gathered, sky and so many known `terms`.
    pub fn scores(&self, rows: &Rows, model: &Model, terms: usize) -> Scores {
        let lights = FIRST_TERM + terms..model.columns.len();
        let only = |coefficients: &[Vec3], keep: &dyn Fn(usize) -> bool| -> Vec<Vec3> {
            let pick = |(i, c): (usize, &Vec3)| if keep(i) { *c } else { Vec3::ZERO };
            coefficients.iter().enumerate().map(pick).collect()
        };
        let known = |i: usize| (FIRST_TERM..FIRST_TERM + terms).contains(&i);
        let ones = vec![Vec3::ONE; model.columns.len()];
        let refit = |drop: &dyn Fn(usize) -> bool| -> Vec<Vec3> {
            let mut model = model.clone();
            for (i, column) in model.columns.iter_mut().enumerate() {
                if drop(i) {
                    column.add_to(&mut model.residual, model.coefficients[i]);
                    *column = Column::Free {
                        rows: Vec::new(),
                        values: Vec::new(),
                    };
                    model.coefficients[i] = Vec3::ZERO;
                }
            }
            model.refit(rows, 4, 40);
            model.coefficients
        };
        Scores {
            luxels: self.luxels.iter().filter(|l| !l.clamped).count(),
            known: self.score(&only(&ones, &known)),
            known_scaled: self.score(&refit(&|i| lights.contains(&i))),
            direct: self.score(&only(&model.coefficients, &|i| {
                known(i) || i == SKY || lights.contains(&i)
            })),
            without_indirect: self.score(&refit(&|i| i == INDIRECT)),
            full: self.score(&model.coefficients),
        }
    }
}
