//! The console: variables, commands, keys, configuration. This module knows nothing of windows or the GPU.

pub mod binds;
pub mod commands;
pub mod complete;
pub mod config;
pub mod cvars;
pub mod log;
pub mod nearest;
pub mod settings;
pub mod shell;
pub mod table;
pub mod tokens;

pub use cvars::{CvarError, Cvars};
pub use shell::Shell;
