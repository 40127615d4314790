//! Reads what is between the braces of a definition.

use super::compiler::Directive;
use super::definition::{Cull, FogParms, Shader, Sort};
use super::deform::Deform;
use super::number::leading_number;
use super::parse_compiler::{is_compiler_directive, parse_compiler_directive};
use super::parse_stage::parse_stage;
use super::prescan::Span;
use super::reader::Reader;
use super::sky::SkyParms;
use super::surface_parm::SurfaceParm;
use super::token::Token;
use super::warning::Warning;
use glam::Vec3;
use std::sync::Arc;

/// Reads one definition. Faults are in the warnings; what is right beside them is kept.
pub(super) fn parse_definition(file: &Arc<str>, span: &Span<'_>) -> (Shader, Vec<Warning>) {
    let mut reader = Reader::new(file, span);
    let mut shader = Shader::empty(span.name, file, span.line);
    while let Some(token) = reader.keyword() {
        if token.text.starts_with('}') {
            reader.reject("a stray closing brace ends the definition");
            break;
        }
        if token.text.starts_with('{') {
            let stage = parse_stage(&mut reader);
            if shader.stages.len() == Shader::MAX_STAGES {
                reader.reject(format!("more than {} stages", Shader::MAX_STAGES));
            }
            shader.stages.push(stage);
        } else {
            parse_directive(&mut reader, &mut shader, &token);
        }
    }
    shader.rejected = reader.rejected;
    (shader, reader.warnings)
}

fn parse_directive(reader: &mut Reader<'_>, shader: &mut Shader, token: &Token<'_>) {
    let name = token.text.to_ascii_lowercase();
    if is_compiler_directive(&name) {
        return parse_compiler_directive(reader, &mut shader.compiler, token, &name);
    }
    match name.as_str() {
        "surfaceparm" => parse_surface_parm(reader, shader),
        "cull" => parse_cull(reader, shader),
        "sort" => shader.sort = parse_sort(reader).or(shader.sort),
        "portal" => {
            shader.portal = true;
            shader.sort = Some(Sort::PORTAL);
        }
        "polygonoffset" => shader.polygon_offset = true,
        "nomipmaps" => {
            shader.no_mip_maps = true;
            shader.no_pic_mip = true;
        }
        "nopicmip" => shader.no_pic_mip = true,
        "entitymergable" => shader.entity_mergable = true,
        "deformvertexes" => parse_deform_line(reader, shader),
        "skyparms" => shader.sky = parse_sky(reader).or(shader.sky.take()),
        "fogparms" => parse_fog(reader, shader),
        "tesssize" => {
            shader.tess_size = reader.number("tessSize");
            reader.rest_of_line();
        }
        "light" => shader.light = reader.number("light"),
        "rt_ior" => shader.ior = reader.number("rt_ior"),
        "rt_pane" => shader.pane = true,
        "rt_roughness" => shader.roughness = reader.number("rt_roughness"),
        "clamptime" => shader.clamp_time = reader.number("clampTime"),
        _ if name.starts_with("qer") => parse_editor_directive(reader, shader, token, &name),
        _ => reader.reject_unknown("general", token),
    }
}

fn parse_surface_parm(reader: &mut Reader<'_>, shader: &mut Shader) {
    let Some(name) = reader.required("surfaceparm") else {
        return;
    };
    match SurfaceParm::from_name(name) {
        Some(parm) => shader.surface_parms.insert(parm),
        None => {
            shader.surface_parms.unknown.push(name.to_owned());
            reader.warn(format!("surfaceparm: unknown {name:?}"));
        }
    }
}

fn parse_cull(reader: &mut Reader<'_>, shader: &mut Shader) {
    let Some(name) = reader.required("cull") else { return };
    match name.to_ascii_lowercase().as_str() {
        // The game warns of `front` and leaves the cull mode, which is that one unless set before.
        "front" => {}
        "back" | "backside" | "backsided" => shader.cull = Cull::BackSided,
        "none" | "twosided" | "disable" => shader.cull = Cull::TwoSided,
        _ => reader.warn(format!("cull: unknown side {name:?}")),
    }
}

fn parse_sort(reader: &mut Reader<'_>) -> Option<Sort> {
    let name = reader.required("sort")?;
    if let Some(sort) = Sort::from_name(name) {
        return Some(sort);
    }
    let (value, whole) = leading_number(name);
    if !whole {
        reader.warn(format!("sort: unknown {name:?}"));
    }
    Some(Sort(value))
}

fn parse_sky(reader: &mut Reader<'_>) -> Option<SkyParms> {
    let boxed = |name: &str| {
        let none = name == "-" || name.eq_ignore_ascii_case("full");
        (!none).then(|| name.to_owned())
    };
    let outer_box = boxed(reader.required("skyparms")?);
    let mut sky = SkyParms {
        outer_box,
        cloud_height: SkyParms::DEFAULT_CLOUD_HEIGHT,
        inner_box: None,
    };
    if let Some(height) = reader.required("skyparms cloud height") {
        let (value, whole) = leading_number(height);
        if !whole && height != "-" {
            reader.warn(format!(
                "skyparms cloud height: {height:?} is no number, read as {value}"
            ));
        }
        if value != 0.0 {
            sky.cloud_height = value;
        }
        sky.inner_box = reader.required("skyparms inner box").and_then(boxed);
    }
    Some(sky)
}

