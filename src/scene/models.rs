//! MD3 models as meshes of a scene.

use super::material::MaterialSource;
use super::records::NONE;
use super::static_geometry::{GeometryClass, SurfaceMesh};
use super::textures::TextureRequests;
use crate::assets::bsp::Bounds;
use crate::assets::bsp::patch::MeshVertex;
use crate::assets::md3::{Md3, Md3Surface};
use crate::assets::shader_script::ShaderLibrary;
use crate::assets::vfs::{FileSource, VfsError};
use glam::{Affine3A, Quat, Vec2, Vec3, Vec4};
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
    /// Numbers of the same with less detail, the most detailed first.
    less_detailed: Vec<u32>,
}

/// A file `name_1.md3` has less detail than `name.md3`; there are so many at most.
const LEVELS_OF_DETAIL: u32 = 2;

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
                let mut still = |md3: Arc<Md3>, less_detailed: Vec<u32>| Model {
                    materials: surface_materials(&md3, &Skin::default(), scripts, materials, requests),
                    md3,
                    frames: [0, 0],
                    share: 0.0,
                    less_detailed,
                };
                let mut less_detailed = Vec::new();
                for level in 1..=LEVELS_OF_DETAIL {
                    let path = format!("{}_{level}.md3", path.trim_end_matches(".md3"));
                    let Some(md3) = self.read_if_there(&path, files)? else {
                        break;
                    };
                    self.models.push(still(md3, Vec::new()));
                    less_detailed.push(self.models.len() as u32 - 1);
                }
                self.models.push(still(md3, less_detailed));
                Some(self.models.len() as u32 - 1)
            }
        };
        self.by_path.insert(path, found);
        Ok(found)
    }

    fn read(&mut self, path: &str, files: &dyn FileSource) -> Result<Option<Arc<Md3>>, VfsError> {
        let warnings = self.warnings.len();
        let found = self.read_if_there(path, files)?;
        if found.is_none() && self.warnings.len() == warnings {
            self.warnings.push(format!("missing model {path}"));
        }
        Ok(found)
    }

    fn read_if_there(&mut self, path: &str, files: &dyn FileSource) -> Result<Option<Arc<Md3>>, VfsError> {
        Ok(match files.read(path)?.map(|bytes| Md3::read(&bytes)) {
            None => None,
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
                    less_detailed: Vec::new(),
                });
            }
        }
        Ok(Some((first, count * between)))
    }

    /// Numbers of the same model with less detail.
    pub fn less_detailed(&self, number: u32) -> &[u32] {
        &self.models[number as usize].less_detailed
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

    /// The surfaces of every model.
    pub fn shapes(&self) -> Vec<(GeometryClass, Vec<SurfaceMesh>)> {
        let shape = |model: &Model| {
            let class = if model.frames[0] != model.frames[1] {
                GeometryClass::EntityDynamic
            } else {
                GeometryClass::EntityStatic
            };
            let surfaces = model.md3.surfaces.iter().zip(&model.materials);
            (
                class,
                surfaces.filter_map(|(s, m)| surface_mesh(s, model, *m)).collect(),
            )
        };
        self.models.iter().map(shape).collect()
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

/// A surface of a model; `None` where it lacks the frame.
fn surface_mesh(surface: &Md3Surface, model: &Model, material: u32) -> Option<SurfaceMesh> {
    let frame = |i: usize| surface.frames.get(model.frames[i] as usize);
    let (a, b) = (frame(0)?, frame(1)?);
    let vertices: Vec<MeshVertex> = a
        .iter()
        .zip(b)
        .zip(&surface.uvs)
        .map(|((a, b), uv)| MeshVertex {
            position: a.position.lerp(b.position, model.share),
            normal: a.normal.lerp(b.normal, model.share).normalize_or(a.normal),
            uv: *uv,
            lightmap_uv: Vec2::ZERO,
            color: Vec4::ONE,
        })
        .collect();
    let indices = surface.triangles.as_flattened();
    let inside = indices.iter().all(|i| (*i as usize) < vertices.len());
    inside.then(|| SurfaceMesh::new(NONE, material, vertices, indices))
}
