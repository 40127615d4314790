//! Stages blended over a background that is not known: see [`super::program`].

use super::program::UNLIT;
use super::records::*;
use crate::assets::image::decode_srgb;
use glam::{Vec3, Vec4, Vec4Swizzles};

/// What a surface does with light, linear.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shade {
    /// Reflectance.
    pub albedo: Vec3,
    /// Radiance of what shines by itself, luxel units; what the material's emission stands for is not in it.
    pub glow: Vec3,
    /// Share of the background that shows through; above 1 where blending brightens it.
    pub through: Vec3,
    /// Reflectance of the glossy lobe at normal incidence.
    pub specular: Vec3,
}

/// Stages blended so far, encoded. Counterpart of `blend_stage` and `blended` in `shaders/include/program.glsl`.
#[derive(Clone, Copy, Debug)]
pub struct Blending {
    lit: Vec3,
    /// Unlit, laid over the background.
    over: Vec3,
    /// Unlit, added to it.
    add: Vec3,
    /// What is left of the background: a colour as encoded values multiply it, and a share by alpha.
    through: Vec3,
    share: f32,
    /// Reflectance of glossy stages.
    specular: Vec3,
    /// Glossy stages reflect; else they are pictures like others.
    glossy: bool,
}

impl Default for Blending {
    fn default() -> Self {
        Self {
            lit: Vec3::ZERO,
            over: Vec3::ZERO,
            add: Vec3::ZERO,
            through: Vec3::ONE,
            share: 1.0,
            specular: Vec3::ZERO,
            glossy: false,
        }
    }
}

fn decode(c: Vec3) -> Vec3 {
    c.map(decode_srgb)
}

impl Blending {
    /// Nothing blended yet. `glossy`: glossy stages reflect.
    pub fn new(glossy: bool) -> Self {
        Self {
            glossy,
            ..Self::default()
        }
    }

    /// Blends a stage of encoded colour and alpha `c`.
    pub fn stage(&mut self, s: &Stage, c: Vec4) {
        let (rgb, alpha) = (c.xyz(), c.w);
        let lit = s.flags & STAGE_LIT != 0;
        let (own, mut from_there) = match s.source {
            BLEND_ZERO => (0.0, Vec3::ZERO),
            BLEND_DST_COLOR => (0.0, rgb),
            BLEND_ONE_MINUS_DST_COLOR => (1.0, -rgb),
            BLEND_SRC_ALPHA => (alpha, Vec3::ZERO),
            BLEND_ONE_MINUS_SRC_ALPHA => (1.0 - alpha, Vec3::ZERO),
            _ => (1.0, Vec3::ZERO),
        };
        let keep = match s.destination {
            BLEND_ONE | BLEND_ONE_MINUS_SRC_COLOR => 1.0,
            BLEND_SRC_ALPHA => alpha,
            BLEND_ONE_MINUS_SRC_ALPHA => 1.0 - alpha,
            _ => 0.0,
        };
        match s.destination {
            BLEND_SRC_COLOR => from_there += rgb,
            BLEND_ONE_MINUS_SRC_COLOR => from_there -= rgb,
            _ => {}
        }
        let coloured = from_there != Vec3::ZERO || s.source == BLEND_DST_COLOR || s.destination == BLEND_SRC_COLOR;
        let e = rgb * own;
        if self.glossy && s.flags & STAGE_GLOSSY != 0 {
            // What the stage shows is a reflection, also where it multiplies what is there.
            let base = self.lit + self.over + self.add;
            self.specular = (self.specular * keep + e + base * from_there.max(Vec3::ZERO)).clamp(Vec3::ZERO, Vec3::ONE);
            self.lit *= keep;
            self.over *= keep;
            self.add *= keep;
            if coloured {
                self.through *= (Vec3::splat(keep) + from_there).max(Vec3::ZERO);
            } else {
                self.share *= keep;
            }
            return;
        }
        if lit && coloured {
            // Light multiplies all that is there.
            self.lit += self.over + self.add;
            self.over = Vec3::ZERO;
            self.add = Vec3::ZERO;
        }
        let k = Vec3::splat(keep) + from_there;
        self.lit *= k;
        self.over *= k;
        self.add *= k;
        self.specular *= k.clamp(Vec3::ZERO, Vec3::ONE);
        if coloured {
            self.through *= k;
        } else {
            self.share *= keep;
        }
        if lit {
            self.lit += e;
        } else if s.flags & STAGE_EMISSION == 0 {
            if keep == 0.0 || (s.source == BLEND_SRC_ALPHA && s.destination == BLEND_ONE_MINUS_SRC_ALPHA) {
                self.over += e;
            } else {
                self.add += e;
            }
        }
        // What one of the sums lacks the other has: only together they are held to what a screen can show.
        self.add += self.over.min(Vec3::ZERO);
        self.lit = self.lit.clamp(Vec3::ZERO, Vec3::ONE);
        self.over = self.over.clamp(Vec3::ZERO, Vec3::ONE);
        self.add = self.add.clamp(Vec3::ZERO, Vec3::ONE);
        self.through = self.through.max(Vec3::ZERO);
    }

    /// What all stages come to.
    pub fn shade(&self) -> Shade {
        let opacity = 1.0 - self.share;
        let laid = |c: Vec3| {
            if opacity > 0.0 {
                decode((c / opacity).min(Vec3::ONE)) * opacity
            } else {
                decode(c)
            }
        };
        let glow = if opacity == 1.0 {
            decode((self.over + self.add).min(Vec3::ONE))
        } else {
            laid(self.over) + decode(self.add)
        };
        Shade {
            albedo: laid(self.lit),
            glow: glow * UNLIT,
            through: decode(self.through) * self.share,
            specular: decode(self.specular),
        }
    }
}
