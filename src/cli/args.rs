//! Arguments: sub-commands by `clap`, and Quake's `+set NAME VALUE` and `+COMMAND` anywhere.

use super::{bench, common::Common, compare, export, info, lights, maps, merge, play, render};
use crate::console::Cvars;
use crate::console::commands::{find, meant};
use crate::console::cvars::cvar;
use clap::{Parser, Subcommand};
use std::ffi::OsString;
use std::process::ExitCode;
use thiserror::Error;

/// What a sub-command ends with.
pub type CliResult = Result<(), CliError>;

/// A failure, as it is told to the user.
#[derive(Debug, Error)]
pub enum CliError {
    /// Exit code 1.
    #[error("{0}")]
    Failed(String),
    /// Exit code 2.
    #[error("{0}")]
    Usage(String),
    /// No window can be opened: a run without one may do.
    #[error("{0}")]
    NoWindow(String),
}

impl CliError {
    /// A failure from any error.
    pub fn failed(error: impl std::fmt::Display) -> Self {
        Self::Failed(error.to_string())
    }
}

#[derive(Parser)]
#[command(
    name = "q3rays",
    version,
    about = "Quake III maps by real-time distributed ray tracing",
    after_help = "Anywhere on the command line: +set NAME VALUE sets a console variable, +COMMAND runs a console command \
                  (+map NAME)."
)]
struct Cli {
    #[command(flatten)]
    common: Common,
    #[command(subcommand)]
    command: Option<Command>,
}

#[derive(Subcommand)]
enum Command {
    /// Fly through a map in a window (the default)
    Play(play::Args),
    /// Render one view without a window
    Render(render::Args),
    /// Describe a map
    Info(info::Args),
    /// Find the lights that a map's compiler threw away
    Lights(lights::Args),
    /// List the maps found, and where
    Maps(maps::Args),
    /// Measure speed
    Bench(bench::Args),
    /// Compare two images; prints metrics as JSON
    Compare(compare::Args),
    /// Join partial accumulations into one EXR
    Merge(merge::Args),
    /// Write a map as glTF, for other programs
    Export(export::Args),
}

/// Console words taken off the command line.
#[derive(Default)]
pub struct ConsoleWords {
    /// Variables and their values.
    pub sets: Vec<(String, String)>,
    /// Other commands with their arguments.
    pub commands: Vec<Vec<String>>,
}

impl ConsoleWords {
    /// The map that the last `+map NAME` names.
    pub fn map(&self) -> Option<String> {
        self.commands.iter().rev().find_map(|words| match &words[..] {
            [command, name] if matches!(command.as_str(), "map" | "devmap") => Some(name.to_lowercase()),
            _ => None,
        })
    }
}

/// Splits `+set NAME VALUE` and `+COMMAND ARGS…` from the ordinary arguments. A console command's arguments end at the
/// next word that begins with `+`, or with `-` and is no number, except that `set` always takes two.
fn split_console(args: Vec<OsString>) -> Result<(Vec<OsString>, ConsoleWords), CliError> {
    let mut plain = Vec::new();
    let mut console = ConsoleWords::default();
    let mut args = args.into_iter().peekable();
    while let Some(arg) = args.next() {
        let word = arg.to_string_lossy().into_owned();
        let Some(command) = word.strip_prefix('+').filter(|c| !c.is_empty()) else {
            plain.push(arg);
            continue;
        };
        if matches!(command, "set" | "seta") {
            match (args.next(), args.next()) {
                (Some(name), Some(value)) => console
                    .sets
                    .push((name.to_string_lossy().into(), value.to_string_lossy().into())),
                _ => return Err(CliError::Usage(format!("+{command} needs a name and a value"))),
            }
            continue;
        }
        let mut words = vec![command.to_owned()];
        while let Some(next) = args.peek() {
            let text = next.to_string_lossy();
            let option = text.starts_with('-') && text.parse::<f64>().is_err();
            if text.starts_with('+') || option {
                break;
            }
            words.push(text.into_owned());
            args.next();
        }
        console.commands.push(words);
    }
    Ok((plain, console))
}

/// Whether there is a window whose console takes commands.
fn plays(cli: &Cli) -> bool {
    matches!(cli.command, None | Some(Command::Play(_)))
}

