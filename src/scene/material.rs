//! Materials: what a shader script (or a bare image) means to the tracer.
//!
//! What the stages of a script come to is in [`super::program`]; here is what decides about the surface as a whole.

use super::dynamic_geometry;
use super::emission::{Emission, emission_colour, normalised, normalised_texture};
use super::optics;
use super::program::{Program, UNLIT};
use super::records::{
    Deform, MATERIAL_ALPHA_TESTED, MATERIAL_BACK, MATERIAL_CLAMP, MATERIAL_DIELECTRIC, MATERIAL_FILTER,
    MATERIAL_GLOSSY, MATERIAL_LAYER, MATERIAL_MOVING_EMISSION, MATERIAL_NO_FRONT, MATERIAL_PANE, MATERIAL_PORTAL,
    MATERIAL_SKY, MATERIAL_SKY_BOX, MATERIAL_STAGES, MATERIAL_TWO_SIDED_EMISSION, Material, NONE, Stage as StageRecord,
    TcMod,
};
use super::textures::{CHECKER, TextureRequests, WHITE};
use crate::assets::bsp::lumps::surface_flags;
use crate::assets::image::Texture;
use crate::assets::shader_script::{
    AlphaFunc, BlendFactor, Cull, Image, Shader, ShaderLibrary, SkyParms, Sort, Stage, StageTexture, Sun, SurfaceParm,
    TcGen,
};
use glam::Vec3;

/// Suffixes of a sky box's images in the order of [`Material::sky`].
const SKY_SIDES: [&str; 6] = ["rt", "lf", "bk", "ft", "up", "dn"];
/// How far a layer stands off what it lies on, units per step of the game's drawing order after opaque surfaces: a decal
/// shares its place with a wall, and rays must meet the two in that order.
const LIFT: f32 = 1.0 / 64.0;

/// Radiance at which a lamp is shown whose script has no stage that shines, luxel units: well over what it lights.
const UNSTAGED_LAMP: f32 = 4.0 * UNLIT;

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
    /// What is behind shows through.
    Layer,
    /// Never drawn (nodraw, fog volumes, flares).
    Invisible,
}

