//! The CPU tracer: an independent oracle for the shaders, and what runs where there is no Vulkan.
//!
//! It follows the same estimators with the same random numbers as `shaders/`, file by file; intersections and sums are
//! done in double precision.

pub mod branches;
pub mod direct;
pub mod layers;
pub mod light_cells;
pub mod light_choice;
pub mod light_sample;
pub mod portal;
pub mod primary;
pub mod program;
pub mod renderer;
pub mod surface;
pub mod texture;
pub mod trace;
pub mod views;
pub mod visibility;

pub use renderer::CpuRenderer;
