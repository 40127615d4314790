//! Benchmarks that verify what they measure.

pub mod ray_buffers;
pub mod ray_report;
pub mod rays;
