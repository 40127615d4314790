//! Game data: files, maps, scripts, images.

pub mod bsp;
pub mod entities;
pub mod image;
pub mod md3;
pub mod shader_script;
pub mod vfs;
