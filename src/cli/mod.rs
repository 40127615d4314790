//! The command line.

mod args;
mod common;
mod compare;
mod info;
mod maps;
mod merge;
mod render;

pub use args::run;
