//! The whole recovery of one map.

use super::encoding::{Encoding, lights_kept_unasked};
use super::fit::{Column, Model, Rows};
use super::gather::{Gather, Gathered, dirt};
use super::held_out::HeldOut;
use super::known::{Term, TermKind, terms};
use super::luxels::{self, Luxel, choose, held_out_surface};
use super::point::Search;
use super::random::Random;
use super::score::Scores;
use super::solve::{Found, Limits, Solver};
use super::visibility::{Occluders, compiled_with};
use crate::scene::Scene;
use glam::Vec3;
use std::time::{Duration, Instant};
use thiserror::Error;

/// Why nothing can be recovered.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
pub enum RecoveryError {
    #[error("map \"{map}\" has no lightmaps: there is nothing to recover lights from")]
    NoLightmaps { map: String },
    #[error("map \"{map}\" has only {luxels} luxels in the open, too few to recover lights from")]
    TooFewLuxels { map: String, luxels: usize },
}

/// How a recovery is done.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Options {
    pub seed: u32,
    /// Luxels that the fit looks at; a quarter of them judges.
    pub fit_luxels: usize,
    /// Luxels, uniform by area, that scores are measured on and nothing else looks at.
    pub test_luxels: usize,
    pub limits: Limits,
    /// Leave light entities out of the known lights, to see whether they are found.
    pub hide_entities: bool,
    /// Keep a third of the surfaces out of the fit and score on them alone.
    pub hold_out_surfaces: bool,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            seed: 1,
            fit_luxels: 20_000,
            test_luxels: 10_000,
            limits: Limits {
                lights: 300,
                candidates: 2400,
                pays: 0.0002,
            },
            hide_entities: false,
            hold_out_surfaces: false,
        }
    }
}

/// Fewer luxels than this tell nothing.
const LEAST_LUXELS: usize = 200;
/// One in so many luxels may be tested; the others may be fitted.
const TESTED_ONE_IN: u32 = 3;
/// Part of the fitting luxels drawn uniformly by area; the others by area and brightness.
const BY_AREA: f32 = 0.3;
/// Brightness that counts at most in the choice, luxel units.
const BRIGHTEST: f32 = 160.0 / 255.0;
/// Most by which a known term may exceed what the files say.
const MOST_SCALE: f32 = 8.0;

/// A scale of a known term.
#[derive(Clone, Debug, PartialEq)]
pub struct TermScale {
    pub kind: TermKind,
    pub name: String,
    pub scale: f32,
    /// Share of the stored light that it gives, on luxels never fitted.
    pub share: f64,
}

/// One luxel with everything predicted there, E/π in luxel units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LuxelRow {
    pub position: Vec3,
    pub normal: Vec3,
    pub stored: Vec3,
    /// Known lights, scaled as fitted.
    pub known: Vec3,
    /// Recovered lights and sky.
    pub recovered: Vec3,
    /// Gathered light and ambient, scaled as fitted.
    pub indirect: Vec3,
    pub clamped: bool,
    pub held_out: bool,
}

