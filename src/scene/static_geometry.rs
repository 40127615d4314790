//! Static world and brush models: the map's drawn surfaces as triangles.

use super::dynamic_geometry::{Dynamic, DynamicPart, reach, sprite_axes, swept};
use super::material::{MaterialSource, Visibility};
use super::models::Models;
use super::polygons::Room;
use super::records::{DEFORM_AUTOSPRITE, Deform, NONE, RestVertex, Triangle, VertexAttributes};
use crate::assets::bsp::lumps::{SURFACE_FLARE, SURFACE_PATCH, Surface};
use crate::assets::bsp::patch::{CURVATURE_BOUND, MeshVertex, tessellate};
use crate::assets::bsp::{Bounds, Bsp};
use glam::Vec3;
use rayon::prelude::*;
use std::ops::Range;

/// The five geometry classes of the thesis.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum GeometryClass {
    /// World, nothing changes.
    WorldStatic,
    /// World whose texture coordinates, colours or images change with the clock.
    WorldDynamicData,
    /// World whose vertices move (`deformVertexes`).
    WorldDynamic,
    /// Entities that move rigidly: brush models, single-frame models.
    EntityStatic,
    /// Entities with vertex animation.
    EntityDynamic,
}

/// A mesh: one bottom-level acceleration structure.
#[derive(Clone, Debug)]
pub struct Mesh {
    pub class: GeometryClass,
    /// First global triangle.
    pub first_triangle: u32,
    /// Triangles that stop every ray without a look at their material; they come first.
    pub opaque_count: u32,
    /// All triangles.
    pub triangle_count: u32,
    /// Object-space bounds of the vertices.
    pub bounds: Bounds,
}

/// Vertices, triangles and meshes of a scene.
#[derive(Clone, Debug, Default)]
pub struct Geometry {
    /// Object-space positions, units.
    pub positions: Vec<[f32; 3]>,
    pub attributes: Vec<VertexAttributes>,
    pub triangles: Vec<Triangle>,
    /// `meshes[i]` is the map's model i, model 0 the world; then MD3 models; then the deforming parts of any of them.
    pub meshes: Vec<Mesh>,
    pub dynamic: Dynamic,
    /// Where a frame's own polygons go, if there is room for any.
    pub polygons: Option<Room>,
    /// Triangles that belong to no mesh: emitters that rays do not meet.
    pub untraced: Range<u32>,
    /// Triangles dropped because they have no area.
    pub degenerate: u32,
}

impl Geometry {
    /// Corner positions of a triangle, object space.
    pub fn corners(&self, triangle: u32) -> [Vec3; 3] {
        self.triangles[triangle as usize]
            .vertices
            .map(|v| Vec3::from(self.positions[v as usize]))
    }
}

/// Layers at one place, and how far apart they stand, units.
const LIFT_STEPS: u32 = 8;
const LIFT_STEP: f32 = 1.0 / 1024.0;

/// Triangles of one surface, wound counter-clockwise seen from the front.
pub struct SurfaceMesh {
    /// Surface of the map, or [`NONE`].
    surface: u32,
    material: u32,
    vertices: Vec<MeshVertex>,
    indices: Vec<u32>,
    degenerate: u32,
}

impl SurfaceMesh {
    /// Winds triangles by their vertices' normals and leaves out those without area.
    pub fn new(surface: u32, material: u32, vertices: Vec<MeshVertex>, indices: &[u32]) -> Self {
        let mut out = Self {
            surface,
            material,
            indices: Vec::with_capacity(indices.len()),
            degenerate: 0,
            vertices,
        };
        for t in indices.chunks_exact(3) {
            let [a, b, c] = [t[0], t[1], t[2]].map(|i| out.vertices[i as usize]);
            let cross = (b.position - a.position).cross(c.position - a.position);
            if cross.length_squared() <= f32::MIN_POSITIVE || !cross.is_finite() {
                out.degenerate += 1;
            } else if cross.dot(a.normal + b.normal + c.normal) < 0.0 {
                out.indices.extend([t[0], t[2], t[1]]);
            } else {
                out.indices.extend([t[0], t[1], t[2]]);
            }
        }
        out
    }
}

