//! The frame: [`frame`] reads like its table of contents, each pass has a file and a shader of the same stem.

pub mod backend;
pub mod bvh_upload;
pub mod composite;
pub mod direct;
pub mod exposure;
pub mod film;
pub mod focus;
pub mod frame;
pub mod frame_constants;
pub mod gbuffer;
pub mod gpu_renderer;
pub mod pass;
pub mod primary;
pub mod realtime;
pub mod resample;
pub mod reservoirs;
pub mod reuse;
pub mod scene_gpu;
pub mod settings;
pub mod tone_map;
pub mod tonemap;
pub mod view_state;