fn parse_fog(reader: &mut Reader<'_>, shader: &mut Shader) {
    match reader.vector("fogparms") {
        Some((color, strict)) => {
            // The game gives the whole definition up where the parentheses aren't as it wants them.
            reader.rejected |= !strict;
            let depth_for_opaque = reader.number("fogparms distance").unwrap_or_default();
            shader.fog = Some(FogParms {
                color,
                depth_for_opaque,
            });
        }
        None => reader.rejected = true,
    }
    // Old scripts go on with gradient directions, which the game skips too.
    reader.rest_of_line();
}

fn parse_deform_line(reader: &mut Reader<'_>, shader: &mut Shader) {
    if shader.deforms.len() == Shader::MAX_DEFORMS {
        reader.warn(format!("deformVertexes: only {} are used", Shader::MAX_DEFORMS));
        reader.rest_of_line();
    } else if let Some(deform) = parse_deform(reader) {
        shader.deforms.push(deform);
    }
}

fn parse_deform(reader: &mut Reader<'_>) -> Option<Deform> {
    let name = reader.required("deformVertexes")?.to_ascii_lowercase();
    Some(match name.as_str() {
        "wave" => {
            let divisor = reader.number("deformVertexes wave")?;
            if divisor == 0.0 {
                reader.warn("deformVertexes wave: division by zero");
            }
            // The game's replacement for a division by zero.
            let spread = if divisor == 0.0 {
                100.0
            } else {
                divisor.recip().clamp(f32::MIN, f32::MAX)
            };
            Deform::Wave {
                spread,
                wave: reader.wave("deformVertexes wave"),
            }
        }
        "normal" => {
            let [amplitude, frequency] = reader.numbers("deformVertexes normal")?;
            Deform::Normal { amplitude, frequency }
        }
        "bulge" => {
            let [width, height, speed] = reader.numbers("deformVertexes bulge")?;
            Deform::Bulge { width, height, speed }
        }
        "move" => {
            let direction = Vec3::from_array(reader.numbers("deformVertexes move")?);
            Deform::Move {
                direction,
                wave: reader.wave("deformVertexes move"),
            }
        }
        "autosprite" => Deform::Autosprite,
        "autosprite2" => Deform::Autosprite2,
        "projectionshadow" => Deform::ProjectionShadow,
        _ => match name.strip_prefix("text") {
            // Any other slot is slot 0 to the game.
            Some(slot) => Deform::Text(
                slot.bytes()
                    .next()
                    .filter(|b| (b'0'..=b'7').contains(b))
                    .map_or(0, |b| b - b'0'),
            ),
            None => {
                reader.warn(format!("deformVertexes: unknown {name:?}"));
                return None;
            }
        },
    })
}

fn parse_editor_directive(reader: &mut Reader<'_>, shader: &mut Shader, token: &Token<'_>, name: &str) {
    match name {
        "qer_editorimage" => shader.editor.image = reader.required("qer_editorimage").map(str::to_owned),
        "qer_trans" => shader.editor.trans = reader.number("qer_trans"),
        _ => {
            let args = reader.rest_of_line().into_iter().map(str::to_owned).collect();
            let name = token.text.to_owned();
            shader.editor.others.push(Directive {
                name,
                args,
                line: token.line,
            });
        }
    }
    reader.rest_of_line();
}

#[cfg(test)]
mod tests {
    use crate::assets::shader_script::{
        Cull, Deform, FogParms, Shader, SkyParms, Sort, SurfaceParm, Wave, WaveFunction, parse_file,
    };
    use glam::Vec3;

    /// A definition, with the number of warnings.
    fn read(body: &str) -> (Shader, usize) {
        let mut parsed = parse_file("f", &format!("s\n{{\n{body}\n}}"));
        (parsed.shaders.remove(0), parsed.warnings.len())
    }

    fn clean(body: &str) -> Shader {
        let (shader, warnings) = read(body);
        assert_eq!((warnings, shader.rejected), (0, false), "{body}");
        shader
    }

    #[test]
    fn sides() {
        for (name, cull) in [
            ("front", Cull::FrontSided),
            ("back", Cull::BackSided),
            ("backSide", Cull::BackSided),
            ("backsided", Cull::BackSided),
            ("none", Cull::TwoSided),
            ("DISABLE", Cull::TwoSided),
            ("twosided", Cull::TwoSided),
        ] {
            assert_eq!(clean(&format!("cull {name}")).cull, cull, "{name}");
        }
        assert_eq!(read("cull left").1, 1);
    }

    #[test]
    fn switches() {
        let shader = clean("polygonOffset\nnomipmaps entityMergable\nportal\ntessSize 64 x\nlight 1\nclampTime 3");
        assert!(shader.polygon_offset && shader.no_mip_maps && shader.no_pic_mip && shader.entity_mergable);
        assert!(shader.portal && shader.sort == Some(Sort::PORTAL));
        assert_eq!(
            (shader.tess_size, shader.light, shader.clamp_time),
            (Some(64.0), Some(1.0), Some(3.0))
        );
    }

