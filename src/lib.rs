//! q3rays: Quake III maps by real-time distributed ray tracing.
//!
//! `assets` reads game data, `scene` makes triangles, materials, lights and clusters of it, `game` walks it, `reference` traces it on the
//! CPU, `gpu` and `render` on Vulkan devices. None of these knows of windows, the console or where files lie.

pub mod app;
pub mod assets;
pub mod bench;
pub mod cli;
pub mod console;
pub mod content;
pub mod engine;
pub mod export;
pub mod game;
pub mod gpu;
pub mod lighting;
pub mod metrics;
pub mod output;
pub mod recovery;
pub mod reference;
pub mod render;
pub mod scene;
