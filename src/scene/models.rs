//! MD3 models as meshes of a scene.

use super::material::{MaterialSource, Visibility};
use super::records::{NONE, Triangle, VertexAttributes};
use super::static_geometry::{Geometry, GeometryClass, Mesh};
use super::textures::TextureRequests;
use crate::assets::bsp::Bounds;
use crate::assets::md3::{Md3, Md3Surface, Md3Vertex};
use crate::assets::shader_script::ShaderLibrary;
use crate::assets::vfs::{FileSource, VfsError};
use glam::{Affine3A, Quat, Vec3};
use std::collections::HashMap;
use std::ops::Range;
use std::sync::Arc;

/// Steps that an animation takes from one frame of the file to the next: between the frames of the file, vertices and tags lie on the line
/// from one to the other.
const STEPS_A_FRAME: u32 = 3;

/// A model in one step of an animation.
struct Model {
    md3: Arc<Md3>,
    /// Material of each surface.
    materials: Vec<u32>,
    /// Frames that it lies between, and the share of the second.
    frames: [u32; 2],
    share: f32,
}

/// Materials of a model's surfaces by name, in place of its own.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Skin(HashMap<String, String>);

impl Skin {
    /// Reads a `.skin` file: lines of surface, comma, material.
    pub fn parse(text: &str) -> Self {
        let pair = |line: &str| {
            let (surface, material) = line.split_once(',')?;
            let material = material.trim();
            (!material.is_empty()).then(|| (surface.trim().to_ascii_lowercase(), material.to_ascii_lowercase()))
        };
        Self(text.lines().filter_map(pair).collect())
    }
}

/// Models by path, each read once, with the materials that they need.
#[derive(Default)]
pub struct Models {
    models: Vec<Model>,
    by_path: HashMap<String, Option<u32>>,
    /// What is missing or damaged, one sentence each.
    pub warnings: Vec<String>,
}

impl Models {
    /// Number of the model at a path, read when first asked for; `None` where there is none to show. Its materials are
    /// appended to `materials`.
    ///
    /// # Errors
    /// [`VfsError`] where the file exists and cannot be read.
    pub fn number(
        &mut self,
        path: &str,
        files: &dyn FileSource,
        scripts: &ShaderLibrary,
        materials: &mut Vec<MaterialSource>,
        requests: &mut TextureRequests,
    ) -> Result<Option<u32>, VfsError> {
        let path = path.to_ascii_lowercase().replace('\\', "/");
        if let Some(&known) = self.by_path.get(&path) {
            return Ok(known);
        }
        let found = match self.read(&path, files)? {
            None => None,
            Some(md3) => {
                let materials = surface_materials(&md3, &Skin::default(), scripts, materials, requests);
                self.models.push(Model {
                    md3,
                    materials,
                    frames: [0, 0],
                    share: 0.0,
                });
                Some(self.models.len() as u32 - 1)
            }
        };
        self.by_path.insert(path, found);
        Ok(found)
    }

    fn read(&mut self, path: &str, files: &dyn FileSource) -> Result<Option<Arc<Md3>>, VfsError> {
        Ok(match files.read(path)?.map(|bytes| Md3::read(&bytes)) {
            None => {
                self.warnings.push(format!("missing model {path}"));
                None
            }
            Some(Err(e)) => {
                self.warnings.push(format!("cannot read {path}: {e}"));
                None
            }
            Some(Ok(model)) => Some(Arc::new(model)),
        })
    }

    /// A model going round some of its frames: number of the first step, and how many there are.
    ///
    /// # Errors
    /// [`VfsError`] where the file exists and cannot be read.
    #[allow(clippy::too_many_arguments, reason = "where models and materials are found and kept")]
    pub fn animated(
        &mut self,
        path: &str,
        skin: &Skin,
        frames: Range<u32>,
        files: &dyn FileSource,
        scripts: &ShaderLibrary,
        materials: &mut Vec<MaterialSource>,
        requests: &mut TextureRequests,
    ) -> Result<Option<(u32, u32)>, VfsError> {
        let Some(md3) = self.read(path, files)? else {
            return Ok(None);
        };
        let materials = surface_materials(&md3, skin, scripts, materials, requests);
        let most = md3.frame_count.max(1) - 1;
        let count = frames.len().max(1) as u32;
        let between = if count > 1 { STEPS_A_FRAME } else { 1 };
        let first = self.models.len() as u32;
        for i in 0..count {
            for s in 0..between {
                let frame = |i: u32| (frames.start + i % count).min(most);
                self.models.push(Model {
                    md3: md3.clone(),
                    materials: materials.clone(),
                    frames: [frame(i), frame(i + 1)],
                    share: s as f32 / between as f32,
                });
            }
        }
        Ok(Some((first, count * between)))
    }

