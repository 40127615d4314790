//! Benchmarks that verify what they measure.

pub mod bandwidth;
pub mod comparison;
pub mod culling;
pub mod denoiser;
pub mod denoiser_report;
pub mod error;
pub mod error_report;
pub mod frames;
pub mod frames_report;
pub mod lights;
pub mod lights_plot;
pub mod lights_report;
pub mod motion;
pub mod page;
pub mod plot;
pub mod ray_buffers;
pub mod ray_report;
pub mod rays;
pub mod references;
pub mod run_info;
pub mod stage;
pub mod statistics;
pub mod structures;
pub mod sweep;
pub mod tour;
pub mod truth;
