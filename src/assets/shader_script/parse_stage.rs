//! Reads what is between the braces of a stage.

use super::blend::{AlphaFunc, Blend, BlendFactor, DepthFunc};
use super::color::{AlphaGen, RgbGen};
use super::reader::Reader;
use super::stage::{Image, Stage, StageTexture};
use super::texcoord::{TcGen, TcMod};
use super::wave::{Wave, WaveFunction};
use glam::{Mat2, Vec2};

/// Distance over which `alphaGen portal` fades where the script gives none, in units.
const DEFAULT_PORTAL_RANGE: f32 = 256.0;

/// Reads a stage whose opening brace was the last token.
pub(super) fn parse_stage(reader: &mut Reader<'_>) -> Stage {
    let mut stage = Stage {
        line: reader.line(),
        ..Stage::default()
    };
    while let Some(token) = reader.keyword() {
        // The game looks at the first character only.
        if token.text.starts_with('}') {
            break;
        }
        match token.text.to_ascii_lowercase().as_str() {
            "map" => parse_map(reader, &mut stage, "map", StageTexture::Map),
            "clampmap" => parse_map(reader, &mut stage, "clampMap", StageTexture::ClampMap),
            "animmap" => parse_anim_map(reader, &mut stage),
            "videomap" => match reader.argument() {
                Some(name) => set_texture(reader, &mut stage, StageTexture::VideoMap(name.to_owned())),
                None => reader.reject("videoMap: missing parameter"),
            },
            "blendfunc" => stage.blend = parse_blend(reader).or(stage.blend),
            "rgbgen" => parse_rgb_gen(reader, &mut stage),
            "alphagen" => stage.alpha_gen = parse_alpha_gen(reader).or(stage.alpha_gen),
            "tcgen" | "texgen" => stage.tc_gen = parse_tc_gen(reader).or(stage.tc_gen),
            "tcmod" => parse_tc_mod_line(reader, &mut stage),
            "alphafunc" => match reader.argument().map(|name| (name, AlphaFunc::from_name(name))) {
                Some((_, Some(func))) => stage.alpha_func = Some(func),
                Some((name, None)) => {
                    // An unknown function also undoes an earlier one.
                    stage.alpha_func = None;
                    reader.warn(format!("alphaFunc: unknown function {name:?}"));
                }
                None => reader.reject("alphaFunc: missing parameter"),
            },
            "depthfunc" => match reader.argument().map(str::to_ascii_lowercase).as_deref() {
                Some("lequal") => stage.depth_func = DepthFunc::LessEqual,
                Some("equal") => stage.depth_func = DepthFunc::Equal,
                Some(name) => reader.warn(format!("depthFunc: unknown function {name:?}")),
                None => reader.reject("depthFunc: missing parameter"),
            },
            "depthwrite" => stage.depth_write = true,
            "detail" => stage.detail = true,
            "{" => {
                reader.reject("a brace opens inside a stage");
                reader.skip_block();
            }
            _ => reader.reject_unknown("stage", &token),
        }
    }
    if stage.texture.is_none() {
        reader.warn("stage without image");
    }
    stage
}

fn set_texture(reader: &mut Reader<'_>, stage: &mut Stage, texture: StageTexture) {
    if stage.texture.replace(texture).is_some() {
        reader.warn("a second image replaces the first of the stage");
    }
}

fn parse_map(reader: &mut Reader<'_>, stage: &mut Stage, what: &str, texture: fn(Image) -> StageTexture) {
    match reader.argument() {
        Some(name) => set_texture(reader, stage, texture(Image::from_name(name))),
        None => reader.reject(format!("{what}: missing parameter")),
    }
}

fn parse_anim_map(reader: &mut Reader<'_>, stage: &mut Stage) {
    if reader.arguments_left() < 2 {
        reader.rest_of_line();
        return reader.reject("animMap: needs a frequency and images");
    }
    let frequency = reader.number("animMap").unwrap_or_default();
    let mut images: Vec<Image> = reader
        .rest_of_line()
        .into_iter()
        .filter(|name| !name.is_empty())
        .map(Image::from_name)
        .collect();
    if images.len() > Stage::MAX_ANIMATIONS {
        reader.warn(format!(
            "animMap: only {} of {} images are used",
            Stage::MAX_ANIMATIONS,
            images.len()
        ));
        images.truncate(Stage::MAX_ANIMATIONS);
    }
    set_texture(reader, stage, StageTexture::AnimMap { frequency, images });
}

