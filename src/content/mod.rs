//! The content we ship, made by code: the show-case map, its shaders and its textures.

pub mod embedded;
pub mod fly_through;
pub mod showcase;
pub mod textures;