/// What was found out about a map.
#[derive(Clone, Debug)]
pub struct Recovery {
    pub map: String,
    pub encoding: Encoding,
    pub lights: Vec<Found>,
    pub scales: Vec<TermScale>,
    /// E/π everywhere, luxel units.
    pub ambient: Vec3,
    /// Radiance of sky faces that no script explains, luxel units.
    pub sky: Vec3,
    /// Part of the gathered light that the bake had.
    pub indirect: f32,
    pub scores: Scores,
    pub luxels: Vec<LuxelRow>,
    /// Time of each step.
    pub timings: Vec<(&'static str, Duration)>,
}

/// Columns before the known terms.
pub(super) const AMBIENT: usize = 0;
pub(super) const INDIRECT: usize = 1;
pub(super) const SKY: usize = 2;
pub(super) const FIRST_TERM: usize = 3;

struct Timer(Instant, Vec<(&'static str, Duration)>);

impl Timer {
    fn lap(&mut self, name: &'static str) {
        self.1.push((name, self.0.elapsed()));
        self.0 = Instant::now();
    }
}

/// Luxels of the fit, then those of the test; and the number of the former.
fn sample(all: &[Luxel], options: &Options) -> (Vec<Luxel>, usize) {
    let mut random = Random::new(options.seed, 0x5341, 0);
    // Chance decides before the draw which luxels may be tested: luxels that are larger than a draw's step (outlying
    // terrain has some of 800 units) would all go to whoever draws first.
    let held: Vec<bool> = all
        .iter()
        .map(|l| {
            let chosen = random.bits().is_multiple_of(TESTED_ONE_IN);
            if options.hold_out_surfaces {
                held_out_surface(l.surface, options.seed)
            } else {
                chosen
            }
        })
        .collect();
    let mut taken: Vec<bool> = held.iter().map(|h| !h).collect();
    let area = |l: &Luxel| l.area;
    let tested = choose(all, options.test_luxels, area, &mut taken, &mut random);
    taken.clone_from(&held);
    let by_area = (options.fit_luxels as f32 * BY_AREA) as usize;
    let bright = |l: &Luxel| l.area * l.stored.max_element().min(BRIGHTEST);
    let mut fitted = choose(all, by_area, area, &mut taken, &mut random);
    fitted.extend(choose(
        all,
        options.fit_luxels - by_area,
        bright,
        &mut taken,
        &mut random,
    ));
    let count = fitted.len();
    (fitted.into_iter().chain(tested).map(|i| all[i]).collect(), count)
}

fn tinted(values: Vec<Vec3>, most: f32) -> Column {
    Column::Tinted { values, most }
}

fn free(values: impl Iterator<Item = f32>) -> Column {
    let (rows, values) = values
        .enumerate()
        .filter(|(_, v)| *v > 0.0)
        .map(|(i, v)| (i as u32, v))
        .unzip();
    Column::Free { rows, values }
}

/// Ambient, gathered, sky and known columns over a range of the luxels.
fn fixed_columns(gathered: &[Gathered], dirt: &[f32], terms: &[Term], range: std::ops::Range<usize>) -> Vec<Column> {
    let mut columns = vec![
        free(dirt[range.clone()].iter().copied()),
        tinted(gathered[range.clone()].iter().map(|g| g.indirect).collect(), 1.0),
        free(gathered[range.clone()].iter().map(|g| g.sky)),
    ];
    for term in terms {
        columns.push(tinted(term.values[range.clone()].to_vec(), MOST_SCALE));
    }
    columns
}

/// Darkens what is gathered as `-dirty` does.
fn darken(gathered: &mut [Gathered], dirt: &[f32]) {
    for (g, d) in gathered.iter_mut().zip(dirt) {
        g.indirect *= *d;
        g.sky *= *d;
    }
}

/// Whether the compiler dropped pieces of area lights that give a byte at most: `-fast`, which nearly all recorded command
/// lines have and id's compiler (it kept the light entities unasked) does not know.
fn hurried(scene: &Scene) -> bool {
    if compiled_with(scene, "-light") {
        return compiled_with(scene, "-fast");
    }
    !lights_kept_unasked(&scene.entities, &scene.lights)
}

/// Recovers the lights of a map. `progress` gets the share done, 0..1.
///
/// # Errors
/// [`RecoveryError`] where the map has too few luxels.
pub fn recover(scene: &Scene, options: &Options, progress: &(dyn Fn(f32) + Sync)) -> Result<Recovery, RecoveryError> {
    let mut timer = Timer(Instant::now(), Vec::new());
    if scene.bsp.lightmaps.is_empty() {
        return Err(RecoveryError::NoLightmaps {
            map: scene.name.clone(),
        });
    }
    let encoding = Encoding::of(&scene.bsp, &scene.entities, &scene.lights);
    let all = luxels::all(scene, &encoding);
    if all.len() < LEAST_LUXELS {
        return Err(RecoveryError::TooFewLuxels {
            map: scene.name.clone(),
            luxels: all.len(),
        });
    }
    let (luxels, fitted) = sample(&all, options);
    let typical = luxels::median_stored(&all);
    drop(all);
    timer.lap("luxels");
    let occluders = Occluders::new(scene);
    timer.lap("trees");
    let mut gathered = Gather::new(&occluders, encoding, Vec::new()).all(&luxels, options.seed);
    let dirty = compiled_with(scene, "-dirty");
    let dirt = if dirty {
        dirt(&occluders, &luxels)
    } else {
        vec![1.0; luxels.len()]
    };
    darken(&mut gathered, &dirt);
    timer.lap("gathered");
    progress(0.1);
    let fit_luxels = &luxels[..fitted];
    let mut random = Random::new(options.seed, 0x5456, 0);
    let mut rows = Rows::new(
        fit_luxels,
        typical,
        (0..fitted).map(|_| !random.bits().is_multiple_of(4)).collect(),
    );
    let mut terms = terms(&occluders, &luxels, options.hide_entities, hurried(scene), options.seed);
    for (i, d) in dirt.iter().enumerate() {
        terms.iter_mut().for_each(|t| t.values[i] *= *d);
    }
    let mut model = Model::new(&rows);
    for c in fixed_columns(&gathered, &dirt, &terms, 0..fitted) {
        model.push(c, Vec3::ZERO);
    }
    timer.lap("known");
    progress(0.2);
    let found;
    {
        let search = Search {
            occluders: &occluders,
            luxels: fit_luxels,
            rows: &rows,
            seed: options.seed,
            dirt: &dirt[..fitted],
        };
        let mut solver = Solver::new(&search, model, options.limits);
        solver.run(1, &|share| progress(0.2 + 0.5 * share));
        // Clamped luxels reflect more than they show: the lights found tell how much.
        let lights = solver.found().iter().map(|f| (f.position, f.power)).collect();
        gathered = Gather::new(&occluders, encoding, lights).all(&luxels, options.seed);
        darken(&mut gathered, &dirt);
        let indirect = gathered[..fitted].iter().map(|g| g.indirect).collect();
        solver.replace_fixed(INDIRECT, tinted(indirect, 1.0));
        solver.run(3, &|share| progress(0.7 + 0.25 * share));
        found = solver.found();
        model = solver.into_model();
    }
    timer.lap("search");
    rows.train.fill(true);
    model.refit(&rows, 4, 40);
    let held = HeldOut::new(&occluders, &luxels[fitted..], encoding, &dirt[fitted..], &found, {
        fixed_columns(&gathered, &dirt, &terms, fitted..luxels.len())
    });
    let scores = held.scores(&rows, &model, terms.len());
    let shares = held.shares(&model.coefficients);
    timer.lap("scores");
    let lights = found
        .iter()
        .zip(&model.coefficients[FIRST_TERM + terms.len()..])
        .zip(&shares[FIRST_TERM + terms.len()..])
        .map(|((f, power), share)| Found {
            power: *power,
            share: *share,
            ..*f
        })
        .filter(|f| f.power.max_element() > 0.0)
        .collect();
    let scales = terms
        .iter()
        .zip(&model.coefficients[FIRST_TERM..])
        .zip(&shares[FIRST_TERM..])
        .map(|((t, c), share)| TermScale {
            kind: t.kind.clone(),
            name: t.name.clone(),
            scale: c.x,
            share: *share,
        })
        .collect();
    let mut rows_out = luxel_rows(fit_luxels, &model.columns, &model.coefficients, terms.len(), false);
    rows_out.extend(luxel_rows(
        &luxels[fitted..],
        &held.columns,
        &model.coefficients,
        terms.len(),
        true,
    ));
    progress(1.0);
    Ok(Recovery {
        map: scene.name.clone(),
        encoding,
        lights,
        scales,
        ambient: model.coefficients[AMBIENT],
        sky: model.coefficients[SKY],
        indirect: model.coefficients[INDIRECT].x,
        scores,
        luxels: rows_out,
        timings: timer.1,
    })
}

fn luxel_rows(
    luxels: &[Luxel],
    columns: &[Column],
    coefficients: &[Vec3],
    terms: usize,
    held_out: bool,
) -> Vec<LuxelRow> {
    let mut parts = [(); 3].map(|()| vec![Vec3::ZERO; luxels.len()]);
    for (i, (column, c)) in columns.iter().zip(coefficients).enumerate() {
        let part = match i {
            AMBIENT | INDIRECT => 2,
            i if i >= FIRST_TERM && i < FIRST_TERM + terms => 0,
            _ => 1,
        };
        column.add_to(&mut parts[part], *c);
    }
    let [known, recovered, indirect] = parts;
    luxels
        .iter()
        .enumerate()
        .map(|(i, l)| LuxelRow {
            position: l.position,
            normal: l.normal,
            stored: l.stored,
            known: known[i],
            recovered: recovered[i],
            indirect: indirect[i],
            clamped: l.clamped,
            held_out,
        })
        .collect()
}
