//! The interactive program: a window, or a run without one.

pub mod headless;
pub mod input;
pub mod walk;
pub mod window;
