//! Reads the directives of the map compiler.

use super::compiler::{Backsplash, CompilerParms, Directive, ImplicitImage, ImplicitKind, SkyLight, Sun};
use super::reader::Reader;
use super::surface_parm::SurfaceParm;
use super::token::Token;
use glam::Vec3;

/// Whether a directive, in lower case, is for the map compiler.
pub(super) fn is_compiler_directive(name: &str) -> bool {
    name.starts_with("q3map") || matches!(name, "sun" | "implicitmap" | "implicitmask" | "implicitblend")
}

/// Reads a directive of which `token` is the first word and `name` the same in lower case.
pub(super) fn parse_compiler_directive(
    reader: &mut Reader<'_>,
    parms: &mut CompilerParms,
    token: &Token<'_>,
    name: &str,
) {
    if !name.starts_with("q3map") {
        reader.reject(format!("{name}: known to q3map2 but not to ioquake3"));
    }
    if reader.is_behind_directive() {
        reader.warn(format!(
            "{name}: not at the start of its line, where the map compiler never sees it"
        ));
        let directive = generic(reader, token);
        return parms.unread.push(directive);
    }
    match name {
        "q3map_surfacelight" => set(&mut parms.surface_light, reader.number(name)),
        "q3map_lightimage" => set(&mut parms.light_image, text(reader, name)),
        "q3map_lightrgb" => set(&mut parms.light_rgb, reader.numbers(name).map(Vec3::from_array)),
        "q3map_lightsubdivide" => set(&mut parms.light_subdivide, reader.number(name)),
        "q3map_backsplash" => {
            let read = reader.numbers(name);
            set(
                &mut parms.backsplash,
                read.map(|[percent, distance]| Backsplash { percent, distance }),
            );
        }
        "q3map_skylight" => set(&mut parms.sky_light, reader.numbers(name).map(sky_light)),
        "sun" | "q3map_sun" | "q3map_sunext" => parms.suns.extend(parse_sun(reader, name)),
        "q3map_bounce" | "q3map_bouncescale" => set(&mut parms.bounce_scale, reader.number(name)),
        "q3map_lightstyle" => {
            let style = reader.number(name).map(|style| whole(style.clamp(0.0, 254.0)));
            set(&mut parms.light_style, style);
        }
        "q3map_lightmapsamplesize" => set(&mut parms.lightmap_sample_size, reader.number(name)),
        "q3map_lightmapbrightness" | "q3map_lightmapgamma" => set(&mut parms.lightmap_brightness, reader.number(name)),
        "q3map_lightmapfilterradius" => {
            set(
                &mut parms.lightmap_filter_radius,
                reader.numbers(name).map(|[own, emitted]| (own, emitted)),
            );
        }
        "q3map_vertexscale" => set(&mut parms.vertex_scale, reader.number(name)),
        "q3map_novertexlight" => parms.no_vertex_light = true,
        "q3map_forcesunlight" => parms.force_sunlight = true,
        "q3map_globaltexture" => parms.global_texture = true,
        "q3map_nonplanar" => parms.non_planar = true,
        "q3map_shadeangle" => set(&mut parms.shade_angle_degrees, reader.number(name)),
        "q3map_nofog" => parms.no_fog = true,
        "q3map_invert" => parms.invert = true,
        "q3map_offset" => set(&mut parms.offset, reader.number(name)),
        "q3map_baseshader" => set(&mut parms.base_shader, text(reader, name)),
        "q3map_flare" | "q3map_flareshader" => set(&mut parms.flare_shader, text(reader, name)),
        "q3map_backshader" => set(&mut parms.back_shader, text(reader, name)),
        "q3map_normalimage" => set(&mut parms.normal_image, text(reader, name)),
        "implicitmap" => parse_implicit(reader, parms, name, ImplicitKind::Opaque),
        "implicitmask" => parse_implicit(reader, parms, name, ImplicitKind::Masked),
        "implicitblend" => parse_implicit(reader, parms, name, ImplicitKind::Blended),
        _ => match name.strip_prefix("q3map_").and_then(SurfaceParm::from_name) {
            Some(parm) => parms.surface_parms.push(parm),
            None => {
                let directive = generic(reader, token);
                parms.others.push(directive);
            }
        },
    }
    // Both the game and the compiler skip what follows on the line.
    reader.rest_of_line();
}