/// A material before its textures are loaded.
#[derive(Clone, Debug)]
pub struct MaterialSource {
    pub name: String,
    pub visibility: Visibility,
    /// An MD3 model asked for it.
    pub of_model: bool,
    /// The script has a definition for the name.
    pub scripted: bool,
    texture: u32,
    /// Image that shows where an emitter glows.
    glow: u32,
    clamp: bool,
    pub alpha_func: Option<AlphaFunc>,
    pub sky_box: Option<[u32; 6]>,
    pub two_sided: bool,
    pub autosprite: bool,
    pub cull: Cull,
    /// Distance along its normals that a surface stands off its place, units.
    pub lift: f32,
    pub program: Program,
    /// A mirror or portal.
    pub portal: bool,
    /// Changes of the geometry.
    pub deforms: Vec<Deform>,
    /// Height of a sky's clouds, units.
    /// Reflects and bends like glass or water.
    pub dielectric: Option<Dielectric>,
    /// Of its environment-mapped stages, 0..1.
    pub roughness: f32,
    cloud_height: f32,
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

/// What the records of all materials point into.
#[derive(Clone, Debug, Default)]
pub struct Tables {
    pub stages: Vec<StageRecord>,
    pub tc_mods: Vec<TcMod>,
    pub deforms: Vec<Deform>,
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
                of_model: false,
                scripted: false,
                texture: if hidden || sky { WHITE } else { requests.request(name) },
                glow: WHITE,
                clamp: false,
                alpha_func: None,
                sky_box: None,
                two_sided: false,
                autosprite: false,
                cull: Cull::FrontSided,
                lift: 0.0,
                program: Program::default(),
                portal: false,
                deforms: Vec::new(),
                cloud_height: SkyParms::DEFAULT_CLOUD_HEIGHT,
                dielectric: None,
                roughness: optics::ROUGHNESS,
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
        let shows = !matches!(visibility, Visibility::Invisible);
        let program = if shows {
            Program::compile(
                shader,
                shader.emits().is_some() && visibility != Visibility::Sky,
                requests,
            )
        } else {
            Program::default()
        };
        let texture = match (base.and_then(stage_image), visibility) {
            (Some(image), _) => image_texture(image, requests),
            (None, Visibility::Invisible | Visibility::Sky) => WHITE,
            (None, _) => CHECKER,
        };
        Self {
            name: name.to_owned(),
            visibility,
            of_model: false,
            scripted: true,
            texture,
            glow: glow.map_or(texture, |image| image_texture(image, requests)),
            clamp: matches!(base.and_then(|s| s.texture.as_ref()), Some(StageTexture::ClampMap(_))),
            alpha_func: shader.drawn_stages().find_map(|s| s.alpha_func),
            sky_box: shader
                .sky
                .as_ref()
                .and_then(|sky| sky.outer_box.as_ref().or(sky.inner_box.as_ref()))
                .map(|name| SKY_SIDES.map(|side| requests.request_candidate(&format!("{name}_{side}.tga")))),
            two_sided: shader.is_two_sided() || shader.is_fog(),
            autosprite: shader.is_autosprite(),
            cull: shader.cull,
            lift: lift(shader, visibility),
            program,
            portal: shader.portal && visibility == Visibility::Layer,
            deforms: shader.deforms.iter().filter_map(dynamic_geometry::record).collect(),
            cloud_height: shader
                .sky
                .as_ref()
                .map_or(SkyParms::DEFAULT_CLOUD_HEIGHT, |sky| sky.cloud_height),
            dielectric: dielectric(shader, visibility),
            roughness: shader.roughness.unwrap_or(optics::ROUGHNESS),
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

    /// The record that the tracers read; its stages are added to the scene's.
    pub fn record(&self, textures: &[Texture], tables: &mut Tables) -> Material {
        let mut record = Material {
            texture: self.texture,
            flags: if self.clamp { MATERIAL_CLAMP } else { 0 },
            alpha_scale: 0.0,
            alpha_offset: 1.0,
            emission: [0.0; 3],
            shown: [0.0; 3],
            emission_texture: NONE,
            sky: [NONE; 6],
            first_stage: tables.stages.len() as u32,
            stage_count: 0,
            alpha_stage: NONE,
            sky_scale: [0.0; 3],
            cloud_height: self.cloud_height,
            first_deform: tables.deforms.len() as u32,
            deform_count: self.deforms.len() as u32,
            ior: self.dielectric.map_or(0.0, |d| d.ior),
            lobe: (self.roughness * self.roughness).clamp(optics::LEAST_ALPHA, 1.0),
        };
        if let Some(d) = self.dielectric {
            record.flags |= MATERIAL_DIELECTRIC | if d.pane { MATERIAL_PANE } else { 0 };
        }
        if self.program.glossy && self.visibility != Visibility::Sky {
            record.flags |= MATERIAL_GLOSSY;
        }
        tables.deforms.extend(&self.deforms);
        self.stage_record(&mut record, tables);
        if let Some(test) = self.alpha_func
            && matches!(self.visibility, Visibility::AlphaTested | Visibility::Layer)
        {
            record.flags |= MATERIAL_ALPHA_TESTED;
            // Half a step of an 8-bit image keeps the comparison away from rounding: it passes where the script's does.
            (record.alpha_scale, record.alpha_offset) = match test {
                AlphaFunc::Gt0 => (1.0, -0.5 / 255.0),
                AlphaFunc::Lt128 => (-1.0, 0.5),
                AlphaFunc::Ge128 => (1.0, -0.5 + 0.5 / 255.0),
            };
        }
        if self.portal {
            record.flags |= MATERIAL_PORTAL;
        }
        if self.two_sided {
            record.flags |= MATERIAL_TWO_SIDED_EMISSION;
        }
        if self.cull != Cull::FrontSided || self.visibility == Visibility::Sky || self.autosprite {
            record.flags |= MATERIAL_BACK;
        }
        if self.cull == Cull::BackSided && !self.autosprite {
            record.flags |= MATERIAL_NO_FRONT;
        }
        if self.visibility == Visibility::Sky {
            self.sky_record(&mut record, self.emission().map(|e| e.radiance), textures);
        } else if let Some(e) = self.emission() {
            self.emission_record(&mut record, &e, textures);
        }
        record
    }

    fn stage_record(&self, record: &mut Material, tables: &mut Tables) {
        if self.visibility == Visibility::Layer {
            record.flags |= MATERIAL_LAYER;
            // Quads that turn to the eye would throw shadows that follow it: they throw none.
            if self.program.filters && !self.autosprite {
                record.flags |= MATERIAL_FILTER;
            }
        }
        if let Some((texture, clamp)) = self.program.plain {
            record.texture = texture;
            record.flags = record.flags & !MATERIAL_CLAMP | if clamp { MATERIAL_CLAMP } else { 0 };
        } else if !self.program.stages.is_empty() {
            record.flags |= MATERIAL_STAGES;
        }
        if record.flags & MATERIAL_STAGES == 0 && self.program.alpha_stage.is_none() {
            return;
        }
        let first_mod = tables.tc_mods.len() as u32;
        tables.tc_mods.extend(&self.program.mods);
        record.stage_count = self.program.stages.len() as u32;
        record.alpha_stage = self.program.alpha_stage.map_or(NONE, |s| record.first_stage + s);
        tables.stages.extend(self.program.stages.iter().map(|s| StageRecord {
            first_mod: s.first_mod + first_mod,
            ..*s
        }));
    }

    /// Emission follows the stages that shine, where there are any; their mean is the compiler's.
    fn emission_record(&self, record: &mut Material, emission: &Emission, textures: &[Texture]) {
        let shining: Vec<&StageRecord> = self.program.emission_stages().collect();
        record.shown = [UNLIT; 3];
        if shining.is_empty() {
            let (scaled, texture) = normalised_texture(emission, textures);
            record.emission = scaled.into();
            record.emission_texture = texture.unwrap_or(NONE);
            record.shown = scaled.min(Vec3::splat(UNSTAGED_LAMP)).into();
            return;
        }
        let Some(scaled) = normalised(emission.radiance, self.program.mean_emission(textures)) else {
            record.emission = emission.radiance.into();
            record.shown = emission.radiance.min(self.colour * UNLIT).into();
            return;
        };
        record.emission = scaled.into();
        if self.program.moving_emission || shining.len() > 1 {
            record.flags |= MATERIAL_MOVING_EMISSION;
        } else {
            record.emission_texture = shining[0].textures[0];
        }
    }

    /// A sky's radiance follows its images and clouds; their mean is what the compiler lit the map with, where it did.
    fn sky_record(&self, record: &mut Material, radiance: Option<Vec3>, textures: &[Texture]) {
        record.flags |= MATERIAL_SKY;
        let box_found = self
            .sky_box
            .filter(|sides| sides.iter().take(5).any(|&t| !textures[t as usize].missing));
        let mut background = Vec3::ZERO;
        if let Some(sides) = box_found {
            record.flags |= MATERIAL_SKY_BOX;
            // A missing side (often the bottom) shows its opposite rather than a checker.
            record.sky = std::array::from_fn(|i| {
                let t = sides[i];
                if textures[t as usize].missing { sides[i ^ 1] } else { t }
            });
            background = record
                .sky
                .iter()
                .map(|&t| Vec3::from(textures[t as usize].mean_linear))
                .sum::<Vec3>()
                / 6.0;
        }
        let clouds = record.flags & MATERIAL_STAGES != 0;
        if !clouds && box_found.is_none() {
            let image = Vec3::from(textures[self.texture as usize].mean_linear);
            record.emission = radiance.unwrap_or(image * UNLIT).into();
            record.shown = (image * UNLIT).into();
            return;
        }
        let mean = if clouds {
            self.program.mean_picture(textures, background)
        } else {
            background
        };
        let scale = match radiance {
            Some(l) if mean.min_element() >= DARK_SKY => l / mean,
            // A night sky has no hue to speak of: only its brightness is matched.
            Some(l) => Vec3::splat(luminance(l) / luminance(mean).max(1e-4)),
            None => Vec3::splat(UNLIT),
        };
        record.sky_scale = scale.into();
        record.shown = [UNLIT; 3];
        record.emission = if clouds { scale * mean } else { scale }.into();
    }
}

/// A smooth surface of a medium.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Dielectric {
    /// Index of refraction behind the front over before it.
    pub ior: f32,
    /// Both sides of a pane in one surface.
    pub pane: bool,
}

/// Water and slime, what is called glass, and what says so.
fn dielectric(shader: &Shader, visibility: Visibility) -> Option<Dielectric> {
    if shader.portal || !matches!(visibility, Visibility::Layer | Visibility::Opaque) {
        return None;
    }
    if let Some(ior) = shader.ior {
        let pane = shader.pane;
        return (ior > 1.0 && ior.is_finite()).then_some(Dielectric { ior, pane });
    }
    let has = |parm| shader.surface_parms.contains(parm);
    if has(SurfaceParm::Water) || has(SurfaceParm::Slime) {
        let ior = optics::WATER;
        return Some(Dielectric { ior, pane: false });
    }
    // Windows are brushes of which often only one side is drawn: each is a pane of its own.
    let glass = shader.name.to_ascii_lowercase().contains("glass");
    (glass && visibility == Visibility::Layer).then_some(Dielectric {
        ior: optics::GLASS,
        pane: true,
    })
}

/// Layers and decals stand off the surface they lie on, later ones farther.
fn lift(shader: &Shader, visibility: Visibility) -> f32 {
    if visibility != Visibility::Layer && !shader.polygon_offset {
        return 0.0;
    }
    (shader.effective_sort().0 - Sort::OPAQUE.0).clamp(0.5, Sort::NEAREST.0) * LIFT
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
    if shader.is_blended() {
        return Visibility::Layer;
    }
    if shader.drawn_stages().any(|s| s.alpha_func.is_some()) {
        return Visibility::AlphaTested;
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
