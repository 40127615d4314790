//! Benchmarks that verify what they measure.

pub mod bandwidth;
pub mod culling;
pub mod denoiser;
pub mod denoiser_report;
pub mod lights;
pub mod lights_plot;
pub mod lights_report;
pub mod motion;
pub mod ray_buffers;
pub mod ray_report;
pub mod rays;
pub mod references;
pub mod stage;
pub mod structures;
