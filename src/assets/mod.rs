//! Game data: files, maps, scripts, images.

pub mod bsp;
pub mod entities;
pub mod image;
pub mod shader_script;
pub mod vfs;
