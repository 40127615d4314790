//! Material programs: a script's stages as records that both tracers evaluate at every hit.
//!
//! A surface is what its stages leave over a background that is not known when they are evaluated. Every blend function is
//! affine in what is there already, so a few sums carry the stages to their end: what is lit, what shines by itself, and what
//! is left of the background ([`Blending`]). Stages blend as authored, on encoded values; the result is decoded once.
//!
//! Light is traced, so the lightmap is white and marks what it multiplies as lit, and so do vertex colours that hold baked
//! light. `docs/materials.md` has the whole mapping.

use super::blending::Blending;
use super::clock::{NOISE_STEPS, rate};
use super::records::*;
use super::textures::{TextureRequests, WHITE};
use crate::assets::image::{Texture, decode_srgb};
use crate::assets::shader_script::{
    AlphaGen, Blend, BlendFactor, Image, RgbGen, Shader, Stage as Pass, StageTexture, TcGen, TcMod as Change,
    Wave as Oscillation, WaveFunction,
};
use glam::{Vec3, Vec4};

/// Radiance of what shines by itself where its stages show 1: what the game shows beside a surface lit by luxels of 64, its
/// display's unit.
pub const UNLIT: f32 = 64.0 / 255.0;
/// Display range of the game over that of stored colours: its `r_mapOverBrightBits`.
pub const OVERBRIGHT: f32 = 4.0;
/// Phases that a wave's mean is taken over.
const MEAN_PHASES: u32 = 64;

/// The stages of one material.
#[derive(Clone, Debug, Default)]
pub struct Program {
    /// `first_mod` counts from this program's first.
    pub stages: Vec<Stage>,
    pub mods: Vec<TcMod>,
    /// Texture (and whether it clamps) that says it all: it is lit and nothing else happens.
    pub plain: Option<(u32, bool)>,
    /// Stage of the alpha test where it is not the plain texture's alpha.
    pub alpha_stage: Option<u32>,
    /// What is behind may show through.
    pub layer: bool,
    /// A layer that takes something from light passing through.
    pub filters: bool,
    /// The picture changes with the clock.
    pub animated: bool,
    /// What it emits changes with the clock.
    pub moving_emission: bool,
    /// Some stage stands for a glossy reflection.
    pub glossy: bool,
}

/// The record of a wave.
pub fn wave_record(w: &Oscillation) -> Wave {
    let noise = w.function == WaveFunction::Noise;
    let steps = if noise { NOISE_STEPS } else { 1.0 };
    Wave {
        function: match w.function {
            WaveFunction::Sine => WAVE_SINE,
            WaveFunction::Triangle => WAVE_TRIANGLE,
            WaveFunction::Square => WAVE_SQUARE,
            WaveFunction::Sawtooth => WAVE_SAWTOOTH,
            WaveFunction::InverseSawtooth => WAVE_INVERSE_SAWTOOTH,
            WaveFunction::Noise => WAVE_NOISE,
        },
        base: w.base,
        amplitude: w.amplitude,
        phase: w.phase / steps,
        rate: rate(w.frequency / steps),
    }
}

/// Fraction 0..1 of a number.
fn fraction(x: f32) -> f32 {
    x - x.floor()
}

/// A step of noise, −1..1.
fn noise_step(step: u32) -> f32 {
    (super::sampling::pcg(step & (NOISE_STEPS as u32 - 1)) >> 8) as f32 * (2.0 / 16_777_216.0) - 1.0
}

/// Value of a wave at `phase` periods after its start.
pub fn wave_at(w: &Wave, phase: f32) -> f32 {
    let f = fraction(phase);
    let value = match w.function {
        WAVE_SINE => (f * std::f32::consts::TAU).sin(),
        WAVE_TRIANGLE if f < 0.25 => 4.0 * f,
        WAVE_TRIANGLE if f < 0.75 => 2.0 - 4.0 * f,
        WAVE_TRIANGLE => 4.0 * f - 4.0,
        WAVE_SQUARE if f < 0.5 => 1.0,
        WAVE_SQUARE => -1.0,
        WAVE_SAWTOOTH => f,
        WAVE_INVERSE_SAWTOOTH => 1.0 - f,
        _ => {
            let at = f * NOISE_STEPS;
            let (a, b) = (noise_step(at as u32), noise_step(at as u32 + 1));
            a + (b - a) * (at - at.floor())
        }
    };
    w.base + w.amplitude * value
}

