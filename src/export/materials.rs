//! Materials with their pictures. Stages are baked over the unit square of texture coordinates, which is exact where one image,
//! plain or scaled by constants, makes the surface; `albedo_exact` in `extras` says where that is so.

use super::ExportError;
use super::document::Document;
use crate::assets::image::{Texture, encode_srgb};
use crate::reference::program::{Point, shade, shining, tested_alpha};
use crate::scene::Scene;
use crate::scene::clock::Clock;
use crate::scene::records::{
    MATERIAL_ALPHA_TESTED, MATERIAL_BACK, MATERIAL_CLAMP, MATERIAL_LAYER, MATERIAL_MOVING_EMISSION, MATERIAL_SKY,
    MATERIAL_SKY_BOX, MATERIAL_STAGES, Material, NONE, SOURCE_CONSTANT, SOURCE_WAVE, TC_TEXTURE,
};
use glam::{Vec2, Vec3};
use serde_json::{Value, json};
use std::collections::BTreeMap;

/// How a surface lights: bits of what its emission is multiplied by, and whether both of its sides do.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct Emitter {
    pub scale: u32,
    pub two_sided: bool,
}

/// Images and materials that are in the document already.
pub struct Materials<'a> {
    scene: &'a Scene,
    clock: Clock,
    samplers: [Option<usize>; 2],
    /// glTF textures by texture of the scene and whether it clamps.
    plain: BTreeMap<(u32, bool), usize>,
    /// Baked pictures by material.
    baked: BTreeMap<u32, usize>,
    shining: BTreeMap<u32, usize>,
}

/// What rays make of a material.
pub fn kind(material: &Material) -> &'static str {
    if material.flags & MATERIAL_SKY != 0 {
        "sky"
    } else if material.flags & MATERIAL_LAYER != 0 {
        "layer"
    } else if material.flags & MATERIAL_ALPHA_TESTED != 0 {
        "alpha_tested"
    } else {
        "opaque"
    }
}

/// glTF's numbers for filters and wrapping.
const LINEAR: u32 = 9729;
const LINEAR_MIPMAP_LINEAR: u32 = 9987;
const CLAMP_TO_EDGE: u32 = 33071;
const REPEAT: u32 = 10497;

fn encode(name: &str, width: u32, height: u32, texels: &[[u8; 4]]) -> Result<Vec<u8>, ExportError> {
    let mut bytes = Vec::new();
    let image = image::RgbaImage::from_raw(width, height, texels.as_flattened().to_vec());
    let failed = |reason: String| ExportError::Texture {
        name: name.to_owned(),
        reason,
    };
    image
        .ok_or_else(|| failed("it has too few texels".to_owned()))?
        .write_to(&mut std::io::Cursor::new(&mut bytes), image::ImageFormat::Png)
        .map_err(|e| failed(e.to_string()))?;
    Ok(bytes)
}

fn byte(linear: f32) -> u8 {
    (encode_srgb(linear.clamp(0.0, 1.0)) * 255.0 + 0.5) as u8
}

impl<'a> Materials<'a> {
    /// For a scene at a time.
    pub fn new(scene: &'a Scene, clock: Clock) -> Self {
        Self {
            scene,
            clock,
            samplers: [None; 2],
            plain: BTreeMap::new(),
            baked: BTreeMap::new(),
            shining: BTreeMap::new(),
        }
    }

