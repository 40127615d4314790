//! Where a stage's texture coordinates come from and how they move.

use super::wave::Wave;
use glam::{Mat2, Vec2, Vec3};

/// `tcGen`: source of the coordinates.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum TcGen {
    /// The vertex's texture coordinates (`base` or `texture`).
    Texture,
    /// The vertex's lightmap coordinates.
    Lightmap,
    /// From the reflected view direction.
    Environment,
    /// Dot products of the position with two vectors.
    Vector(Vec3, Vec3),
}

/// `tcMod`: changes of the coordinates, applied in the order of the script.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum TcMod {
    /// Turbulence. The function is always a sine and the base is not used.
    Turbulence(Wave),
    Scale(Vec2),
    /// Texture widths per second.
    Scroll(Vec2),
    /// Divides the coordinates, around the texture's middle, by the wave's value.
    Stretch(Wave),
    /// (s', t') = (s·m00 + t·m10 + t0, s·m01 + t·m11 + t1): `matrix` times the column (s, t), plus `translate`.
    Transform {
        matrix: Mat2,
        translate: Vec2,
    },
    /// Degrees per second around the texture's middle.
    Rotate(f32),
    /// Scrolls by the entity's `shaderTexCoord`.
    EntityTranslate,
}