fn factor(f: BlendFactor) -> u32 {
    match f {
        // The frame buffer has no alpha: it reads as 1.
        BlendFactor::Zero | BlendFactor::OneMinusDstAlpha | BlendFactor::SrcAlphaSaturate => BLEND_ZERO,
        BlendFactor::One | BlendFactor::DstAlpha => BLEND_ONE,
        BlendFactor::SrcColor => BLEND_SRC_COLOR,
        BlendFactor::OneMinusSrcColor => BLEND_ONE_MINUS_SRC_COLOR,
        BlendFactor::DstColor => BLEND_DST_COLOR,
        BlendFactor::OneMinusDstColor => BLEND_ONE_MINUS_DST_COLOR,
        BlendFactor::SrcAlpha => BLEND_SRC_ALPHA,
        BlendFactor::OneMinusSrcAlpha => BLEND_ONE_MINUS_SRC_ALPHA,
    }
}

/// A change of texture coordinates; `None` for those that nothing drives.
fn change(c: &Change) -> Option<TcMod> {
    Some(match c {
        Change::Scale(s) => TcMod {
            matrix: [s.x, 0.0, 0.0, s.y],
            ..TcMod::default()
        },
        Change::Transform { matrix, translate } => TcMod {
            matrix: matrix.to_cols_array(),
            offset: (*translate).into(),
            ..TcMod::default()
        },
        Change::Scroll(speed) => TcMod {
            kind: TC_SCROLL,
            rates: [rate(speed.x), rate(speed.y)],
            ..TcMod::default()
        },
        Change::Turbulence(w) => TcMod {
            kind: TC_TURBULENCE,
            wave: wave_record(w),
            ..TcMod::default()
        },
        Change::Stretch(w) => TcMod {
            kind: TC_STRETCH,
            wave: wave_record(w),
            ..TcMod::default()
        },
        Change::Rotate(degrees) => TcMod {
            kind: TC_ROTATE,
            rates: [rate(-degrees / 360.0), 0],
            ..TcMod::default()
        },
        Change::EntityTranslate => return None,
    })
}

fn additive(blend: Blend) -> bool {
    matches!(blend.source, BlendFactor::One | BlendFactor::SrcAlpha) && blend.destination == BlendFactor::One
}

/// Whether light that the compiler baked into the colours multiplies the stage: it is lit.
fn is_lit(pass: &Pass) -> bool {
    let baked = matches!(
        pass.rgb_gen_or_default(),
        RgbGen::Vertex | RgbGen::ExactVertex | RgbGen::LightingDiffuse
    );
    pass.is_lightmap() || (baked && !pass.effective_blend().is_some_and(additive))
}

impl Program {
    /// The program of a definition. `emits`: its glow is the material's emission.
    pub fn compile(shader: &Shader, emits: bool, requests: &mut TextureRequests) -> Self {
        let mut out = Self::default();
        let drawn = || {
            shader
                .drawn_stages()
                .filter(|p| !matches!(p.texture, Some(StageTexture::VideoMap(_))))
        };
        for pass in drawn() {
            let stage = out.stage(pass, requests);
            out.stages.push(stage);
        }
        let first_blend = drawn().next().and_then(Pass::effective_blend);
        out.layer = first_blend.is_some();
        if out.layer {
            out.filters = drawn().any(|p| p.effective_blend().is_none_or(|b| !additive(b)));
        }
        if emits {
            out.mark_emission(drawn().map(|p| p.effective_blend().is_some_and(additive)));
        }
        let moves = |s: &Stage, mods: &[TcMod]| {
            s.frames > 1
                || s.rgb_source == SOURCE_WAVE
                || s.alpha_source == SOURCE_WAVE
                || mods.iter().any(|m| m.kind != TC_AFFINE)
        };
        for s in &out.stages {
            let mods = &out.mods[s.first_mod as usize..(s.first_mod + s.mod_count) as usize];
            out.animated |= moves(s, mods);
            out.moving_emission |= s.flags & STAGE_EMISSION != 0 && (moves(s, mods) || s.mod_count > 0);
        }
        out.glossy = out.stages.iter().any(|s| s.flags & STAGE_GLOSSY != 0);
        let tested = drawn().position(|p| p.alpha_func.is_some());
        out.alpha_stage = tested.map(|i| i as u32).filter(|&i| !is_bare(&out.stages[i as usize]));
        out.plain = out.plain_texture();
        out
    }

