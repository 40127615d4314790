//! Materials: what a shader script (or a bare image) means to the tracer.
//!
//! One base image stands for the surface's albedo, with the script's alpha test; layered, animated and see-through stages
//! are described in `docs/limitations.md`.

use super::emission::{Emission, emission_colour, normalised_texture};
use super::records::{
    MATERIAL_ALPHA_TESTED, MATERIAL_CLAMP, MATERIAL_SKY, MATERIAL_SKY_BOX, MATERIAL_TWO_SIDED_EMISSION, Material, NONE,
};
use super::textures::{CHECKER, TextureRequests, WHITE};
use crate::assets::bsp::lumps::surface_flags;
use crate::assets::image::Texture;
use crate::assets::shader_script::{
    AlphaFunc, BlendFactor, Image, Shader, ShaderLibrary, Stage, StageTexture, Sun, TcGen,
};
use glam::Vec3;

/// Suffixes of a sky box's images in the order of [`Material::sky`].
const SKY_SIDES: [&str; 6] = ["rt", "lf", "bk", "ft", "up", "dn"];
/// Radiance of a sky that lights nothing, over its decoded image: what the game shows beside a surface lit by luxels of
/// 64, its display's unit.
const UNLIT_SKY: f32 = 64.0 / 255.0;

/// The compiler's `q3map_backsplash` where a script has none.
const BACKSPLASH: [f32; 2] = [5.0, 23.0];

/// The compiler's `q3map_lightSubdivide` where a script has none.
const LIGHT_SUBDIVIDE: f32 = 999.0;

/// Decoded means below this in any channel belong to night skies.
const DARK_SKY: f32 = 0.02;

/// Rec. 709 luminance.
fn luminance(c: Vec3) -> f32 {
    c.dot(Vec3::new(0.2126, 0.7152, 0.0722))
}

/// How rays meet a surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Visibility {
    /// Stops every ray.
    Opaque,
    /// Stops a ray where the alpha test passes.
    AlphaTested,
    /// Shows the sky: stops rays to finite lights, lets sun and sky light in.
    Sky,
    /// Blended over what is behind it: not traced.
    Blended,
    /// Never drawn (nodraw, fog volumes, flares).
    Invisible,
}

/// A material before its textures are loaded.
#[derive(Clone, Debug)]
pub struct MaterialSource {
    pub name: String,
    pub visibility: Visibility,
    /// The script has a definition for the name.
    pub scripted: bool,
    texture: u32,
    /// Image that shows where an emitter glows.
    glow: u32,
    clamp: bool,
    alpha_func: Option<AlphaFunc>,
    sky_box: Option<[u32; 6]>,
    pub two_sided: bool,
    pub autosprite: bool,
    emission: Option<EmissionSource>,
    pub suns: Vec<Sun>,
    /// `q3map_skylight`: intensity in byte units.
    pub sky_light: Option<f32>,
    /// `q3map_backsplash`: percent of the emitted light that the compiler throws back at the mounting, and from how far in
    /// front of it, units.
    pub backsplash: [f32; 2],
    /// `q3map_lightSubdivide`: greatest extent of one emitting piece, units.
    pub light_subdivide: f32,
    /// Images that give the emitted colour, the first that loads.
    colour_images: Vec<u32>,
    /// `q3map_lightRGB`.
    colour_rgb: Option<Vec3>,
    /// The emitted colour, largest component 1; white until [`Self::resolve`].
    colour: Vec3,
}

/// `q3map_surfacelight` of a material.
#[derive(Clone, Copy, Debug)]
struct EmissionSource {
    value: f32,
    /// The colour is given apart from what the surface shows.
    constant: bool,
}

fn image_texture(image: &Image, requests: &mut TextureRequests) -> u32 {
    match image {
        Image::File(name) => requests.request(name),
        _ => WHITE,
    }
}

fn stage_image(stage: &Stage) -> Option<&Image> {
    stage.texture.as_ref()?.images().first()
}

/// The stage that shows what the surface is made of: the first with ordinary coordinates that does not merely add light.
fn base_stage(shader: &Shader) -> Option<&Stage> {
    let shows = |stage: &&Stage| !stage.is_lightmap() && stage_image(stage).is_some();
    let flat = |stage: &&Stage| stage.tc_gen_or_default() != TcGen::Environment;
    let additive = |stage: &Stage| {
        stage
            .effective_blend()
            .is_some_and(|b| b.source == BlendFactor::One && b.destination == BlendFactor::One)
    };
    let stages = || shader.drawn_stages().filter(shows);
    stages()
        .find(|s| s.alpha_func.is_some())
        .or_else(|| stages().filter(flat).find(|s| !additive(s)))
        .or_else(|| stages().find(flat))
        .or_else(|| stages().next())
}

