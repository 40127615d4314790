//! Image metrics behind `q3rays compare A B`: A is the image, B the reference.
//!
//! [`compare`] gives every figure, [`heatmap`] the FLIP error map as a picture. Both take images in memory, linear
//! Rec. 709 RGB, row by row from the top. What each figure means is written at [`Metrics`].

mod basic;
mod color;
mod compare;
mod filter;
mod flip_hdr;
mod flip_ldr;
mod heatmap;
mod magma;
mod ssim;
mod types;

pub use compare::compare;
pub use heatmap::heatmap;
pub use types::{ImageRgb, Kind, Metrics, MetricsError};