    fn stage(&mut self, pass: &Pass, requests: &mut TextureRequests) -> Stage {
        let images = pass.texture.as_ref().map(StageTexture::images).unwrap_or_default();
        let mut textures = [WHITE; STAGE_TEXTURES];
        for (slot, image) in textures.iter_mut().zip(images) {
            if let Image::File(name) = image {
                *slot = requests.request(name);
            }
        }
        let frames = images.len().clamp(1, STAGE_TEXTURES) as u32;
        let lit = is_lit(pass);
        let blend = pass.effective_blend().unwrap_or(Blend::REPLACE);
        let (rgb_source, rgb, rgb_wave) = match pass.rgb_gen_or_default() {
            RgbGen::Wave(w) => (SOURCE_WAVE, Vec3::ONE, wave_record(&w)),
            RgbGen::Const(c) => (SOURCE_CONSTANT, c.clamp(Vec3::ZERO, Vec3::ONE), Wave::default()),
            RgbGen::Vertex | RgbGen::ExactVertex if !lit => (SOURCE_VERTEX, Vec3::ONE, Wave::default()),
            RgbGen::OneMinusVertex => (SOURCE_ONE_MINUS_VERTEX, Vec3::ONE, Wave::default()),
            // What the map places has no colour of its own.
            RgbGen::OneMinusEntity => (SOURCE_CONSTANT, Vec3::ZERO, Wave::default()),
            _ => (SOURCE_CONSTANT, Vec3::ONE, Wave::default()),
        };
        let (alpha_source, alpha, alpha_wave) = match pass.alpha_gen_or_default() {
            AlphaGen::Wave(w) => (SOURCE_WAVE, 1.0, wave_record(&w)),
            AlphaGen::Const(a) => (SOURCE_CONSTANT, a.clamp(0.0, 1.0), Wave::default()),
            AlphaGen::Vertex => (SOURCE_VERTEX, 1.0, Wave::default()),
            AlphaGen::OneMinusVertex => (SOURCE_ONE_MINUS_VERTEX, 1.0, Wave::default()),
            AlphaGen::OneMinusEntity => (SOURCE_CONSTANT, 0.0, Wave::default()),
            AlphaGen::LightingSpecular => (SOURCE_SPECULAR, 1.0, Wave::default()),
            AlphaGen::Portal(range) => (SOURCE_PORTAL, range.max(1.0), Wave::default()),
            AlphaGen::Identity | AlphaGen::Entity => (SOURCE_CONSTANT, 1.0, Wave::default()),
        };
        let (tc_gen, tc_vectors) = match pass.tc_gen_or_default() {
            TcGen::Texture => (TC_TEXTURE, [[0.0; 3]; 2]),
            TcGen::Lightmap => (TC_LIGHTMAP, [[0.0; 3]; 2]),
            TcGen::Environment => (TC_ENVIRONMENT, [[0.0; 3]; 2]),
            TcGen::Vector(s, t) => (TC_VECTOR, [s.into(), t.into()]),
        };
        let first_mod = self.mods.len() as u32;
        self.mods.extend(pass.tc_mods.iter().filter_map(change));
        let frame_rate = match &pass.texture {
            Some(StageTexture::AnimMap { frequency, .. }) => rate(frequency / frames as f32),
            _ => 0,
        };
        let clamps = matches!(pass.texture, Some(StageTexture::ClampMap(_)));
        let white = textures[..frames as usize].iter().all(|&t| t == WHITE);
        let flag = |on: bool, bit: u32| if on { bit } else { 0 };
        Stage {
            textures,
            frames,
            frame_rate,
            flags: flag(lit, STAGE_LIT)
                | flag(clamps, STAGE_CLAMP)
                | flag(white, STAGE_WHITE)
                | flag(tc_gen == TC_ENVIRONMENT && !white, STAGE_GLOSSY),
            source: factor(blend.source),
            destination: factor(blend.destination),
            rgb_source,
            alpha_source,
            tc_gen,
            rgb: rgb.into(),
            alpha,
            rgb_wave,
            alpha_wave,
            tc_vectors,
            first_mod,
            mod_count: self.mods.len() as u32 - first_mod,
        }
    }

