//! Directives for the map compiler: what a surface emits and how it was lit. Values are as written in the script.

use super::surface_parm::SurfaceParm;
use glam::Vec3;

/// Sunlight through sky surfaces (`q3map_sun`, `sun`, `q3map_sunExt`).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sun {
    /// Encoded colour of any length; compilers normalise it.
    pub color: Vec3,
    /// In lightmap byte units for a surface that faces the sun.
    pub intensity: f32,
    /// Compass direction to the sun: 0 = +x (east), 90 = +y (north).
    pub azimuth_degrees: f32,
    /// 0 = on the horizon, 90 = overhead.
    pub elevation_degrees: f32,
    /// Angular radius; 0 for a point.
    pub deviance_degrees: f32,
    /// How many suns the compiler spreads over the disc; 0 where the script doesn't tell.
    pub samples: u32,
}

impl Sun {
    /// Unit vector to the sun, z up.
    pub fn direction(&self) -> Vec3 {
        let (sin_azimuth, cos_azimuth) = self.azimuth_degrees.to_radians().sin_cos();
        let (sin_elevation, cos_elevation) = self.elevation_degrees.to_radians().sin_cos();
        Vec3::new(cos_azimuth * cos_elevation, sin_azimuth * cos_elevation, sin_elevation)
    }
}

/// Light from the whole upper half of the sky (`q3map_skyLight`).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SkyLight {
    /// Sum over all directions, in lightmap byte units; at least 0.
    pub intensity: f32,
    /// n of the 4(n−1)² + 1 suns; at least 2.
    pub iterations: u32,
}

/// Light that an emitting surface throws back onto its mounting (`q3map_backsplash`; 5 % from 23 units by default).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Backsplash {
    /// Of the surface's light.
    pub percent: f32,
    /// In units.
    pub distance: f32,
}

/// How a stage made up by `implicitMap` and its kin blends (Enemy Territory; ioquake3 refuses them).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum ImplicitKind {
    /// `implicitMap`
    Opaque,
    /// `implicitMask`
    Masked,
    /// `implicitBlend`
    Blended,
}

/// Image of a shader without stages of its own.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ImplicitImage {
    pub kind: ImplicitKind,
    /// None for `-`: the image has the shader's name.
    pub image: Option<String>,
}

/// A directive kept as written.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Directive {
    pub name: String,
    pub args: Vec<String>,
    /// Line in the file, from 1.
    pub line: u32,
}

/// All directives that q3map2 reads. Where one is given twice the last counts, except suns, which add.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct CompilerParms {
    /// `q3map_surfacelight`: emitted light; radiance 0.75/255 of this times the surface's colour.
    pub surface_light: Option<f32>,
    /// `q3map_lightimage`: the image whose mean is the emitted colour.
    pub light_image: Option<String>,
    /// `q3map_lightRGB`: emitted colour of any length; (0, 0, 0) counts as not given.
    pub light_rgb: Option<Vec3>,
    /// `q3map_lightSubdivide`: greatest extent of one emitting piece in units (999 by default).
    pub light_subdivide: Option<f32>,
    pub backsplash: Option<Backsplash>,
    pub sky_light: Option<SkyLight>,
    pub suns: Vec<Sun>,
    /// `q3map_bounceScale`, `q3map_bounce`: factor on bounced light (1 by default).
    pub bounce_scale: Option<f32>,
    /// `q3map_lightStyle`: animated light, 0..=254.
    pub light_style: Option<u32>,
    /// `q3map_lightmapSampleSize`: units per luxel.
    pub lightmap_sample_size: Option<f32>,
    /// `q3map_lightmapBrightness`, `q3map_lightmapGamma`: factor on the stored luxels.
    pub lightmap_brightness: Option<f32>,
    /// `q3map_lightmapFilterRadius`: blur in units of this surface's lightmap, and of the light it emits.
    pub lightmap_filter_radius: Option<(f32, f32)>,
    /// `q3map_vertexScale`: factor on the stored vertex colours.
    pub vertex_scale: Option<f32>,
    /// `q3map_noVertexLight`: vertex colours are the mapper's.
    pub no_vertex_light: bool,
    /// `q3map_forceSunlight`: in sunlight whatever stands between.
    pub force_sunlight: bool,
    /// `q3map_globalTexture`: texture coordinates don't start anew at each brush.
    pub global_texture: bool,
    /// `q3map_nonPlanar`: faces of several planes share a lightmap.
    pub non_planar: bool,
    /// `q3map_shadeAngle`: normals are smoothed across edges up to this many degrees.
    pub shade_angle_degrees: Option<f32>,
    /// `q3map_noFog`
    pub no_fog: bool,
    /// `q3map_invert`: faces are turned round.
    pub invert: bool,
    /// `q3map_offset`: faces are moved along their normal by this many units.
    pub offset: Option<f32>,
    /// `q3map_baseShader`: the compiler starts from the directives of this shader.
    pub base_shader: Option<String>,
    /// `q3map_flareShader`, `q3map_flare`
    pub flare_shader: Option<String>,
    /// `q3map_backShader`: shader of the inner side of the brush.
    pub back_shader: Option<String>,
    /// `q3map_normalImage`
    pub normal_image: Option<String>,
    pub implicit_image: Option<ImplicitImage>,
    /// Parameters given as `q3map_<surfaceparm>`, which the compiler applies and the game doesn't.
    pub surface_parms: Vec<SurfaceParm>,
    /// Every other `q3map_*`.
    pub others: Vec<Directive>,
    /// Directives behind another one on the same line: q3map2 reads one a line and never sees these.
    pub unread: Vec<Directive>,
}

#[cfg(test)]
mod tests {
    use super::Sun;
    use glam::Vec3;

    #[test]
    fn suns_stand_where_compass_and_elevation_say() {
        let sun = |azimuth_degrees, elevation_degrees| Sun {
            color: Vec3::ONE,
            intensity: 1.0,
            azimuth_degrees,
            elevation_degrees,
            deviance_degrees: 0.0,
            samples: 0,
        };
        assert!(sun(90.0, 0.0).direction().abs_diff_eq(Vec3::Y, 1e-6));
        assert!(sun(12.0, 90.0).direction().abs_diff_eq(Vec3::Z, 1e-6));
        assert!((sun(45.0, 30.0).direction().length() - 1.0).abs() < 1e-6);
    }
}
