//! The interactive program: a window, or a run without one.

pub mod fly_camera;
pub mod headless;
pub mod input;
pub mod window;