fn surface_mesh(bsp: &Bsp, materials: &[MaterialSource], index: u32) -> SurfaceMesh {
    let s: &Surface = &bsp.surfaces[index as usize];
    let own = &bsp.vertices[s.first_vertex as usize..(s.first_vertex + s.vertex_count) as usize];
    let (vertices, indices) = if s.kind == SURFACE_PATCH {
        let mesh = tessellate(own, s.patch_width as usize, s.patch_height as usize, CURVATURE_BOUND);
        (mesh.vertices, mesh.indices)
    } else if s.kind == SURFACE_FLARE {
        (Vec::new(), Vec::new())
    } else {
        let first = s.first_index as usize;
        let indices = &bsp.indices[first..first + s.index_count as usize / 3 * 3];
        (
            own.iter().map(MeshVertex::from).collect(),
            indices.iter().map(|&i| i as u32).collect(),
        )
    };
    // Coincident layers of the same order are told apart by their number.
    let lift = match materials[s.shader as usize].lift {
        lift if lift > 0.0 => lift + (index % LIFT_STEPS) as f32 * LIFT_STEP,
        _ => 0.0,
    };
    let mut vertices: Vec<MeshVertex> = vertices;
    for v in &mut vertices {
        v.position += v.normal * lift;
    }
    SurfaceMesh::new(index, s.shader as u32, vertices, &indices)
}

/// Builds all models of a map, then the MD3 models that it places.
/// `polygons`: triangles that frames may bring along.
pub fn build(bsp: &Bsp, materials: &[MaterialSource], emits: &[bool], models: &Models, polygons: u32) -> Geometry {
    let meshes: Vec<SurfaceMesh> = (0..bsp.surfaces.len() as u32)
        .into_par_iter()
        .map(|i| surface_mesh(bsp, materials, i))
        .collect();
    let mut out = Geometry::default();
    let mut dynamic = Vec::new();
    for (index, model) in bsp.models.iter().enumerate() {
        let range = model.first_surface.max(0) as usize..(model.first_surface.max(0) + model.surface_count) as usize;
        let class = if index == 0 {
            GeometryClass::WorldStatic
        } else {
            GeometryClass::EntityStatic
        };
        let (still, moved) = parted(&meshes[range], materials);
        out.append_mesh(class, &still, materials);
        dynamic.push(moved);
    }
    let shapes: Vec<(GeometryClass, Vec<SurfaceMesh>)> = models.shapes();
    for (class, shape) in &shapes {
        // Each step of an animation has a tree of its own already: its materials do not deform it.
        let (still, moved) = match class {
            GeometryClass::EntityDynamic => (shape.iter().collect(), Vec::new()),
            _ => parted(shape, materials),
        };
        out.append_mesh(*class, &still, materials);
        dynamic.push(moved);
    }
    // Before what deforms: shaders know that by its vertices' numbers, which come last but for untraced ones.
    out.polygons = (polygons > 0).then(|| Room::add(&mut out, polygons));
    out.dynamic.vertices = out.positions.len() as u32..out.positions.len() as u32;
    for (carrier, surfaces) in (0u32..).zip(&dynamic) {
        if !surfaces.is_empty() {
            out.append_dynamic(carrier, materials, surfaces);
        }
    }
    out.dynamic.vertices.end = out.positions.len() as u32;
    let untraced = out.triangles.len() as u32;
    for mesh in meshes {
        let material = mesh.material as usize;
        if materials[material].visibility == Visibility::Invisible && emits[material] {
            out.append(&mesh);
        }
    }
    out.untraced = untraced..out.triangles.len() as u32;
    out
}

/// Surfaces that keep their form, and those that are deformed.
fn parted<'a>(
    surfaces: &'a [SurfaceMesh],
    materials: &[MaterialSource],
) -> (Vec<&'a SurfaceMesh>, Vec<&'a SurfaceMesh>) {
    let shown = |s: &&SurfaceMesh| materials[s.material as usize].visibility != Visibility::Invisible;
    surfaces
        .iter()
        .filter(shown)
        .partition(|s| materials[s.material as usize].deforms.is_empty())
}

fn opaque(surface: &SurfaceMesh, materials: &[MaterialSource]) -> bool {
    let visibility = materials[surface.material as usize].visibility;
    matches!(visibility, Visibility::Opaque | Visibility::Sky)
}

impl Geometry {
    /// Appends surfaces that keep their form as a mesh.
    fn append_mesh(&mut self, class: GeometryClass, surfaces: &[&SurfaceMesh], materials: &[MaterialSource]) {
        let first_triangle = self.triangles.len() as u32;
        let mut bounds = Bounds::EMPTY;
        let mut opaque_count = 0;
        for wanted in [true, false] {
            for mesh in surfaces.iter().filter(|m| opaque(m, materials) == wanted) {
                self.append(mesh);
                mesh.vertices.iter().for_each(|v| bounds.include(v.position));
            }
            if wanted {
                opaque_count = self.triangles.len() as u32 - first_triangle;
            }
        }
        self.meshes.push(Mesh {
            class,
            first_triangle,
            opaque_count,
            triangle_count: self.triangles.len() as u32 - first_triangle,
            bounds,
        });
    }

