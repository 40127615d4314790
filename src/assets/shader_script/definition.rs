//! A shader definition as a whole.

use super::compiler::{CompilerParms, Directive};
use super::deform::Deform;
use super::sky::SkyParms;
use super::stage::Stage;
use super::surface_parm::{SurfaceParm, SurfaceParms, content};
use glam::Vec3;
use std::sync::Arc;

/// Which side of a surface is drawn.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Cull {
    /// The side its normal is on (the default; `front`).
    #[default]
    FrontSided,
    /// The other side (`back`, `backside`, `backsided`).
    BackSided,
    /// Both (`none`, `twosided`, `disable`).
    TwoSided,
}

/// Drawing order: lower is earlier.
#[derive(Clone, Copy, Debug, PartialEq, PartialOrd)]
pub struct Sort(pub f32);

impl Sort {
    pub const PORTAL: Self = Self(1.0);
    pub const SKY: Self = Self(2.0);
    pub const OPAQUE: Self = Self(3.0);
    pub const DECAL: Self = Self(4.0);
    pub const SEE_THROUGH: Self = Self(5.0);
    pub const BANNER: Self = Self(6.0);
    pub const UNDERWATER: Self = Self(8.0);
    /// What blended shaders get.
    pub const BLEND: Self = Self(9.0);
    pub const ADDITIVE: Self = Self(10.0);
    pub const NEAREST: Self = Self(16.0);

    /// By its name in scripts, in any case.
    pub fn from_name(name: &str) -> Option<Self> {
        Some(match name.to_ascii_lowercase().as_str() {
            "portal" => Self::PORTAL,
            "sky" => Self::SKY,
            "opaque" => Self::OPAQUE,
            "decal" => Self::DECAL,
            "seethrough" => Self::SEE_THROUGH,
            "banner" => Self::BANNER,
            "underwater" => Self::UNDERWATER,
            "additive" => Self::ADDITIVE,
            "nearest" => Self::NEAREST,
            _ => return None,
        })
    }
}

/// Fog in the volume behind the surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FogParms {
    /// Encoded, nominally 0..1.
    pub color: Vec3,
    /// Distance in units at which nothing is seen through it.
    pub depth_for_opaque: f32,
}

/// Directives for map editors.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct EditorParms {
    /// `qer_editorimage`; the map compiler takes texture size and, at need, the light's colour from it.
    pub image: Option<String>,
    /// `qer_trans`: opacity 0..1.
    pub trans: Option<f32>,
    /// Every other `qer*`.
    pub others: Vec<Directive>,
}

/// One definition, as written.
#[derive(Clone, Debug, PartialEq)]
pub struct Shader {
    pub name: String,
    /// Script file it is from.
    pub file: Arc<str>,
    /// Line of its name, from 1.
    pub line: u32,
    /// Passes in drawing order.
    pub stages: Vec<Stage>,
    pub cull: Cull,
    /// `sort`, or `portal`'s; see [`Self::effective_sort`].
    pub sort: Option<Sort>,
    pub polygon_offset: bool,
    pub no_mip_maps: bool,
    /// Also set by `nomipmaps`.
    pub no_pic_mip: bool,
    pub entity_mergable: bool,
    /// A mirror or portal.
    pub portal: bool,
    pub deforms: Vec<Deform>,
    pub surface_parms: SurfaceParms,
    pub sky: Option<SkyParms>,
    pub fog: Option<FogParms>,
    /// `tessSize`: the compiler splits surfaces into pieces of this many units.
    pub tess_size: Option<f32>,
    /// `light`: an old way to ask for a flare.
    pub light: Option<f32>,
    /// `rt_ior`, q3rays' own: index of refraction of a solid that the surface bounds, or of a pane.
    pub ior: Option<f32>,
    /// `rt_pane`, q3rays' own: both sides of a pane in one surface.
    pub pane: bool,
    /// `rt_roughness`, q3rays' own: of environment-mapped stages, 0..1.
    pub roughness: Option<f32>,
    /// `clampTime`: shader time stops at this many seconds.
    pub clamp_time: Option<f32>,
    pub editor: EditorParms,
    pub compiler: CompilerParms,
    /// ioquake3 stops at a fault in this definition and draws its default shader instead. What could be made out is
    /// there all the same.
    pub rejected: bool,
}

impl Shader {
    /// Most stages that the game takes.
    pub const MAX_STAGES: usize = 8;
    /// Most `deformVertexes` that the game takes.
    pub const MAX_DEFORMS: usize = 3;

    /// A definition with nothing in it.
    pub fn empty(name: &str, file: &Arc<str>, line: u32) -> Self {
        Self {
            name: name.to_owned(),
            file: Arc::clone(file),
            line,
            stages: Vec::new(),
            cull: Cull::default(),
            sort: None,
            polygon_offset: false,
            no_mip_maps: false,
            no_pic_mip: false,
            entity_mergable: false,
            portal: false,
            deforms: Vec::new(),
            surface_parms: SurfaceParms::default(),
            sky: None,
            fog: None,
            tess_size: None,
            light: None,
            ior: None,
            pane: false,
            roughness: None,
            clamp_time: None,
            editor: EditorParms::default(),
            compiler: CompilerParms::default(),
            rejected: false,
        }
    }

