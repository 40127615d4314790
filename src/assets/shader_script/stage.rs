//! One pass of a shader.

use super::blend::{AlphaFunc, Blend, BlendFactor, DepthFunc};
use super::color::{AlphaGen, RgbGen};
use super::texcoord::{TcGen, TcMod};

/// What a stage samples.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub enum Image {
    /// `$lightmap`: the surface's lightmap, white where it has none.
    Lightmap,
    /// `$whiteimage` or `*white`.
    White,
    /// `*identityLight`: grey by the overbright range.
    IdentityLight,
    /// Any other image the engine makes itself, by its name with the `*` or `$`.
    Builtin(String),
    /// An image file, named as in the script.
    File(String),
}

impl Image {
    /// By its name in a script.
    pub fn from_name(name: &str) -> Self {
        match name.to_ascii_lowercase().as_str() {
            "$lightmap" => Self::Lightmap,
            "$whiteimage" | "*white" => Self::White,
            "*identitylight" => Self::IdentityLight,
            _ if name.starts_with(['$', '*']) => Self::Builtin(name.to_owned()),
            _ => Self::File(name.to_owned()),
        }
    }

    /// The name of the image file, if it is one.
    pub fn file(&self) -> Option<&str> {
        match self {
            Self::File(name) => Some(name),
            _ => None,
        }
    }
}

/// Texture of a stage.
#[derive(Clone, Debug, PartialEq)]
pub enum StageTexture {
    /// Repeats.
    Map(Image),
    /// Clamped at the edges.
    ClampMap(Image),
    /// Images shown in turn, `frequency` of them per second; 1 to 8.
    AnimMap { frequency: f32, images: Vec<Image> },
    /// A film.
    VideoMap(String),
}

impl StageTexture {
    /// The images in order; none for a film.
    pub fn images(&self) -> &[Image] {
        match self {
            Self::Map(image) | Self::ClampMap(image) => std::slice::from_ref(image),
            Self::AnimMap { images, .. } => images,
            Self::VideoMap(_) => &[],
        }
    }
}

/// One pass, as written; the `…_or_default` methods fill in what the game does where the script is silent.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Stage {
    /// Line of its opening brace.
    pub line: u32,
    /// The game drops a stage without texture.
    pub texture: Option<StageTexture>,
    pub blend: Option<Blend>,
    pub rgb_gen: Option<RgbGen>,
    pub alpha_gen: Option<AlphaGen>,
    pub tc_gen: Option<TcGen>,
    pub tc_mods: Vec<TcMod>,
    pub alpha_func: Option<AlphaFunc>,
    pub depth_func: DepthFunc,
    /// `depthWrite` is given.
    pub depth_write: bool,
    /// Left out where the user wants no detail textures.
    pub detail: bool,
}

impl Stage {
    /// Most images in an `animMap`.
    pub const MAX_ANIMATIONS: usize = 8;
    /// Most `tcMod`s.
    pub const MAX_TC_MODS: usize = 4;

    /// Samples the lightmap.
    pub fn is_lightmap(&self) -> bool {
        matches!(&self.texture, Some(StageTexture::Map(Image::Lightmap)))
    }

    /// Blending that changes anything: `GL_ONE GL_ZERO` is none.
    pub fn effective_blend(&self) -> Option<Blend> {
        self.blend.filter(|blend| *blend != Blend::REPLACE)
    }

    /// Opaque stages write depth, blended ones only with `depthWrite`.
    pub fn writes_depth(&self) -> bool {
        self.depth_write || self.effective_blend().is_none()
    }

    /// Without `rgbGen`: identity where the source factor depends on what is there, else `identityLighting`.
    pub fn rgb_gen_or_default(&self) -> RgbGen {
        self.rgb_gen.unwrap_or(match self.blend.map(|blend| blend.source) {
            None | Some(BlendFactor::One | BlendFactor::SrcAlpha) => RgbGen::IdentityLighting,
            Some(_) => RgbGen::Identity,
        })
    }

    /// Without `alphaGen`: identity.
    pub fn alpha_gen_or_default(&self) -> AlphaGen {
        self.alpha_gen.unwrap_or(AlphaGen::Identity)
    }

    /// Without `tcGen`: lightmap coordinates for the lightmap, else the texture's.
    pub fn tc_gen_or_default(&self) -> TcGen {
        let default = if self.is_lightmap() {
            TcGen::Lightmap
        } else {
            TcGen::Texture
        };
        self.tc_gen.unwrap_or(default)
    }

    /// The picture changes with time without any change of the scene.
    pub fn is_animated(&self) -> bool {
        let moves = |tc_mod: &TcMod| !matches!(tc_mod, TcMod::Scale(_) | TcMod::Transform { .. });
        matches!(
            self.texture,
            Some(StageTexture::AnimMap { .. } | StageTexture::VideoMap(_))
        ) || matches!(self.rgb_gen, Some(RgbGen::Wave(_)))
            || matches!(self.alpha_gen, Some(AlphaGen::Wave(_)))
            || self.tc_mods.iter().any(moves)
    }
}

#[cfg(test)]
mod tests {
    use super::{Image, Stage, StageTexture};
    use crate::assets::shader_script::{Blend, RgbGen, TcGen};

    #[test]
    fn special_images() {
        assert_eq!(Image::from_name("$LightMap"), Image::Lightmap);
        assert_eq!(Image::from_name("*white"), Image::White);
        assert_eq!(Image::from_name("*scratch"), Image::Builtin("*scratch".into()));
        assert_eq!(Image::from_name("a/b.tga").file(), Some("a/b.tga"));
    }

    #[test]
    fn defaults_depend_on_blend_and_texture() {
        let mut stage = Stage::default();
        assert_eq!(stage.rgb_gen_or_default(), RgbGen::IdentityLighting);
        assert!(stage.writes_depth());
        stage.blend = Some(Blend::FILTER);
        assert_eq!(stage.rgb_gen_or_default(), RgbGen::Identity);
        assert!(!stage.writes_depth());
        stage.blend = Some(Blend::REPLACE);
        assert!(stage.writes_depth() && stage.effective_blend().is_none());
        assert_eq!(stage.tc_gen_or_default(), TcGen::Texture);
        stage.texture = Some(StageTexture::Map(Image::Lightmap));
        assert_eq!(stage.tc_gen_or_default(), TcGen::Lightmap);
    }
}