/// Keeps an earlier value where the new one couldn't be read.
fn set<T>(field: &mut Option<T>, value: Option<T>) {
    if value.is_some() {
        *field = value;
    }
}

fn text(reader: &mut Reader<'_>, what: &str) -> Option<String> {
    reader.required(what).map(str::to_owned)
}

fn generic(reader: &mut Reader<'_>, token: &Token<'_>) -> Directive {
    Directive {
        name: token.text.to_owned(),
        args: reader.rest_of_line().into_iter().map(str::to_owned).collect(),
        line: token.line,
    }
}

/// Towards zero, and zero for anything negative.
fn whole(number: f32) -> u32 {
    number as u32
}

fn sky_light([intensity, iterations]: [f32; 2]) -> SkyLight {
    SkyLight {
        intensity: intensity.max(0.0),
        iterations: whole(iterations).max(2),
    }
}

fn parse_sun(reader: &mut Reader<'_>, name: &str) -> Option<Sun> {
    let [r, g, b, intensity, azimuth_degrees, elevation_degrees] = reader.numbers(name)?;
    let mut sun = Sun {
        color: Vec3::new(r, g, b),
        intensity,
        azimuth_degrees,
        elevation_degrees,
        deviance_degrees: 0.0,
        samples: 0,
    };
    if name == "q3map_sunext" && reader.arguments_left() > 0 {
        let [deviance, samples] = reader.numbers(name)?;
        sun.deviance_degrees = deviance;
        sun.samples = whole(samples);
    }
    Some(sun)
}

fn parse_implicit(reader: &mut Reader<'_>, parms: &mut CompilerParms, name: &str, kind: ImplicitKind) {
    if let Some(image) = text(reader, name) {
        let image = (image != "-").then_some(image);
        parms.implicit_image = Some(ImplicitImage { kind, image });
    }
}

#[cfg(test)]
mod tests {
    use crate::assets::shader_script::{
        Backsplash, CompilerParms, ImplicitImage, ImplicitKind, SkyLight, SurfaceParm, parse_file,
    };
    use glam::Vec3;

    fn read(body: &str) -> (CompilerParms, usize) {
        let mut parsed = parse_file("f", &format!("s\n{{\n{body}\n}}"));
        (parsed.shaders.remove(0).compiler, parsed.warnings.len())
    }

    fn clean(body: &str) -> CompilerParms {
        let (parms, warnings) = read(body);
        assert_eq!(warnings, 0, "{body}");
        parms
    }

    #[test]
    fn emission() {
        let parms = clean(
            "q3map_SurfaceLight 10\nq3map_surfacelight 250 rest\nq3map_lightimage a.tga\nq3map_lightRGB 1 .5 0\n\
             q3map_lightSubdivide 64\nq3map_backsplash 0 24\nq3map_skyLight -5 0",
        );
        assert_eq!(
            (parms.surface_light, parms.light_image.as_deref()),
            (Some(250.0), Some("a.tga"))
        );
        assert_eq!(
            (parms.light_rgb, parms.light_subdivide),
            (Some(Vec3::new(1.0, 0.5, 0.0)), Some(64.0))
        );
        assert_eq!(
            parms.backsplash,
            Some(Backsplash {
                percent: 0.0,
                distance: 24.0
            })
        );
        assert_eq!(
            parms.sky_light,
            Some(SkyLight {
                intensity: 0.0,
                iterations: 2
            })
        );
    }