fn parse_blend(reader: &mut Reader<'_>) -> Option<Blend> {
    let first = reader.required("blendFunc")?;
    if let Some(blend) = Blend::from_name(first) {
        return Some(blend);
    }
    let second = reader.required("blendFunc")?;
    let mut factor = |name: &str, factor: Option<BlendFactor>| {
        factor.unwrap_or_else(|| {
            reader.warn(format!("blendFunc: unknown factor {name:?}, taken for GL_ONE"));
            BlendFactor::One
        })
    };
    Some(Blend {
        source: factor(first, BlendFactor::source(first)),
        destination: factor(second, BlendFactor::destination(second)),
    })
}

fn parse_rgb_gen(reader: &mut Reader<'_>, stage: &mut Stage) {
    let Some(name) = reader.required("rgbGen") else { return };
    stage.rgb_gen = Some(match name.to_ascii_lowercase().as_str() {
        "identity" => RgbGen::Identity,
        "identitylighting" => RgbGen::IdentityLighting,
        "entity" => RgbGen::Entity,
        "oneminusentity" => RgbGen::OneMinusEntity,
        "vertex" => {
            // In the game the vertex's alpha comes with its colour, unless alphaGen says otherwise.
            if matches!(stage.alpha_gen, None | Some(AlphaGen::Identity)) {
                stage.alpha_gen = Some(AlphaGen::Vertex);
            }
            RgbGen::Vertex
        }
        "exactvertex" => RgbGen::ExactVertex,
        "oneminusvertex" => RgbGen::OneMinusVertex,
        "lightingdiffuse" => RgbGen::LightingDiffuse,
        "wave" => RgbGen::Wave(reader.wave("rgbGen wave")),
        "const" => match reader.vector("rgbGen const") {
            Some((color, _)) => RgbGen::Const(color),
            None => return,
        },
        _ => return reader.warn(format!("rgbGen: unknown {name:?}")),
    });
}

fn parse_alpha_gen(reader: &mut Reader<'_>) -> Option<AlphaGen> {
    let name = reader.required("alphaGen")?;
    Some(match name.to_ascii_lowercase().as_str() {
        "identity" => AlphaGen::Identity,
        "entity" => AlphaGen::Entity,
        "oneminusentity" => AlphaGen::OneMinusEntity,
        "vertex" => AlphaGen::Vertex,
        "oneminusvertex" => AlphaGen::OneMinusVertex,
        "lightingspecular" => AlphaGen::LightingSpecular,
        "wave" => AlphaGen::Wave(reader.wave("alphaGen wave")),
        "const" => AlphaGen::Const(reader.number("alphaGen const")?),
        "portal" => AlphaGen::Portal(reader.number("alphaGen portal").unwrap_or(DEFAULT_PORTAL_RANGE)),
        _ => {
            reader.warn(format!("alphaGen: unknown {name:?}"));
            return None;
        }
    })
}

fn parse_tc_gen(reader: &mut Reader<'_>) -> Option<TcGen> {
    let name = reader.required("tcGen")?;
    Some(match name.to_ascii_lowercase().as_str() {
        "texture" | "base" => TcGen::Texture,
        "lightmap" => TcGen::Lightmap,
        "environment" => TcGen::Environment,
        "vector" => TcGen::Vector(reader.vector("tcGen vector")?.0, reader.vector("tcGen vector")?.0),
        _ => {
            reader.warn(format!("tcGen: unknown {name:?}"));
            return None;
        }
    })
}

fn parse_tc_mod_line(reader: &mut Reader<'_>, stage: &mut Stage) {
    if let Some(tc_mod) = parse_tc_mod(reader) {
        if stage.tc_mods.len() == Stage::MAX_TC_MODS {
            reader.reject(format!("tcMod: more than {} in a stage", Stage::MAX_TC_MODS));
        }
        stage.tc_mods.push(tc_mod);
    }
    // The game reads the whole line and takes what it needs.
    reader.rest_of_line();
}