    /// Shows the sky, or is sky to the map compiler.
    pub fn is_sky(&self) -> bool {
        self.sky.is_some() || self.surface_parms.contains(SurfaceParm::Sky)
    }

    /// `q3map_surfacelight`, where it is not zero.
    pub fn emits(&self) -> Option<f32> {
        self.compiler.surface_light.filter(|light| *light != 0.0)
    }

    /// Both sides are drawn.
    pub fn is_two_sided(&self) -> bool {
        self.cull == Cull::TwoSided
    }

    /// Bounds a volume of fog.
    pub fn is_fog(&self) -> bool {
        self.surface_parms.contains(SurfaceParm::Fog)
    }

    /// Bounds water, slime or lava.
    pub fn is_liquid(&self) -> bool {
        self.content_flags() & (content::WATER | content::SLIME | content::LAVA) != 0
    }

    /// Its quads turn to the viewer.
    pub fn is_autosprite(&self) -> bool {
        let turns = |deform: &Deform| matches!(deform, Deform::Autosprite | Deform::Autosprite2);
        self.deforms.iter().any(turns)
    }

    /// A stage samples the lightmap.
    pub fn uses_lightmap(&self) -> bool {
        self.stages.iter().any(Stage::is_lightmap)
    }

    /// What is behind shows through: the first stage with a texture blends.
    pub fn is_blended(&self) -> bool {
        self.drawn_stages()
            .next()
            .is_some_and(|stage| stage.effective_blend().is_some())
    }

    /// Stages that the game draws: those with a texture.
    pub fn drawn_stages(&self) -> impl Iterator<Item = &Stage> {
        self.stages.iter().filter(|stage| stage.texture.is_some())
    }

    /// Whether ioquake3 shows its default picture: the definition is faulty, or has no stage and is neither sky nor
    /// fog.
    pub fn is_default_in_game(&self) -> bool {
        self.rejected || (self.stages.is_empty() && self.sky.is_none() && !self.is_fog())
    }

    /// Surface flags that q3map2 writes into a BSP.
    pub fn surface_flags(&self) -> u32 {
        self.compiled_parms().surface_flags()
    }

    /// Content flags that q3map2 writes into a BSP.
    pub fn content_flags(&self) -> u32 {
        self.compiled_parms().content_flags()
    }

    /// Drawing order with the game's defaults: sky, decals by `polygonOffset`, blended shaders late (early where the
    /// blended stage writes depth), the rest opaque.
    pub fn effective_sort(&self) -> Sort {
        if self.sky.is_some() {
            return Sort::SKY;
        }
        // The game takes sort 0 for none given.
        if let Some(sort) = self.sort.filter(|sort| sort.0 != 0.0) {
            return sort;
        }
        if self.polygon_offset {
            return Sort::DECAL;
        }
        match self.drawn_stages().next() {
            Some(stage) if stage.effective_blend().is_none() => Sort::OPAQUE,
            Some(stage) if stage.writes_depth() => Sort::SEE_THROUGH,
            Some(_) => Sort::BLEND,
            None => Sort::OPAQUE,
        }
    }

    /// The surface parameters with those that the compiler adds by itself.
    fn compiled_parms(&self) -> SurfaceParms {
        let mut parms = self.surface_parms.clone();
        self.compiler.surface_parms.iter().for_each(|parm| parms.insert(*parm));
        if !self.compiler.suns.is_empty() {
            parms.insert(SurfaceParm::Sky);
        }
        if self.is_autosprite() {
            parms.insert(SurfaceParm::Detail);
        }
        parms
    }
}

#[cfg(test)]
mod tests {
    use super::{Shader, Sort};
    use crate::assets::shader_script::{Blend, Image, Stage, StageTexture, SurfaceParm, content, surface};
    use std::sync::Arc;

    fn shader(blend: Option<Blend>) -> Shader {
        let mut shader = Shader::empty("s", &Arc::from("f"), 1);
        let texture = Some(StageTexture::Map(Image::White));
        shader.stages.push(Stage {
            texture,
            blend,
            ..Stage::default()
        });
        shader
    }

    #[test]
    fn order_without_sort_follows_the_first_stage() {
        assert_eq!(shader(None).effective_sort(), Sort::OPAQUE);
        let mut glass = shader(Some(Blend::ADD));
        assert_eq!(glass.effective_sort(), Sort::BLEND);
        glass.stages[0].depth_write = true;
        assert_eq!(glass.effective_sort(), Sort::SEE_THROUGH);
        glass.polygon_offset = true;
        assert_eq!(glass.effective_sort(), Sort::DECAL);
        glass.sort = Some(Sort(12.0));
        assert_eq!(glass.effective_sort(), Sort(12.0));
    }

    #[test]
    fn the_compiler_adds_parameters() {
        let mut lamp = shader(None);
        lamp.compiler.surface_parms.push(SurfaceParm::NoLightmap);
        lamp.deforms.push(super::Deform::Autosprite);
        assert_eq!(lamp.surface_flags(), surface::NO_LIGHTMAP | surface::POINT_LIGHT);
        assert_eq!(lamp.content_flags(), content::SOLID | content::DETAIL);
    }

    #[test]
    fn a_definition_without_stages_draws_the_default() {
        assert!(Shader::empty("s", &Arc::from("f"), 1).is_default_in_game());
        assert!(!shader(None).is_default_in_game());
    }
}
