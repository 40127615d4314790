//! Console variables. This module knows nothing of windows or the GPU.

pub mod cvars;
pub mod settings;

pub use cvars::{CvarError, Cvars};
