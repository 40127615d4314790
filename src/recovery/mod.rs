//! Recovery of the point lights that the map compiler stripped, from the lightmaps that it left.
//!
//! ```text
//! luxels (encoding, luxels) ─► known terms (known) + gathered light (gather) ─► what they leave over (fit)
//!     ─► candidate places (candidates) ─► greedy sparse search (solve, point) ─► lights, scales, scores
//! ```
//!
//! Everything runs on the CPU, in parallel, and gives the same result for the same seed.

pub mod cache;
pub mod candidates;
pub mod dome;
pub mod emitter;
pub mod encoding;
pub mod fit;
pub mod gather;
pub mod held_out;
pub mod known;
pub mod lights_file;
pub mod luxel_table;
pub mod luxels;
pub mod merge;
pub mod point;
pub mod random;
pub mod recover;
pub mod scene_lights;
pub mod score;
pub mod solve;
pub mod spot;
pub mod visibility;

pub use lights_file::{LightsFile, LightsFileError};
pub use recover::{Options, Recovery, RecoveryError, recover};
