//! Where a stage's colour and alpha come from.

use super::wave::Wave;
use glam::Vec3;

/// `rgbGen`: the colour that the texture is multiplied with.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum RgbGen {
    /// 1, at full display range.
    Identity,
    /// 1, scaled down by the overbright range.
    IdentityLighting,
    /// The entity's colour.
    Entity,
    OneMinusEntity,
    /// Vertex colour, scaled like `IdentityLighting`.
    Vertex,
    /// Vertex colour as stored.
    ExactVertex,
    OneMinusVertex,
    /// Grey by a wave, clamped to 0..1.
    Wave(Wave),
    /// Encoded colour, nominally 0..1.
    Const(Vec3),
    /// Lit by the light grid at the entity's place.
    LightingDiffuse,
}

/// `alphaGen`: the alpha that the texture's is multiplied with.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum AlphaGen {
    Identity,
    Entity,
    OneMinusEntity,
    Vertex,
    OneMinusVertex,
    /// By a wave, clamped to 0..1.
    Wave(Wave),
    /// Nominally 0..1.
    Const(f32),
    /// Specular highlight of a light at a fixed place.
    LightingSpecular,
    /// Distance to the viewer over this range in units, clamped to 0..1.
    Portal(f32),
}