    /// Marks what shines by itself: the stages that add light, or else an opaque first one that no light multiplies.
    fn mark_emission(&mut self, adds: impl Iterator<Item = bool>) {
        let shines = |s: &Stage| s.flags & (STAGE_LIT | STAGE_WHITE) == 0 && s.tc_gen == TC_TEXTURE;
        let mut any = false;
        for (stage, adds) in self.stages.iter_mut().zip(adds) {
            if adds && shines(stage) {
                stage.flags |= STAGE_EMISSION;
                any = true;
            }
        }
        let lit = self.stages.iter().any(|s| s.flags & STAGE_LIT != 0);
        if !any
            && !lit
            && let Some(first) = self.stages.first_mut().filter(|s| shines(s))
        {
            first.flags |= STAGE_EMISSION;
        }
    }

    /// The one texture of a surface that is that texture under light and nothing else.
    fn plain_texture(&self) -> Option<(u32, bool)> {
        let is_light = |s: &Stage| s.flags & STAGE_LIT != 0 && s.flags & STAGE_WHITE != 0;
        let filters = |s: &Stage| {
            (s.source, s.destination) == (BLEND_DST_COLOR, BLEND_ZERO)
                || (s.source, s.destination) == (BLEND_ZERO, BLEND_SRC_COLOR)
        };
        let replaces = |s: &Stage| (s.source, s.destination) == (BLEND_ONE, BLEND_ZERO);
        let shown = match &self.stages[..] {
            [only] if only.flags & STAGE_LIT != 0 && replaces(only) => only,
            [image, light] if replaces(image) && is_light(light) && filters(light) => image,
            [light, image] if is_light(light) && replaces(light) && filters(image) => image,
            _ => return None,
        };
        let as_is = shows_as_is(shown) && shown.rgb_source == SOURCE_CONSTANT && shown.rgb == [1.0; 3];
        (as_is && shown.flags & (STAGE_EMISSION | STAGE_WHITE) == 0)
            .then_some((shown.textures[0], shown.flags & STAGE_CLAMP != 0))
    }

    /// Stages that the material's emission stands for.
    pub fn emission_stages(&self) -> impl Iterator<Item = &Stage> {
        self.stages.iter().filter(|s| s.flags & STAGE_EMISSION != 0)
    }

    /// Mean over place and time of what the emission stages show, linear.
    pub fn mean_emission(&self, textures: &[Texture]) -> Vec3 {
        self.emission_stages().map(|s| mean_shown(s, textures)).sum()
    }

    /// Mean over place and time of what all stages leave over a background, linear.
    pub fn mean_picture(&self, textures: &[Texture], background: Vec3) -> Vec3 {
        let mut blending = Blending::default();
        for s in &self.stages {
            blending.stage(s, mean_colour(s, textures));
        }
        let shade = blending.shade();
        shade.albedo + shade.glow / UNLIT + shade.through * background
    }
}

/// The stage has its texture where the surface has it, at all times.
fn shows_as_is(s: &Stage) -> bool {
    s.mod_count == 0 && s.tc_gen == TC_TEXTURE && s.frames == 1
}

/// The same, and its alpha is the texture's.
fn is_bare(s: &Stage) -> bool {
    shows_as_is(s) && s.alpha_source == SOURCE_CONSTANT && s.alpha == 1.0
}

