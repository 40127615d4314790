//! How a stage combines with what is already drawn.

/// A factor of `blendFunc`, OpenGL's by the same name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum BlendFactor {
    Zero,
    One,
    SrcColor,
    OneMinusSrcColor,
    DstColor,
    OneMinusDstColor,
    SrcAlpha,
    OneMinusSrcAlpha,
    DstAlpha,
    OneMinusDstAlpha,
    SrcAlphaSaturate,
}

impl BlendFactor {
    /// A factor for the incoming colour; `SRC_COLOR` isn't one in the game.
    pub fn source(name: &str) -> Option<Self> {
        Self::from_name(name).filter(|factor| !matches!(factor, Self::SrcColor | Self::OneMinusSrcColor))
    }

    /// A factor for the colour already there; `DST_COLOR` and `SRC_ALPHA_SATURATE` aren't ones in the game.
    pub fn destination(name: &str) -> Option<Self> {
        Self::from_name(name)
            .filter(|factor| !matches!(factor, Self::DstColor | Self::OneMinusDstColor | Self::SrcAlphaSaturate))
    }

    fn from_name(name: &str) -> Option<Self> {
        Some(match name.to_ascii_uppercase().as_str() {
            "GL_ZERO" => Self::Zero,
            "GL_ONE" => Self::One,
            "GL_SRC_COLOR" => Self::SrcColor,
            "GL_ONE_MINUS_SRC_COLOR" => Self::OneMinusSrcColor,
            "GL_DST_COLOR" => Self::DstColor,
            "GL_ONE_MINUS_DST_COLOR" => Self::OneMinusDstColor,
            "GL_SRC_ALPHA" => Self::SrcAlpha,
            "GL_ONE_MINUS_SRC_ALPHA" => Self::OneMinusSrcAlpha,
            "GL_DST_ALPHA" => Self::DstAlpha,
            "GL_ONE_MINUS_DST_ALPHA" => Self::OneMinusDstAlpha,
            "GL_SRC_ALPHA_SATURATE" => Self::SrcAlphaSaturate,
            _ => return None,
        })
    }
}

/// Result = incoming · source + existing · destination.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Blend {
    pub source: BlendFactor,
    pub destination: BlendFactor,
}

impl Blend {
    /// `blendFunc add`
    pub const ADD: Self = Self {
        source: BlendFactor::One,
        destination: BlendFactor::One,
    };
    /// `blendFunc filter`
    pub const FILTER: Self = Self {
        source: BlendFactor::DstColor,
        destination: BlendFactor::Zero,
    };
    /// `blendFunc blend`
    pub const BLEND: Self = Self {
        source: BlendFactor::SrcAlpha,
        destination: BlendFactor::OneMinusSrcAlpha,
    };
    /// Replaces what is there: the same as no blending.
    pub const REPLACE: Self = Self {
        source: BlendFactor::One,
        destination: BlendFactor::Zero,
    };

    /// One of the three short forms.
    pub fn from_name(name: &str) -> Option<Self> {
        Some(match name.to_ascii_lowercase().as_str() {
            "add" => Self::ADD,
            "filter" => Self::FILTER,
            "blend" => Self::BLEND,
            _ => return None,
        })
    }
}

/// Which alpha values pass, on the texture's alpha after `alphaGen`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum AlphaFunc {
    /// alpha > 0
    Gt0,
    /// alpha < 0.5
    Lt128,
    /// alpha ≥ 0.5
    Ge128,
}

impl AlphaFunc {
    /// By its name in scripts, in any case.
    pub fn from_name(name: &str) -> Option<Self> {
        Some(match name.to_ascii_uppercase().as_str() {
            "GT0" => Self::Gt0,
            "LT128" => Self::Lt128,
            "GE128" => Self::Ge128,
            _ => return None,
        })
    }

    /// Whether an alpha in 0..1 passes.
    pub fn passes(self, alpha: f32) -> bool {
        match self {
            Self::Gt0 => alpha > 0.0,
            Self::Lt128 => alpha < 0.5,
            Self::Ge128 => alpha >= 0.5,
        }
    }
}

/// Depth test of a stage.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum DepthFunc {
    #[default]
    LessEqual,
    /// Only where an earlier stage has drawn.
    Equal,
}

#[cfg(test)]
mod tests {
    use super::{AlphaFunc, Blend, BlendFactor};

    #[test]
    fn factors_are_checked_for_their_side() {
        assert_eq!(BlendFactor::source("gl_dst_color"), Some(BlendFactor::DstColor));
        assert_eq!(BlendFactor::destination("gl_dst_color"), None);
        assert_eq!(BlendFactor::destination("GL_SRC_COLOR"), Some(BlendFactor::SrcColor));
        assert_eq!(BlendFactor::source("GL_SRC_COLOR"), None);
        assert_eq!(BlendFactor::source("one"), None);
    }

    #[test]
    fn short_forms() {
        assert_eq!(Blend::from_name("Filter"), Some(Blend::FILTER));
        assert_eq!(Blend::from_name("gl_one"), None);
    }

    #[test]
    fn alpha_limits() {
        assert!(AlphaFunc::Ge128.passes(0.5) && !AlphaFunc::Lt128.passes(0.5));
        assert!(AlphaFunc::Gt0.passes(1e-6) && !AlphaFunc::Gt0.passes(0.0));
    }
}