/// The image of the first stage that adds unlit light over the surface: where a lamp glows.
fn glow_image(shader: &Shader) -> Option<&Image> {
    let adds = |stage: &&Stage| {
        stage.effective_blend().is_some_and(|b| {
            matches!(b.source, BlendFactor::One | BlendFactor::SrcAlpha) && b.destination == BlendFactor::One
        })
    };
    shader
        .drawn_stages()
        .filter(adds)
        .filter(|s| s.tc_gen_or_default() == TcGen::Texture)
        .filter_map(stage_image)
        .find(|image| image.file().is_some())
}

impl MaterialSource {
    /// The material of a map's shader entry.
    pub fn new(name: &str, flags: i32, scripts: &ShaderLibrary, requests: &mut TextureRequests) -> Self {
        let script = scripts.get(name);
        let Some(shader) = script else {
            let hidden = flags & (surface_flags::NODRAW | surface_flags::SKIP | surface_flags::HINT) != 0;
            let sky = flags & surface_flags::SKY != 0;
            return Self {
                name: name.to_owned(),
                visibility: match (sky, hidden) {
                    (true, _) => Visibility::Sky,
                    (_, true) => Visibility::Invisible,
                    _ => Visibility::Opaque,
                },
                scripted: false,
                texture: if hidden || sky { WHITE } else { requests.request(name) },
                glow: WHITE,
                clamp: false,
                alpha_func: None,
                sky_box: None,
                two_sided: false,
                autosprite: false,
                emission: None,
                suns: Vec::new(),
                sky_light: None,
                backsplash: BACKSPLASH,
                light_subdivide: LIGHT_SUBDIVIDE,
                colour_images: Vec::new(),
                colour_rgb: None,
                colour: Vec3::ONE,
            };
        };
        let base = base_stage(shader);
        let glow = glow_image(shader);
        let colour_rgb = shader.compiler.light_rgb.filter(|c| *c != Vec3::ZERO);
        let sky_light = shader.compiler.sky_light.map(|s| s.intensity).filter(|&i| i > 0.0);
        let visibility = visibility(shader, flags);
        let texture = match (base.and_then(stage_image), visibility) {
            (Some(image), _) => image_texture(image, requests),
            (None, Visibility::Invisible | Visibility::Sky) => WHITE,
            (None, _) => CHECKER,
        };
        Self {
            name: name.to_owned(),
            visibility,
            scripted: true,
            texture,
            glow: glow.map_or(texture, |image| image_texture(image, requests)),
            clamp: matches!(base.and_then(|s| s.texture.as_ref()), Some(StageTexture::ClampMap(_))),
            alpha_func: base.and_then(|s| s.alpha_func),
            sky_box: shader
                .sky
                .as_ref()
                .and_then(|sky| sky.outer_box.as_ref().or(sky.inner_box.as_ref()))
                .map(|name| SKY_SIDES.map(|side| requests.request_candidate(&format!("{name}_{side}.tga")))),
            two_sided: shader.is_two_sided() || shader.is_fog(),
            autosprite: shader.is_autosprite(),
            emission: shader.emits().map(|value| EmissionSource {
                value,
                // Where nothing tells which part of the surface glows, a colour given apart means all of it.
                constant: glow.is_none() && (colour_rgb.is_some() || shader.compiler.light_image.is_some()),
            }),
            suns: shader.compiler.suns.clone(),
            colour_images: if (shader.emits().is_some() || sky_light.is_some()) && colour_rgb.is_none() {
                colour_images(shader, requests)
            } else {
                Vec::new()
            },
            sky_light,
            backsplash: shader
                .compiler
                .backsplash
                .map_or(BACKSPLASH, |b| [b.percent, b.distance]),
            light_subdivide: shader
                .compiler
                .light_subdivide
                .filter(|s| *s > 0.0)
                .unwrap_or(LIGHT_SUBDIVIDE),
            colour_rgb,
            colour: Vec3::ONE,
        }
    }

    /// Derives the emitted colour once the textures are loaded.
    pub fn resolve(&mut self, textures: &[Texture]) {
        let images = self.colour_images.iter().map(|&i| &textures[i as usize]);
        self.colour = emission_colour(self.colour_rgb, images);
    }

    /// `q3map_surfacelight`, where there is one.
    pub fn surface_light(&self) -> Option<f32> {
        self.emission.map(|e| e.value)
    }

    /// The emitted colour, largest component 1.
    pub fn emission_colour(&self) -> Vec3 {
        self.colour
    }

    /// What the surface emits.
    pub fn emission(&self) -> Option<Emission> {
        let source = self.emission?;
        let textured = !source.constant && self.visibility != Visibility::Sky && self.texture != CHECKER;
        Some(Emission::from_surface_light(
            source.value,
            self.colour,
            textured.then_some(self.glow),
        ))
    }

