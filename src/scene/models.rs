//! MD3 models as meshes of a scene.

use super::material::{MaterialSource, Visibility};
use super::records::{NONE, Triangle, VertexAttributes};
use super::static_geometry::{Geometry, GeometryClass, Mesh};
use super::textures::TextureRequests;
use crate::assets::bsp::Bounds;
use crate::assets::md3::Md3;
use crate::assets::shader_script::ShaderLibrary;
use crate::assets::vfs::{FileSource, VfsError};
use glam::Vec3;
use std::collections::HashMap;

/// Models by path, each read once, with the materials that they need.
#[derive(Default)]
pub struct Models {
    models: Vec<(Md3, Vec<u32>)>,
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
        let found = match files.read(&path)?.map(|bytes| Md3::read(&bytes)) {
            None => {
                self.warnings.push(format!("missing model {path}"));
                None
            }
            Some(Err(e)) => {
                self.warnings.push(format!("cannot read {path}: {e}"));
                None
            }
            Some(Ok(model)) => {
                let numbers = model
                    .surfaces
                    .iter()
                    .map(|s| material(&s.shader, scripts, materials, requests))
                    .collect();
                self.models.push((model, numbers));
                Some(self.models.len() as u32 - 1)
            }
        };
        self.by_path.insert(path, found);
        Ok(found)
    }

    /// Middle of a model's box in its first frame.
    pub fn middle(&self, number: u32) -> Vec3 {
        let mut bounds = Bounds::EMPTY;
        for v in self.models[number as usize]
            .0
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
        for (model, numbers) in &self.models {
            let mut mesh = Mesh {
                class: if model.frame_count > 1 {
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
                for (surface, &material) in model.surfaces.iter().zip(numbers) {
                    let visibility = materials[material as usize].visibility;
                    let shown = visibility != Visibility::Invisible;
                    if shown && opaque == matches!(visibility, Visibility::Opaque | Visibility::Sky) {
                        append_surface(geometry, surface, material, &mut mesh.bounds);
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

fn append_surface(
    geometry: &mut Geometry,
    surface: &crate::assets::md3::Md3Surface,
    material: u32,
    bounds: &mut Bounds,
) {
    let Some(frame) = surface.frames.first() else { return };
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