fn dispatch() -> CliResult {
    let (plain, console) = split_console(std::env::args_os().collect())?;
    let cli = match Cli::try_parse_from(plain) {
        Ok(cli) => cli,
        // clap tells apart help (exit 0) and bad usage (exit 2) by itself.
        Err(e) => e.exit(),
    };
    let mut cvars = Cvars::default();
    for (name, value) in &console.sets {
        match cvars.set(name, value) {
            Ok(Some(note)) => eprintln!("{note}"),
            Ok(None) => {}
            Err(e) => return Err(CliError::Usage(e.to_string())),
        }
    }
    for words in &console.commands {
        let name = words[0].as_str();
        match &words[1..] {
            [] if name == "quit" && !plays(&cli) => return Ok(()),
            [_] if matches!(name, "map" | "devmap") => {}
            _ if matches!(name, "map" | "devmap") => {
                return Err(CliError::Usage(format!("+{name} needs the name of a map")));
            }
            // What the window's console does.
            _ if plays(&cli) && (find(name).is_some() || cvar(name).is_some()) => {}
            _ => {
                let hint = meant(name)
                    .filter(|n| !n.eq_ignore_ascii_case(name))
                    .map(|n| format!(" (did you mean +{n}?)"))
                    .unwrap_or_default();
                return Err(CliError::Usage(format!(
                    "\"+{}\" is no console command that can be used here{hint}",
                    words.join(" ")
                )));
            }
        }
    }
    cli.common.apply(&mut cvars)?;
    match cli.command {
        Some(Command::Render(args)) => render::run(&cli.common, cvars, args),
        Some(Command::Info(args)) => info::run(&cli.common, &cvars, &args),
        Some(Command::Lights(args)) => lights::run(&cli.common, cvars.number("rt_seed") as u32, &args),
        Some(Command::Maps(args)) => maps::run(&cli.common, &args),
        Some(Command::Bench(args)) => bench::run(&cli.common, &cvars, &args),
        Some(Command::Compare(args)) => compare::run(&args),
        Some(Command::Merge(args)) => merge::run(&args),
        Some(Command::Export(args)) => export::run(&cli.common, &cvars, &args),
        Some(Command::Play(args)) => play::run(&cli.common, cvars, args, console),
        None => play::run(&cli.common, cvars, play::Args::default(), console),
    }
}

/// Runs the program and returns its exit code: 0 done, 1 failed, 2 bad usage.
pub fn run() -> ExitCode {
    // What the library has to say beside its errors: warnings, or what RUST_LOG asks for.
    let filter = tracing_subscriber::EnvFilter::try_from_default_env()
        .unwrap_or_else(|_| tracing_subscriber::EnvFilter::new("error,q3rays=warn"));
    tracing_subscriber::fmt()
        .with_env_filter(filter)
        .with_writer(std::io::stderr)
        .without_time()
        .init();
    match dispatch() {
        Ok(()) => ExitCode::SUCCESS,
        Err(e) => {
            eprintln!("q3rays: {e}");
            ExitCode::from(if matches!(e, CliError::Usage(_)) { 2 } else { 1 })
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn os(words: &[&str]) -> Vec<OsString> {
        words.iter().map(OsString::from).collect()
    }

    #[test]
    fn console_words_are_taken_from_anywhere() {
        let split = split_console(os(&[
            "q3rays",
            "+set",
            "rt_exposure",
            "-1",
            "render",
            "oa_dm1",
            "+map",
            "x",
            "--out",
            "a.png",
        ]));
        let Ok((plain, console)) = split else {
            panic!("split failed");
        };
        assert_eq!(plain, os(&["q3rays", "render", "oa_dm1", "--out", "a.png"]));
        assert_eq!(console.sets, [("rt_exposure".to_owned(), "-1".to_owned())]);
        assert_eq!(console.commands, [["map".to_owned(), "x".to_owned()]]);
        assert!(split_console(os(&["q3rays", "+set", "x"])).is_err());
    }

    #[test]
    fn the_arguments_are_consistent() {
        use clap::CommandFactory;
        Cli::command().debug_assert();
    }
}