    #[test]
    fn suns_add() {
        let suns =
            clean("q3map_sun 1 1 1 100 90 45\nq3map_sunExt 1 .5 0 50 10 20 3 16 x\nq3map_sunext 1 1 1 1 0 0").suns;
        let read: Vec<_> = suns
            .iter()
            .map(|s| {
                (
                    s.intensity,
                    s.azimuth_degrees,
                    s.elevation_degrees,
                    s.deviance_degrees,
                    s.samples,
                )
            })
            .collect();
        assert_eq!(
            read,
            [
                (100.0, 90.0, 45.0, 0.0, 0),
                (50.0, 10.0, 20.0, 3.0, 16),
                (1.0, 0.0, 0.0, 0.0, 0)
            ]
        );
        let (bare, warnings) = read_sun("sun 1 1 1 5 0 90");
        assert_eq!(
            (bare, warnings),
            (1, 1),
            "the compiler knows the bare word, the game doesn't"
        );
        assert_eq!(read_sun("q3map_sun 1 1 1 5 0"), (0, 1));
    }

    fn read_sun(body: &str) -> (usize, usize) {
        let (parms, warnings) = read(body);
        (parms.suns.len(), warnings)
    }

    #[test]
    fn lightmaps_and_switches() {
        let parms = clean(
            "q3map_bounce .5\nq3map_lightmapSampleSize 8\nq3map_lightmapGamma 2\nq3map_lightmapFilterRadius 0 8\n\
             q3map_vertexScale .5\nq3map_noVertexLight\nq3map_forceSunlight\nq3map_globalTexture\nq3map_baseShader b/c",
        );
        assert_eq!((parms.bounce_scale, parms.lightmap_sample_size), (Some(0.5), Some(8.0)));
        assert_eq!((parms.lightmap_brightness, parms.vertex_scale), (Some(2.0), Some(0.5)));
        assert_eq!(parms.lightmap_filter_radius, Some((0.0, 8.0)));
        assert!(parms.no_vertex_light && parms.force_sunlight && parms.global_texture);
        assert_eq!(parms.base_shader.as_deref(), Some("b/c"));
    }

    #[test]
    fn everything_else_is_kept() {
        let parms = clean("q3map_tcGen ivector ( 256 0 0 ) ( 0 256 0 )\nq3map_noLightmap\nq3map_Unheard");
        assert_eq!(parms.others[0].name, "q3map_tcGen");
        assert_eq!(parms.others[0].args.join(" "), "ivector ( 256 0 0 ) ( 0 256 0 )");
        assert_eq!(
            (parms.others[1].name.as_str(), parms.others[1].line),
            ("q3map_Unheard", 5)
        );
        assert_eq!(parms.surface_parms, [SurfaceParm::NoLightmap]);
    }

    #[test]
    fn the_compiler_reads_one_directive_a_line() {
        let (parms, warnings) = read("surfaceparm sky q3map_surfacelight 100");
        assert_eq!(
            (parms.surface_light, parms.unread[0].args[0].as_str(), warnings),
            (None, "100", 1)
        );
        assert_eq!(clean("{ map a } q3map_surfacelight 100").surface_light, Some(100.0));
    }

    #[test]
    fn implicit_images() {
        let image = |kind, image: Option<&str>| {
            Some(ImplicitImage {
                kind,
                image: image.map(str::to_owned),
            })
        };
        assert_eq!(
            read("implicitMap -").0.implicit_image,
            image(ImplicitKind::Opaque, None)
        );
        assert_eq!(
            read("implicitMask a.tga").0.implicit_image,
            image(ImplicitKind::Masked, Some("a.tga"))
        );
        assert_eq!(
            read("implicitBlend b").0.implicit_image,
            image(ImplicitKind::Blended, Some("b"))
        );
    }

    #[test]
    fn an_unreadable_value_leaves_the_earlier_one() {
        let (parms, warnings) = read("q3map_backsplash 5 23\nq3map_backsplash 1");
        assert_eq!((parms.backsplash.map(|b| b.percent), warnings), (Some(5.0), 1));
    }
}