fn mean_over_wave(w: &Wave, f: impl Fn(f32) -> f32) -> f32 {
    let sum: f32 = (0..MEAN_PHASES)
        .map(|i| f(wave_at(w, i as f32 / MEAN_PHASES as f32).clamp(0.0, 1.0)))
        .sum();
    sum / MEAN_PHASES as f32
}

/// Mean encoded colour and alpha of a stage.
fn mean_colour(s: &Stage, textures: &[Texture]) -> Vec4 {
    let images = &s.textures[..s.frames as usize];
    let texel: Vec4 = images
        .iter()
        .map(|&t| {
            let t = &textures[t as usize];
            let last = t.levels.last().and_then(|l| l.first()).copied().unwrap_or([255; 4]);
            Vec3::from(t.mean_encoded).extend(f32::from(last[3]) / 255.0)
        })
        .sum::<Vec4>()
        / images.len() as f32;
    let rgb = match s.rgb_source {
        SOURCE_WAVE => Vec3::splat(mean_over_wave(&s.rgb_wave, |x| x)),
        _ => Vec3::from(s.rgb),
    };
    let alpha = match s.alpha_source {
        SOURCE_WAVE => mean_over_wave(&s.alpha_wave, |x| x),
        SOURCE_CONSTANT => s.alpha,
        _ => 1.0,
    };
    texel * rgb.extend(alpha)
}

/// Mean decoded colour of a stage, with alpha where its blending counts it.
fn mean_shown(s: &Stage, textures: &[Texture]) -> Vec3 {
    let images = &s.textures[..s.frames as usize];
    let texel: Vec3 = images
        .iter()
        .map(|&t| Vec3::from(textures[t as usize].mean_linear))
        .sum();
    let rgb = match s.rgb_source {
        SOURCE_WAVE => Vec3::splat(mean_over_wave(&s.rgb_wave, decode_srgb)),
        _ => Vec3::from(s.rgb).map(decode_srgb),
    };
    let alpha = if s.source == BLEND_SRC_ALPHA {
        mean_colour(s, textures).w
    } else {
        1.0
    };
    texel / images.len() as f32 * rgb * alpha
}

#[cfg(test)]
mod tests {
    use super::super::blending::Shade;
    use super::*;
    use crate::assets::shader_script::ShaderLibrary;
    use glam::Vec4Swizzles;

    fn program(stages: &str) -> Program {
        let text = format!("s\n{{\n{stages}\n}}\n");
        let library = ShaderLibrary::from_files(vec![("scripts/s.shader".to_owned(), text)]);
        Program::compile(library.get("s").unwrap(), false, &mut TextureRequests::default())
    }

    fn shade(program: &Program, colours: &[Vec4]) -> Shade {
        let mut b = Blending::default();
        for (s, c) in program.stages.iter().zip(colours) {
            b.stage(s, *c);
        }
        b.shade()
    }

    const RED: Vec4 = Vec4::new(1.0, 0.0, 0.0, 0.5);
    const GREY: Vec4 = Vec4::new(0.5, 0.5, 0.5, 1.0);

    #[test]
    fn a_lightmapped_texture_is_plain_in_either_order() {
        let a = program("{ map a.tga } { map $lightmap \n blendFunc filter }");
        let b = program("{ map $lightmap } { map a.tga \n blendFunc GL_DST_COLOR GL_ZERO }");
        let vertex = program("{ map a.tga \n rgbGen vertex }");
        assert!(a.plain.is_some() && b.plain.is_some() && vertex.plain.is_some());
        assert!(
            program("{ map a.tga \n tcMod scroll 1 0 } { map $lightmap \n blendFunc filter }")
                .plain
                .is_none()
        );
        let lit = shade(&b, &[Vec4::ONE, GREY]);
        assert!((lit.albedo - Vec3::splat(decode_srgb(0.5))).length() < 1e-6);
        assert_eq!((lit.glow, lit.through), (Vec3::ZERO, Vec3::ZERO));
    }