    /// Place of a tag on a model.
    pub fn tag(&self, number: u32, name: &str) -> Option<Affine3A> {
        let model = &self.models[number as usize];
        let place = |frame: u32| {
            let tags = model.md3.tags.get(frame as usize)?;
            Some(tags.iter().find(|t| t.name == name)?.place)
        };
        let [a, b] = [place(model.frames[0])?, place(model.frames[1])?];
        let turn = Quat::from_mat3a(&a.matrix3).slerp(Quat::from_mat3a(&b.matrix3), model.share);
        Some(Affine3A::from_rotation_translation(
            turn,
            Vec3::from(a.translation).lerp(b.translation.into(), model.share),
        ))
    }

    /// Middle of a model's box in its first frame.
    pub fn middle(&self, number: u32) -> Vec3 {
        let mut bounds = Bounds::EMPTY;
        for v in self.models[number as usize]
            .md3
            .surfaces
            .iter()
            .filter_map(|s| s.frames.first())
            .flatten()
        {
            bounds.include(v.position);
        }
        if bounds.min.x > bounds.max.x {
            return Vec3::ZERO;
        }
        (bounds.min + bounds.max) * 0.5
    }

    /// Appends every model's first frame as a mesh; mesh `first + i` is model i.
    pub fn append(&self, geometry: &mut Geometry, materials: &[MaterialSource]) {
        for model in &self.models {
            let mut mesh = Mesh {
                class: if model.frames[0] != model.frames[1] {
                    GeometryClass::EntityDynamic
                } else {
                    GeometryClass::EntityStatic
                },
                first_triangle: geometry.triangles.len() as u32,
                opaque_count: 0,
                triangle_count: 0,
                bounds: Bounds::EMPTY,
            };
            for opaque in [true, false] {
                for (surface, &material) in model.md3.surfaces.iter().zip(&model.materials) {
                    let visibility = materials[material as usize].visibility;
                    let shown = visibility != Visibility::Invisible;
                    if shown && opaque == matches!(visibility, Visibility::Opaque | Visibility::Sky) {
                        append_surface(geometry, surface, model, material, &mut mesh.bounds);
                    }
                }
                let count = geometry.triangles.len() as u32 - mesh.first_triangle;
                if opaque {
                    mesh.opaque_count = count;
                }
                mesh.triangle_count = count;
            }
            geometry.meshes.push(mesh);
        }
    }
}

fn surface_materials(
    md3: &Md3,
    skin: &Skin,
    scripts: &ShaderLibrary,
    materials: &mut Vec<MaterialSource>,
    requests: &mut TextureRequests,
) -> Vec<u32> {
    md3.surfaces
        .iter()
        .map(|s| {
            let name = skin.0.get(&s.name).unwrap_or(&s.shader);
            material(name, scripts, materials, requests)
        })
        .collect()
}

fn material(
    name: &str,
    scripts: &ShaderLibrary,
    materials: &mut Vec<MaterialSource>,
    requests: &mut TextureRequests,
) -> u32 {
    let stem = name.rsplit_once('.').map_or(name, |(stem, _)| stem);
    if let Some(found) = materials.iter().position(|m| m.of_model && m.name == stem) {
        return found as u32;
    }
    let mut made = MaterialSource::new(stem, 0, scripts, requests);
    made.of_model = true;
    materials.push(made);
    materials.len() as u32 - 1
}

fn append_surface(geometry: &mut Geometry, surface: &Md3Surface, model: &Model, material: u32, bounds: &mut Bounds) {
    let frame = |i: usize| surface.frames.get(model.frames[i] as usize);
    let (Some(a), Some(b)) = (frame(0), frame(1)) else {
        return;
    };
    let between = |(a, b): (&Md3Vertex, &Md3Vertex)| Md3Vertex {
        position: a.position.lerp(b.position, model.share),
        normal: a.normal.lerp(b.normal, model.share).normalize_or(a.normal),
    };
    let frame: Vec<Md3Vertex> = a.iter().zip(b).map(between).collect();
    let base = geometry.positions.len() as u32;
    for (v, uv) in frame.iter().zip(&surface.uvs) {
        bounds.include(v.position);
        geometry.positions.push(v.position.into());
        geometry.attributes.push(VertexAttributes {
            normal: v.normal.into(),
            uv: (*uv).into(),
            lightmap_uv: [0.0; 2],
            color: u32::MAX,
        });
    }
    for t in &surface.triangles {
        let [a, b, c] = t.map(|i| frame[i as usize]);
        let cross = (b.position - a.position).cross(c.position - a.position);
        if cross.length_squared() <= f32::MIN_POSITIVE {
            geometry.degenerate += 1;
            continue;
        }
        let turned = cross.dot(a.normal + b.normal + c.normal) < 0.0;
        let [x, y, z] = t.map(|i| base + i);
        geometry.triangles.push(Triangle {
            vertices: if turned { [x, z, y] } else { [x, y, z] },
            material,
            surface: NONE,
            fallback_row: 0,
        });
    }
}
