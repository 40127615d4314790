//! Procedural textures of the shipped map: made from noise and geometry, the same bytes on every machine.
//!
//! Only basic arithmetic and square roots are used (which IEEE 754 fixes to the last bit), colours are given in encoded
//! (sRGB) values, and every image but the sky's tiles.

mod glow;
mod masonry;
mod metal;
mod noise;
mod png;
mod relief;
mod set;

pub use png::{TextureError, encode};
pub use relief::Texture;
pub use set::all;