/// As in the game, a tcMod with too few numbers does nothing.
fn parse_tc_mod(reader: &mut Reader<'_>) -> Option<TcMod> {
    let name = reader.required("tcMod")?;
    Some(match name.to_ascii_lowercase().as_str() {
        // A wave function's name in front, which some manuals show, is the base to the game: it reads as zero, and
        // the numbers after it shift by one.
        "turb" => {
            let [base, amplitude, phase, frequency] = reader.numbers("tcMod turb")?;
            TcMod::Turbulence(Wave {
                function: WaveFunction::Sine,
                base,
                amplitude,
                phase,
                frequency,
            })
        }
        "scale" => TcMod::Scale(Vec2::from_array(reader.numbers("tcMod scale")?)),
        "scroll" => TcMod::Scroll(Vec2::from_array(reader.numbers("tcMod scroll")?)),
        "stretch" if reader.arguments_left() < 5 => {
            reader.warn("tcMod stretch: needs a function and 4 numbers");
            return None;
        }
        "stretch" => TcMod::Stretch(reader.wave("tcMod stretch")),
        "transform" => {
            let [m00, m01, m10, m11, t0, t1] = reader.numbers("tcMod transform")?;
            TcMod::Transform {
                matrix: Mat2::from_cols_array(&[m00, m01, m10, m11]),
                translate: Vec2::new(t0, t1),
            }
        }
        "rotate" => TcMod::Rotate(reader.number("tcMod rotate")?),
        "entitytranslate" => TcMod::EntityTranslate,
        _ => {
            reader.warn(format!("tcMod: unknown {name:?}"));
            return None;
        }
    })
}

#[cfg(test)]
mod tests {
    use crate::assets::shader_script::{
        AlphaFunc, AlphaGen, Blend, BlendFactor, DepthFunc, Image, RgbGen, Shader, Stage, StageTexture, TcGen, TcMod,
        Wave, WaveFunction, parse_file,
    };
    use glam::{Vec2, Vec3};

    fn shader(stage: &str) -> (Shader, usize) {
        let mut parsed = parse_file("f", &format!("s\n{{\n{{\n{stage}\n}}\n}}"));
        (parsed.shaders.remove(0), parsed.warnings.len())
    }

    /// A stage without any fault.
    fn clean(stage: &str) -> Stage {
        let (mut shader, warnings) = shader(stage);
        assert_eq!(
            (warnings, shader.rejected, shader.stages.len()),
            (0, false, 1),
            "{stage}"
        );
        shader.stages.remove(0)
    }

    /// A stage with `warnings` faults, and whether the game drops the shader.
    fn faulty(stage: &str) -> (Stage, usize, bool) {
        let (mut shader, warnings) = shader(stage);
        (shader.stages.remove(0), warnings, shader.rejected)
    }

    #[test]
    fn textures() {
        let file = |name: &str| Image::File(name.into());
        assert_eq!(clean("MAP $LightMap").texture, Some(StageTexture::Map(Image::Lightmap)));
        assert_eq!(
            clean("clampmap \"a b.tga\"").texture,
            Some(StageTexture::ClampMap(file("a b.tga")))
        );
        assert_eq!(
            clean("videoMap x.roq").texture,
            Some(StageTexture::VideoMap("x.roq".into()))
        );
        let texture = StageTexture::AnimMap {
            frequency: 2.5,
            images: vec![file("a"), file("b")],
        };
        assert_eq!(clean("animMap 2.5 a b").texture, Some(texture));
        let (stage, warnings, _) = faulty("animMap 1 a b c d e f g h i");
        assert_eq!((stage.texture.unwrap().images().len(), warnings), (8, 1));
    }

    #[test]
    fn several_directives_may_share_a_line() {
        let stage = clean("map a blendfunc filter rgbGen identity alphaFunc ge128 depthFunc equal depthWrite detail");
        assert_eq!(stage.blend, Some(Blend::FILTER));
        assert_eq!(stage.rgb_gen, Some(RgbGen::Identity));
        assert_eq!(stage.alpha_func, Some(AlphaFunc::Ge128));
        assert_eq!(stage.depth_func, DepthFunc::Equal);
        assert!(stage.depth_write && stage.detail);
    }

    #[test]
    fn blend_factors() {
        let blend = |source, destination| Some(Blend { source, destination });
        assert_eq!(
            clean("map a\nblendFunc GL_DST_COLOR gl_src_alpha").blend,
            blend(BlendFactor::DstColor, BlendFactor::SrcAlpha)
        );
        let (stage, warnings, rejected) = faulty("map a\nblendFunc gl_one gl_dst_color");
        assert_eq!((stage.blend, warnings, rejected), (Some(Blend::ADD), 1, false));
        assert_eq!(faulty("map a\nblendFunc gl_one\n").0.blend, None);
    }

