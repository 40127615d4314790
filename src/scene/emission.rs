//! Emitted radiance: the one function that estimators, camera hits and export share.
//!
//! `Material::emission` (times the decoded texel where there is an emission texture) is the radiance in luxel units; the
//! functions here derive it from the compiler's `q3map_surfacelight`.

use crate::assets::image::Texture;
use glam::Vec3;

/// Radiance of `q3map_surfacelight 1` in luxel units: v = 0.75·N·F, 255 byte units are 1.
pub const SURFACE_LIGHT_RADIANCE: f32 = 0.75 / 255.0;
/// Decoded texel means below this are taken for black.
const BLACK: f32 = 1e-3;

/// Emission of a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Emission {
    /// Mean radiance over the surface, luxel units.
    pub radiance: Vec3,
    /// Texture whose decoded texels modulate it, mean 1.
    pub texture: Option<u32>,
}

impl Emission {
    /// From `q3map_surfacelight` and a colour whose largest component is 1.
    pub fn from_surface_light(value: f32, colour: Vec3, texture: Option<u32>) -> Self {
        Self {
            radiance: colour * (value * SURFACE_LIGHT_RADIANCE),
            texture,
        }
    }
}

/// A colour scaled so that its largest component is 1; white for black.
pub fn max_one(colour: Vec3) -> Vec3 {
    let largest = colour.max_element();
    if largest > 0.0 { colour / largest } else { Vec3::ONE }
}

/// The compiler's colour of an emitter: `rgb`, or else the mean of the encoded bytes of the first image that loaded.
pub fn emission_colour<'a>(rgb: Option<Vec3>, mut images: impl Iterator<Item = &'a Texture>) -> Vec3 {
    let colour = rgb.or_else(|| images.find(|t| !t.missing).map(|t| Vec3::from(t.mean_encoded)));
    max_one(colour.unwrap_or(Vec3::ONE).max(Vec3::ZERO))
}

/// The factor that gives what shows `mean` on average a radiance, but for channels that are next to black, which get less;
/// `None` for what is black altogether.
pub fn normalised(radiance: Vec3, mean: Vec3) -> Option<Vec3> {
    (mean.max_element() >= BLACK).then(|| radiance / mean.max(Vec3::splat(BLACK)))
}

/// Splits emission into the factor and texture of a material record: factor × decoded texel has the emission's mean.
pub fn normalised_texture(emission: &Emission, textures: &[Texture]) -> (Vec3, Option<u32>) {
    let scaled = emission
        .texture
        .and_then(|t| normalised(emission.radiance, Vec3::from(textures[t as usize].mean_linear)));
    match scaled {
        Some(scaled) => (scaled, emission.texture),
        None => (emission.radiance, None),
    }
}
