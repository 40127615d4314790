//! The interactive program: a window, or a run without one.

mod actions;
mod capture;
mod controls;
pub mod film;
pub mod folders;
mod game;
#[cfg(feature = "gamepad")]
mod gamepad;
pub mod headless;
pub mod input;
mod journey;
mod keys;
mod level;
mod lifecycle;
mod loading;
mod painter;
mod screen;
#[cfg(feature = "compile-shaders")]
mod shader_watch;
mod ui;
pub mod walk;
pub mod window;

pub use loading::{LoadScene, MapSource, Report};