    fn record(&self, material: u32) -> &'a Material {
        &self.scene.materials[material as usize]
    }

    fn texture(&mut self, document: &mut Document, image: usize, clamp: bool) -> usize {
        let sampler = *self.samplers[usize::from(clamp)].get_or_insert_with(|| {
            let wrap = if clamp { CLAMP_TO_EDGE } else { REPEAT };
            document.push(
                "samplers",
                json!({ "magFilter": LINEAR, "minFilter": LINEAR_MIPMAP_LINEAR, "wrapS": wrap, "wrapT": wrap }),
            )
        });
        document.push("textures", json!({ "source": image, "sampler": sampler }))
    }

    fn plain(&mut self, document: &mut Document, number: u32, clamp: bool) -> Result<usize, ExportError> {
        if let Some(known) = self.plain.get(&(number, clamp)) {
            return Ok(*known);
        }
        let t: &Texture = &self.scene.textures[number as usize];
        let image = document.image(&t.name, &encode(&t.name, t.width, t.height, &t.levels[0])?);
        let texture = self.texture(document, image, clamp);
        self.plain.insert((number, clamp), texture);
        Ok(texture)
    }

    /// A picture of the unit square: colour linear 0..1, and alpha 0..1.
    fn bake(
        &mut self,
        document: &mut Document,
        material: u32,
        texel: impl Fn(&Point) -> (Vec3, f32),
    ) -> Result<usize, ExportError> {
        let record = self.record(material);
        let first = &self.scene.textures[self.size_of(record) as usize];
        let (width, height) = (first.width, first.height);
        let texels: Vec<[u8; 4]> = (0..width * height)
            .map(|i| {
                let uv = Vec2::new(
                    ((i % width) as f32 + 0.5) / width as f32,
                    ((i / width) as f32 + 0.5) / height as f32,
                );
                let (colour, alpha) = texel(&Point::on_texture(uv, f32::NEG_INFINITY, Vec3::ZERO, Vec3::Z));
                let [r, g, b] = colour.to_array().map(byte);
                [r, g, b, (alpha.clamp(0.0, 1.0) * 255.0 + 0.5) as u8]
            })
            .collect();
        let name = &self.scene.material_sources[material as usize].name;
        let image = document.image(name, &encode(name, width, height, &texels)?);
        Ok(self.texture(document, image, record.flags & MATERIAL_CLAMP != 0))
    }

    /// The texture whose size a picture of the material takes.
    fn size_of(&self, record: &Material) -> u32 {
        let stages = &self.scene.tables.stages[record.first_stage as usize..][..record.stage_count as usize];
        let images = stages.iter().map(|s| s.textures[0]);
        let texels = |t: &u32| self.scene.textures[*t as usize].width * self.scene.textures[*t as usize].height;
        images.max_by_key(texels).unwrap_or(record.texture)
    }

    /// Whether the baked picture is what the surface shows: nothing in it depends on the place, the eye or the vertex.
    fn exact(&self, record: &Material) -> bool {
        if record.flags & MATERIAL_STAGES == 0 {
            return true;
        }
        let stages = &self.scene.tables.stages[record.first_stage as usize..][..record.stage_count as usize];
        let plain = |source| matches!(source, SOURCE_CONSTANT | SOURCE_WAVE);
        stages.len() == 1
            && stages
                .iter()
                .all(|s| s.tc_gen == TC_TEXTURE && s.mod_count == 0 && plain(s.rgb_source) && plain(s.alpha_source))
    }

    fn base_colour(&mut self, document: &mut Document, material: u32) -> Result<usize, ExportError> {
        let record = self.record(material);
        let tested = record.flags & MATERIAL_ALPHA_TESTED != 0;
        if record.flags & MATERIAL_STAGES == 0 && !tested {
            return self.plain(document, record.texture, record.flags & MATERIAL_CLAMP != 0);
        }
        if let Some(known) = self.baked.get(&material) {
            return Ok(*known);
        }
        let (scene, clock) = (self.scene, self.clock);
        let baked = self.bake(document, material, |p| {
            let (albedo, through) = if record.flags & MATERIAL_STAGES != 0 {
                let shade = shade(scene, record, p, clock, false);
                (shade.albedo, shade.through.element_sum() / 3.0)
            } else {
                let texel = crate::reference::texture::sample(
                    &scene.textures[record.texture as usize],
                    p.uv,
                    0.0,
                    record.flags & MATERIAL_CLAMP != 0,
                );
                (texel.truncate(), 0.0)
            };
            // Moved so that one half is where the test passes.
            let alpha = if tested {
                tested_alpha(scene, record, p, clock) * record.alpha_scale + record.alpha_offset + 0.5
            } else {
                1.0 - through
            };
            (albedo, alpha)
        })?;
        self.baked.insert(material, baked);
        Ok(baked)
    }

    /// Emission that lights: radiance in luxel units, times the picture's linear texels where there is one, or the sky box's.
    pub fn emission(&self, material: u32, emitter: Emitter) -> Value {
        let record = self.record(material);
        let radiance = Vec3::from(record.emission) * f32::from_bits(emitter.scale);
        let boxed = record.flags & (MATERIAL_SKY_BOX | MATERIAL_STAGES) == MATERIAL_SKY_BOX;
        let sky = record.flags & MATERIAL_SKY != 0;
        json!({
            "radiance": radiance.to_array(),
            "two_sided": emitter.two_sided,
            "textured": !sky && (record.emission_texture != NONE || record.flags & MATERIAL_MOVING_EMISSION != 0),
            "sky_box": (sky && boxed).then_some("right, left, back, front, up, down: the material's extras"),
        })
    }

    /// The glTF material of a material, lighting as `emitter` says.
    pub fn number(
        &mut self,
        document: &mut Document,
        material: u32,
        emitter: Option<Emitter>,
    ) -> Result<usize, ExportError> {
        let record = self.record(material);
        let sky = record.flags & MATERIAL_SKY != 0;
        let mut extras = json!({ "kind": kind(record), "albedo_exact": self.exact(record) });
        let mut value = json!({
            "name": self.scene.material_sources[material as usize].name,
            "pbrMetallicRoughness": { "metallicFactor": 0.0, "roughnessFactor": 1.0 },
            "doubleSided": record.flags & MATERIAL_BACK != 0,
        });
        if sky {
            value["pbrMetallicRoughness"]["baseColorFactor"] = json!([0.0, 0.0, 0.0, 1.0]);
        } else {
            let texture = self.base_colour(document, material)?;
            value["pbrMetallicRoughness"]["baseColorTexture"] = json!({ "index": texture });
        }
        match kind(record) {
            "alpha_tested" => {
                value["alphaMode"] = json!("MASK");
                value["alphaCutoff"] = json!(0.5);
            }
            "layer" => value["alphaMode"] = json!("BLEND"),
            _ => {}
        }
        if let Some(emitter) = emitter {
            self.shine(document, material, emitter, &mut value)?;
        }
        if sky && record.flags & MATERIAL_SKY_BOX != 0 {
            let mut sides = Vec::new();
            for side in record.sky {
                sides.push(self.plain(document, side, true)?);
            }
            extras["sky_box"] = json!(sides);
        }
        value["extras"] = json!({ "q3rays": extras });
        Ok(document.push("materials", value))
    }

    fn shine(
        &mut self,
        document: &mut Document,
        material: u32,
        emitter: Emitter,
        value: &mut Value,
    ) -> Result<(), ExportError> {
        const EXTENSION: &str = "KHR_materials_emissive_strength";
        let record = self.record(material);
        let radiance = Vec3::from(record.emission) * f32::from_bits(emitter.scale);
        let strength = radiance.max_element();
        if strength <= 0.0 || !strength.is_finite() {
            return Ok(());
        }
        value["emissiveFactor"] = json!((radiance / strength).to_array());
        value["extensions"] = json!({ EXTENSION: { "emissiveStrength": strength } });
        document.use_extension(EXTENSION, Value::Null);
        if record.flags & MATERIAL_SKY != 0 {
            return Ok(());
        }
        let texture = if record.flags & MATERIAL_MOVING_EMISSION != 0 {
            match self.shining.get(&material) {
                Some(known) => *known,
                None => {
                    let (scene, clock) = (self.scene, self.clock);
                    let baked = self.bake(document, material, |p| (shining(scene, record, p, clock), 1.0))?;
                    self.shining.insert(material, baked);
                    baked
                }
            }
        } else if record.emission_texture != NONE {
            self.plain(document, record.emission_texture, record.flags & MATERIAL_CLAMP != 0)?
        } else {
            return Ok(());
        };
        value["emissiveTexture"] = json!({ "index": texture });
        Ok(())
    }
}