    /// The record that the tracers read.
    pub fn record(&self, textures: &[Texture]) -> Material {
        let mut record = Material {
            texture: self.texture,
            flags: if self.clamp { MATERIAL_CLAMP } else { 0 },
            alpha_scale: 0.0,
            alpha_offset: 1.0,
            emission: [0.0; 3],
            emission_texture: NONE,
            sky: [NONE; 6],
        };
        if self.visibility == Visibility::AlphaTested {
            record.flags |= MATERIAL_ALPHA_TESTED;
            // Half a step of an 8-bit image keeps the comparison away from rounding: it passes where the script's does.
            (record.alpha_scale, record.alpha_offset) = match self.alpha_func {
                Some(AlphaFunc::Gt0) | None => (1.0, -0.5 / 255.0),
                Some(AlphaFunc::Lt128) => (-1.0, 0.5),
                Some(AlphaFunc::Ge128) => (1.0, -0.5 + 0.5 / 255.0),
            };
        }
        if self.two_sided {
            record.flags |= MATERIAL_TWO_SIDED_EMISSION;
        }
        let emission = self.emission();
        if let Some(e) = &emission {
            let (scaled, texture) = normalised_texture(e, textures);
            record.emission = scaled.into();
            record.emission_texture = texture.unwrap_or(NONE);
        }
        if self.visibility == Visibility::Sky {
            self.sky_record(&mut record, emission.map(|e| e.radiance), textures);
        }
        record
    }

    /// A sky's radiance follows its images; their mean is what the compiler lit the map with, where it did.
    fn sky_record(&self, record: &mut Material, radiance: Option<Vec3>, textures: &[Texture]) {
        record.flags |= MATERIAL_SKY;
        let box_found = self
            .sky_box
            .filter(|sides| sides.iter().take(5).any(|&t| !textures[t as usize].missing));
        if let Some(sides) = box_found {
            record.flags |= MATERIAL_SKY_BOX;
            // A missing side (often the bottom) shows its opposite rather than a checker.
            record.sky = std::array::from_fn(|i| {
                let t = sides[i];
                if textures[t as usize].missing { sides[i ^ 1] } else { t }
            });
            let mean: Vec3 = record
                .sky
                .iter()
                .map(|&t| Vec3::from(textures[t as usize].mean_linear))
                .sum::<Vec3>()
                / 6.0;
            let scale = match radiance {
                Some(l) if mean.min_element() >= DARK_SKY => l / mean,
                // A night sky has no hue to speak of: only its brightness is matched.
                Some(l) => Vec3::splat(luminance(l) / luminance(mean).max(1e-4)),
                None => Vec3::splat(UNLIT_SKY),
            };
            record.emission = scale.into();
        } else {
            let image = Vec3::from(textures[self.texture as usize].mean_linear);
            record.emission = radiance.unwrap_or(image * UNLIT_SKY).into();
        }
    }
}

fn visibility(shader: &Shader, flags: i32) -> Visibility {
    let flags = flags | shader.surface_flags() as i32;
    if shader.is_sky() || flags & surface_flags::SKY != 0 {
        return Visibility::Sky;
    }
    let undrawn = flags & (surface_flags::NODRAW | surface_flags::SKIP | surface_flags::HINT) != 0;
    if undrawn || shader.is_fog() {
        return Visibility::Invisible;
    }
    let first = shader.drawn_stages().next();
    if first.is_some_and(|s| s.alpha_func.is_some()) {
        return Visibility::AlphaTested;
    }
    if shader.is_blended() {
        return Visibility::Blended;
    }
    Visibility::Opaque
}

/// Which images give an emitter's colour, in the compiler's order.
fn colour_images(shader: &Shader, requests: &mut TextureRequests) -> Vec<u32> {
    let compiler = &shader.compiler;
    let mut names: Vec<String> = compiler.light_image.iter().cloned().collect();
    let sky_up = shader.sky.as_ref().and_then(|s| s.outer_box.as_ref());
    names.extend(sky_up.map(|name| format!("{name}_up.tga")));
    let implicit = compiler.implicit_image.as_ref();
    if shader.editor.image.is_none() && implicit.is_none() {
        let first = shader.stages.iter().filter_map(stage_image).find_map(Image::file);
        names.extend(first.map(str::to_owned));
    }
    names.extend(shader.editor.image.clone());
    if shader.surface_flags() as i32 & surface_flags::NODRAW == 0 {
        names.push(shader.name.clone());
    }
    names.extend(implicit.and_then(|i| i.image.clone()));
    names.iter().map(|n| requests.request_candidate(n)).collect()
}
