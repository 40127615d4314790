//! `q3rays lights`

use super::args::{CliError, CliResult};
use super::common::{Common, progress};
use crate::output::{atomic, stdout};
use crate::recovery::luxel_table::csv;
use crate::recovery::score::Score;
use crate::recovery::{LightsFile, Options, Recovery, recover};
use std::fmt::{self, Display};
use std::path::PathBuf;

/// Arguments of `lights`.
#[derive(clap::Args)]
pub struct Args {
    /// Map name
    map: String,
    /// Write the recovered lights to a lights file
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// Write every luxel looked at, with what is stored and predicted there, as CSV
    #[arg(long, value_name = "FILE")]
    luxels: Option<PathBuf>,
    /// Leave light entities out of what is known, to see whether they are found
    #[arg(long)]
    hide_entities: bool,
    /// Keep a third of the surfaces out of the fit and score on them
    #[arg(long)]
    hold_out: bool,
    /// Most lights to look for
    #[arg(long, value_name = "N")]
    most: Option<usize>,
}

/// Steps of the progress bar.
const STEPS: u64 = 1000;

/// Recovers a map's stripped lights.
pub fn run(common: &Common, seed: u32, args: &Args) -> CliResult {
    for path in [&args.out, &args.luxels].into_iter().flatten() {
        atomic::create_parent(path).map_err(CliError::failed)?;
    }
    let scene = common.scene(&args.map)?;
    let mut options = Options {
        seed,
        hide_entities: args.hide_entities,
        hold_out_surfaces: args.hold_out,
        ..Options::default()
    };
    if let Some(most) = args.most {
        options.limits.lights = most;
    }
    let bar = progress(STEPS, &args.map);
    let found = recover(&scene, &options, &|share| {
        bar.set_position((share * STEPS as f32) as u64)
    });
    bar.finish_and_clear();
    let found = found.map_err(CliError::failed)?;
    if let Some(path) = &args.out {
        let text = LightsFile::from(&found).to_string();
        atomic::write(path, text.as_bytes()).map_err(CliError::failed)?;
    }
    if let Some(path) = &args.luxels {
        atomic::write(path, csv(&found.luxels).as_bytes()).map_err(CliError::failed)?;
    }
    stdout::line(Text(&found)).map_err(CliError::failed)
}

/// A recovery as text for people.
struct Text<'a>(&'a Recovery);

impl Display for Text<'_> {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let r = self.0;
        let e = r.encoding;
        writeln!(f, "{}: {} lights recovered", r.map, r.lights.len())?;
        writeln!(
            f,
            "{:24} gamma {} compensate {} ({:?})",
            "encoding", e.gamma, e.compensate, e.evidence
        )?;
        let s = &r.scores;
        let mut line =
            |name: &str, s: Score| writeln!(f, "{name:24} correlation {:.3}, ratio {:.2}", s.correlation, s.ratio);
        line("known as in the files", s.known)?;
        line("known, fitted", s.known_scaled)?;
        line("known and recovered", s.direct)?;
        line("with ambient", s.without_indirect)?;
        line("with ambient and bounces", s.full)?;
        writeln!(f, "{:24} {:?}", "ambient", r.ambient.to_array())?;
        writeln!(f, "{:24} {:?}", "sky", r.sky.to_array())?;
        writeln!(f, "{:24} {:.2}", "bounces", r.indirect)?;
        for t in &r.scales {
            writeln!(f, "{:24} {:.2} {}", "scale", t.scale, t.name)?;
        }
        for (name, time) in &r.timings {
            writeln!(f, "{:24} {:.1} s {name}", "time", time.as_secs_f32())?;
        }
        for l in &r.lights {
            writeln!(
                f,
                "light at {} photons {:.0} explains {:.2}%",
                l.position.round(),
                l.power.max_element(),
                l.share * 100.0
            )?;
        }
        Ok(())
    }
}