    #[test]
    fn what_no_light_multiplies_glows() {
        let p = program("{ map a.tga } { map $lightmap \n blendFunc filter } { map g.tga \n blendFunc add }");
        let s = shade(&p, &[GREY, Vec4::ONE, RED]);
        assert!((s.albedo - Vec3::splat(decode_srgb(0.5))).length() < 1e-6);
        assert!((s.glow - Vec3::X * UNLIT).length() < 1e-6);
        let unlit = shade(&program("{ map a.tga }"), &[RED]);
        assert_eq!(unlit.albedo, Vec3::ZERO);
        assert!((unlit.glow - Vec3::X * UNLIT).length() < 1e-6);
    }

    #[test]
    fn layers_keep_their_share_of_the_background() {
        let alpha = shade(&program("{ map a.tga \n blendFunc blend }"), &[RED]);
        assert!((alpha.through - Vec3::splat(0.5)).length() < 1e-6);
        assert!((alpha.glow - Vec3::X * 0.5 * UNLIT).length() < 1e-6);
        let add = program("{ map a.tga \n blendFunc add }");
        assert!(add.layer && !add.filters);
        assert_eq!(shade(&add, &[RED]).through, Vec3::ONE);
        let filter = program("{ map a.tga \n blendFunc filter }");
        assert!(filter.layer && filter.filters);
        let s = shade(&filter, &[GREY]);
        assert!((s.through - Vec3::splat(decode_srgb(0.5))).length() < 1e-6);
        assert_eq!((s.albedo, s.glow), (Vec3::ZERO, Vec3::ZERO));
    }

    #[test]
    fn every_pair_of_factors_is_the_frame_buffers_arithmetic() {
        let sources = [
            "GL_ZERO",
            "GL_ONE",
            "GL_DST_COLOR",
            "GL_ONE_MINUS_DST_COLOR",
            "GL_SRC_ALPHA",
            "GL_ONE_MINUS_SRC_ALPHA",
        ];
        let destinations = [
            "GL_ZERO",
            "GL_ONE",
            "GL_SRC_COLOR",
            "GL_ONE_MINUS_SRC_COLOR",
            "GL_SRC_ALPHA",
            "GL_ONE_MINUS_SRC_ALPHA",
        ];
        let (base, top) = (Vec4::new(0.3, 0.5, 0.7, 1.0), Vec4::new(0.2, 0.4, 0.1, 0.3));
        for (i, s) in sources.iter().enumerate() {
            for (j, d) in destinations.iter().enumerate() {
                let p = program(&format!("{{ map a.tga }} {{ map b.tga \n blendFunc {s} {d} }}"));
                let got = shade(&p, &[base, top]).glow / UNLIT;
                let (x, y) = (base.xyz(), top.xyz());
                let all = [
                    Vec3::ZERO,
                    Vec3::ONE,
                    x,
                    Vec3::ONE - x,
                    Vec3::splat(top.w),
                    Vec3::splat(1.0 - top.w),
                ];
                let mut kept = all;
                (kept[2], kept[3]) = (y, Vec3::ONE - y);
                let want = (y * all[i] + x * kept[j]).clamp(Vec3::ZERO, Vec3::ONE).map(decode_srgb);
                assert!((got - want).length() < 1e-5, "{s} {d}: {got} is not {want}");
            }
        }
    }

    #[test]
    fn waves_have_their_shapes() {
        let w = |function| Wave {
            function,
            base: 0.5,
            amplitude: 0.5,
            ..Wave::default()
        };
        assert!((wave_at(&w(WAVE_SINE), 0.25) - 1.0).abs() < 1e-6);
        assert_eq!(wave_at(&w(WAVE_TRIANGLE), 0.75), 0.0);
        assert_eq!(wave_at(&w(WAVE_SQUARE), 0.6), 0.0);
        assert_eq!(wave_at(&w(WAVE_SAWTOOTH), 0.25), 0.625);
        assert_eq!(wave_at(&w(WAVE_INVERSE_SAWTOOTH), 0.25), 0.875);
        let noise: Vec<f32> = (0..1000).map(|i| wave_at(&w(WAVE_NOISE), i as f32 / 1000.0)).collect();
        assert!(noise.iter().all(|x| (0.0..=1.0).contains(x)) && noise.iter().any(|x| *x > 0.8));
    }
}