    #[test]
    fn colours() {
        let wave = Wave {
            function: WaveFunction::Square,
            base: 0.5,
            amplitude: 0.25,
            phase: 0.0,
            frequency: 2.0,
        };
        assert_eq!(
            clean("map a\nrgbGen wave square .5 .25 0 2").rgb_gen,
            Some(RgbGen::Wave(wave))
        );
        assert_eq!(
            clean("map a\nalphaGen wave square .5 .25 0 2").alpha_gen,
            Some(AlphaGen::Wave(wave))
        );
        let color = Vec3::new(1.0, 0.5, 0.0);
        assert_eq!(
            clean("map a\nrgbGen const ( 1 .5 0 )").rgb_gen,
            Some(RgbGen::Const(color))
        );
        assert_eq!(clean("map a\nalphaGen const .5").alpha_gen, Some(AlphaGen::Const(0.5)));
        assert_eq!(
            clean("map a\nalphaGen portal 512").alpha_gen,
            Some(AlphaGen::Portal(512.0))
        );
        assert_eq!(
            faulty("map a\nalphaGen portal").0.alpha_gen,
            Some(AlphaGen::Portal(256.0))
        );
        assert_eq!(faulty("map a\nrgbGen rainbow").1, 1);
    }

    #[test]
    fn vertex_colour_brings_its_alpha() {
        assert_eq!(clean("map a\nrgbGen vertex").alpha_gen, Some(AlphaGen::Vertex));
        assert_eq!(clean("map a\nrgbGen exactVertex").alpha_gen, None);
        assert_eq!(
            clean("map a\nalphaGen identity\nrgbGen vertex").alpha_gen,
            Some(AlphaGen::Vertex)
        );
        assert_eq!(
            clean("map a\nrgbGen vertex\nalphaGen identity").alpha_gen,
            Some(AlphaGen::Identity)
        );
        assert_eq!(
            clean("map a\nalphaGen const 1\nrgbGen vertex").alpha_gen,
            Some(AlphaGen::Const(1.0))
        );
    }

    #[test]
    fn texture_coordinates() {
        assert_eq!(clean("map a\ntexgen environment").tc_gen, Some(TcGen::Environment));
        assert_eq!(clean("map a\ntcGen base").tc_gen, Some(TcGen::Texture));
        assert_eq!(
            clean("map a\ntcGen vector ( 1 0 0 ) ( 0 2 0 )").tc_gen,
            Some(TcGen::Vector(Vec3::X, Vec3::new(0.0, 2.0, 0.0)))
        );
        let stage = clean("map a\ntcMod scroll 1 -.5 rest\ntcMod rotate 30\ntcMod entityTranslate\ntcMod scale 2 3");
        assert_eq!(
            stage.tc_mods,
            [
                TcMod::Scroll(Vec2::new(1.0, -0.5)),
                TcMod::Rotate(30.0),
                TcMod::EntityTranslate,
                TcMod::Scale(Vec2::new(2.0, 3.0))
            ]
        );
    }

    #[test]
    fn a_transform_has_the_games_layout() {
        let stage = clean("map a\ntcMod transform 1 2 3 4 5 6");
        let [TcMod::Transform { matrix, translate }] = stage.tc_mods[..] else {
            panic!("{stage:?}")
        };
        // s' = 10·1 + 100·3 + 5, t' = 10·2 + 100·4 + 6
        assert_eq!(matrix * Vec2::new(10.0, 100.0) + translate, Vec2::new(315.0, 426.0));
    }

    #[test]
    fn turbulence_is_read_as_the_game_reads_it() {
        let amplitude = |text: &str| match faulty(text).0.tc_mods[..] {
            [TcMod::Turbulence(wave)] => Some(wave.amplitude),
            _ => None,
        };
        assert_eq!(amplitude("map a\ntcMod turb 0 .1 0 2"), Some(0.1));
        assert_eq!(amplitude("map a\ntcMod turb sin 7 .1 0 2"), Some(7.0));
        assert_eq!(amplitude("map a\ntcMod turb .1 0 2"), None);
    }

    #[test]
    fn the_games_limits() {
        let five = "map a\n".to_owned() + &"tcMod rotate 1\n".repeat(5);
        let (stage, warnings, rejected) = faulty(&five);
        assert_eq!((stage.tc_mods.len(), warnings, rejected), (5, 1, true));
    }

    #[test]
    fn faults_that_drop_the_shader_in_the_game() {
        for text in [
            "map a\nnonsense 1 2",
            "map a\nmap",
            "map a\nalphaFunc",
            "map a rubbish",
            "map a\n{ x }",
        ] {
            let (stage, warnings, rejected) = faulty(text);
            assert!(
                rejected && warnings == 1 && stage.texture.is_some(),
                "{text}: {warnings}"
            );
        }
        let (_, warnings, rejected) = faulty("rgbGen identity");
        assert!(!rejected && warnings == 1, "a stage without image is dropped alone");
    }
}
