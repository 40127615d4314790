//! The command line.

mod args;
mod bench;
mod common;
mod compare;
mod export;
mod info;
mod light_list;
mod lights;
mod maps;
mod merge;
mod path;
mod play;
mod render;
mod view;

pub use args::{CliError, run};