    /// Appends the deforming surfaces of mesh `carrier` as a mesh of their own.
    fn append_dynamic(&mut self, carrier: u32, materials: &[MaterialSource], surfaces: &[&SurfaceMesh]) {
        let first_triangle = self.triangles.len() as u32;
        let first_vertex = self.positions.len() as u32;
        let mut opaque_count = 0;
        let mut boxes = Vec::new();
        for wanted in [true, false] {
            for mesh in surfaces.iter().filter(|m| opaque(m, materials) == wanted) {
                self.append_deformed(mesh, &materials[mesh.material as usize].deforms, &mut boxes);
            }
            if wanted {
                opaque_count = self.triangles.len() as u32 - first_triangle;
            }
        }
        let mut bounds = Bounds::EMPTY;
        for corner in boxes.as_flattened() {
            bounds.include(*corner);
        }
        self.dynamic.parts.push(DynamicPart {
            mesh: self.meshes.len() as u32,
            carrier,
            vertices: first_vertex..self.positions.len() as u32,
            boxes,
        });
        self.meshes.push(Mesh {
            class: if carrier == 0 {
                GeometryClass::WorldDynamic
            } else {
                GeometryClass::EntityDynamic
            },
            first_triangle,
            opaque_count,
            triangle_count: self.triangles.len() as u32 - first_triangle,
            bounds,
        });
    }

    fn append_deformed(&mut self, mesh: &SurfaceMesh, deforms: &[Deform], boxes: &mut Vec<[Vec3; 2]>) {
        let base = self.positions.len() as u32;
        let first = self.triangles.len();
        self.append(mesh);
        let sprites = deforms.iter().any(|d| d.kind >= DEFORM_AUTOSPRITE);
        let quads = sprites && mesh.vertices.len().is_multiple_of(4);
        if quads && deforms.iter().any(|d| d.kind == DEFORM_AUTOSPRITE) {
            for q in (base..self.positions.len() as u32).step_by(4) {
                self.stamp(q as usize);
            }
        }
        let rest = mesh.vertices.iter().enumerate().map(|(i, v)| RestVertex {
            position: self.positions[base as usize + i],
            normal: v.normal.into(),
            quad: if quads { base + i as u32 / 4 * 4 } else { NONE },
            // What is made of anything but quads can't turn.
            material: if sprites && !quads { NONE } else { mesh.material },
            instance: NONE,
        });
        self.dynamic.rest.extend(rest);
        for t in first..self.triangles.len() {
            let vertices = self.triangles[t].vertices;
            let at = |v: u32| Vec3::from(self.positions[v as usize]);
            let quad = quads.then(|| {
                let q = base + (vertices[0] - base) / 4 * 4;
                std::array::from_fn(|k| at(q + k as u32))
            });
            boxes.push(swept(vertices.map(at), quad, reach(deforms)));
        }
    }

    /// Makes a sprite of the quad of four vertices: a square with the whole texture on it, whatever the map's coordinates say.
    fn stamp(&mut self, first: usize) {
        let corners: [Vec3; 4] = std::array::from_fn(|k| self.positions[first + k].into());
        let middle = corners.iter().sum::<Vec3>() * 0.25;
        let [right, up] = sprite_axes(corners);
        let half = corners[0].distance(middle) * std::f32::consts::FRAC_1_SQRT_2;
        let mut around: Vec<(f32, usize)> = (0..4)
            .map(|k| {
                let d = corners[k] - middle;
                (d.dot(up).atan2(d.dot(right)), k)
            })
            .collect();
        around.sort_by(|a, b| a.0.total_cmp(&b.0));
        // Counter-clockwise from below on the left, seen from the front; the texture's v goes down.
        for ((_, k), [x, y]) in around
            .into_iter()
            .zip([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
        {
            self.positions[first + k] = (middle + (right * x + up * y) * half).into();
            self.attributes[first + k].uv = [0.5 + 0.5 * x, 0.5 - 0.5 * y];
        }
    }

    fn append(&mut self, mesh: &SurfaceMesh) {
        let base = self.positions.len() as u32;
        for v in &mesh.vertices {
            self.positions.push(v.position.into());
            let color = v.color.to_array().map(|c| (c * 255.0 + 0.5).clamp(0.0, 255.0) as u8);
            self.attributes.push(VertexAttributes {
                normal: v.normal.into(),
                uv: v.uv.into(),
                lightmap_uv: v.lightmap_uv.into(),
                color: u32::from_le_bytes(color),
            });
        }
        for t in mesh.indices.chunks_exact(3) {
            self.triangles.push(Triangle {
                vertices: [base + t[0], base + t[1], base + t[2]],
                material: mesh.material,
                surface: mesh.surface,
                fallback_row: 0,
            });
        }
        self.degenerate += mesh.degenerate;
    }
}
