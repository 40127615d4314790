//! Acceleration structures for ray queries: bottom levels of triangles, top levels of instances.

mod bottom;
mod build;
mod memory;
mod top;

pub use bottom::{BottomDesc, BottomLevel, BuildPreference, BuildStatistics, Refit};
pub use build::TriangleGeometry;
pub use memory::Scratch;
pub use top::{TopInstance, TopLevel};
