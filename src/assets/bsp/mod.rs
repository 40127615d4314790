//! Quake III maps: IBSP version 46.

pub mod build;
pub mod check;
pub mod file;
pub mod lumps;
pub mod patch;
pub mod tree;
pub mod visibility;

pub use file::{Bsp, BspError};
pub use tree::Bounds;