    #[test]
    fn orders() {
        assert_eq!(clean("sort Additive").sort, Some(Sort::ADDITIVE));
        assert_eq!(clean("sort 12").sort, Some(Sort(12.0)));
        assert_eq!(
            read("sort soon"),
            (
                Shader {
                    sort: Some(Sort(0.0)),
                    ..clean("")
                },
                1
            )
        );
    }

    #[test]
    fn skies() {
        let sky = |outer: Option<&str>, cloud_height, inner: Option<&str>| SkyParms {
            outer_box: outer.map(str::to_owned),
            cloud_height,
            inner_box: inner.map(str::to_owned),
        };
        assert_eq!(
            clean("skyParms env/a 700 env/b").sky,
            Some(sky(Some("env/a"), 700.0, Some("env/b")))
        );
        assert_eq!(clean("skyparms - - -").sky, Some(sky(None, 512.0, None)));
        assert_eq!(clean("skyparms full 0 -").sky, Some(sky(None, 512.0, None)));
        let (short, warnings) = read("skyparms env/a");
        assert_eq!((short.sky, warnings), (Some(sky(Some("env/a"), 512.0, None)), 1));
    }

    #[test]
    fn fogs() {
        let fog = Some(FogParms {
            color: Vec3::new(0.5, 0.25, 1.0),
            depth_for_opaque: 300.0,
        });
        assert_eq!(clean("fogparms ( .5 .25 1 ) 300 old gradient").fog, fog);
        for body in ["fogparms (.5 .25 1) 300", "fogparms .5 .25 1 300"] {
            let (shader, warnings) = read(body);
            assert!(shader.fog == fog && shader.rejected && warnings == 1, "{body}");
        }
    }

    #[test]
    fn deformations() {
        let wave = Wave {
            function: WaveFunction::Noise,
            base: 1.0,
            amplitude: 2.0,
            phase: 3.0,
            frequency: 4.0,
        };
        let one = |body: &str| clean(&format!("deformVertexes {body}")).deforms[0];
        assert_eq!(one("wave 50 noise 1 2 3 4"), Deform::Wave { spread: 0.02, wave });
        assert_eq!(
            one("move 1 0 0 noise 1 2 3 4"),
            Deform::Move {
                direction: Vec3::X,
                wave
            }
        );
        assert_eq!(
            one("normal .1 2"),
            Deform::Normal {
                amplitude: 0.1,
                frequency: 2.0
            }
        );
        assert_eq!(
            one("bulge 3 10 1"),
            Deform::Bulge {
                width: 3.0,
                height: 10.0,
                speed: 1.0
            }
        );
        assert_eq!(one("AutoSprite2"), Deform::Autosprite2);
        assert_eq!((one("text7"), one("text9")), (Deform::Text(7), Deform::Text(0)));
        let (zero, warnings) = read("deformVertexes wave 0 noise 1 2 3 4");
        assert_eq!((zero.deforms[0], warnings), (Deform::Wave { spread: 100.0, wave }, 1));
        assert_eq!(read(&"deformVertexes autosprite\n".repeat(4)).0.deforms.len(), 3);
    }

    #[test]
    fn surface_parameters_and_editor_directives() {
        let (shader, warnings) =
            read("surfaceparm SKY\nsurfaceparm jelly\nqer_editorimage a.tga x\nQER_trans .5\nqer_x 1 2");
        assert!(shader.is_sky() && shader.surface_parms.contains(SurfaceParm::Sky) && warnings == 1);
        assert_eq!(shader.surface_parms.unknown, ["jelly"]);
        assert_eq!(
            (shader.editor.image.as_deref(), shader.editor.trans),
            (Some("a.tga"), Some(0.5))
        );
        assert_eq!(shader.editor.others[0].args, ["1", "2"]);
        assert!(!shader.rejected);
    }

    #[test]
    fn nine_stages_are_too_many_for_the_game() {
        let (shader, warnings) = read(&"{ map a }\n".repeat(9));
        assert_eq!((shader.stages.len(), shader.rejected, warnings), (9, true, 1));
    }

    #[test]
    fn faults_name_their_place() {
        let parsed = parse_file("scripts/x.shader", "s\n{\n\n  bogus\n}");
        assert_eq!(
            parsed.warnings[0].to_string(),
            "scripts/x.shader:4: shader \"s\": unknown general directive \"bogus\""
        );
        assert!(parsed.shaders[0].rejected);
    }

    #[test]
    fn a_lone_carriage_return_breaks_a_line() {
        let shader = clean("qer_editorimage a.tga\r\tnopicmip\r{\r map b\r}");
        assert!(shader.no_pic_mip && shader.stages.len() == 1);
    }

    #[test]
    fn braces_on_a_directives_line_keep_the_structure() {
        let (shader, warnings) = read("{\nmap a\ntcMod rotate 1 }\n{ map b }");
        assert_eq!((shader.stages.len(), shader.rejected, warnings), (2, true, 1));
    }
}
