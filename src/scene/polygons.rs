//! Polygons that a frame brings along: marks on walls, sparks, whatever an engine draws for a moment. They are a mesh of their own in
//! room that is kept free for them, and are met by rays like any surface.

use super::Scene;
use super::material::{MaterialSource, Visibility};
use super::records::{NONE, Triangle, VertexAttributes};
use super::static_geometry::{Geometry, GeometryClass, Mesh};
use crate::assets::bsp::Bounds;
use glam::{Vec2, Vec3};
use thiserror::Error;

/// A corner of a polygon.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Corner {
    /// World space. A mark must stand off its wall: as far as a decal, 1/64 unit.
    pub position: Vec3,
    pub uv: Vec2,
    /// Encoded colour and alpha, for stages that take the vertices'.
    pub color: [u8; 4],
}

/// A convex polygon of three corners or more, counter-clockwise seen from its front.
#[derive(Clone, Debug, PartialEq)]
pub struct Polygon {
    /// Number of a material of the scene: [`Scene::material`].
    pub material: u32,
    pub corners: Vec<Corner>,
}

/// Why polygons cannot be shown.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
pub enum PolygonError {
    #[error("map \"{map}\": {count} triangles of polygons; it was loaded with room for {most}")]
    TooMany { map: String, count: usize, most: u32 },
    #[error("map \"{map}\": polygons of material {material}; it has {count}")]
    Material { map: String, material: u32, count: usize },
}

/// Where in the scene's lists polygons are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Room {
    pub mesh: u32,
    /// Each triangle has three vertices of its own.
    pub first_vertex: u32,
    pub first_triangle: u32,
    /// Triangles that there is room for.
    pub triangles: u32,
}

/// What fills a room.
#[derive(Clone, Debug)]
pub struct Shape {
    /// Three a triangle.
    pub positions: Vec<[f32; 3]>,
    pub attributes: Vec<VertexAttributes>,
    pub triangles: Vec<Triangle>,
    pub mesh: Mesh,
}

const NO_VERTEX: VertexAttributes = VertexAttributes {
    normal: [0.0, 0.0, 1.0],
    uv: [0.0; 2],
    lightmap_uv: [0.0; 2],
    color: u32::MAX,
};

impl Room {
    /// Of a scene that was loaded without any.
    pub const NONE: Self = Self {
        mesh: 0,
        first_vertex: 0,
        first_triangle: 0,
        triangles: 0,
    };

    /// Appends room for so many triangles to a geometry.
    pub fn add(geometry: &mut Geometry, triangles: u32) -> Self {
        let room = Self {
            mesh: geometry.meshes.len() as u32,
            first_vertex: geometry.positions.len() as u32,
            first_triangle: geometry.triangles.len() as u32,
            triangles,
        };
        let vertices = 3 * triangles as usize;
        geometry.positions.extend(std::iter::repeat_n([0.0; 3], vertices));
        geometry.attributes.extend(std::iter::repeat_n(NO_VERTEX, vertices));
        geometry.triangles.extend((0..triangles).map(|i| room.triangle(i, 0)));
        geometry.meshes.push(room.empty());
        room
    }

    fn triangle(&self, number: u32, material: u32) -> Triangle {
        let first = self.first_vertex + 3 * number;
        Triangle {
            vertices: [first, first + 1, first + 2],
            material,
            surface: NONE,
            fallback_row: 0,
        }
    }

    fn empty(&self) -> Mesh {
        Mesh {
            class: GeometryClass::EntityDynamic,
            first_triangle: self.first_triangle,
            opaque_count: 0,
            triangle_count: 0,
            bounds: Bounds::EMPTY,
        }
    }

    /// Polygons in this room. `fallback_row`: the light row of all lights.
    ///
    /// # Errors
    /// [`PolygonError`] where there are too many, or their material does not exist.
    pub fn shape(
        &self,
        map: &str,
        polygons: &[Polygon],
        materials: usize,
        fallback_row: u32,
    ) -> Result<Shape, PolygonError> {
        let count = polygons
            .iter()
            .map(|p| p.corners.len().saturating_sub(2))
            .sum::<usize>();
        if count > self.triangles as usize {
            return Err(PolygonError::TooMany {
                map: map.to_owned(),
                count,
                most: self.triangles,
            });
        }
        let mut out = Shape {
            positions: Vec::with_capacity(3 * count),
            attributes: Vec::with_capacity(3 * count),
            triangles: Vec::with_capacity(count),
            mesh: self.empty(),
        };
        for polygon in polygons {
            if polygon.material as usize >= materials {
                return Err(PolygonError::Material {
                    map: map.to_owned(),
                    material: polygon.material,
                    count: materials,
                });
            }
            for i in 1..polygon.corners.len().saturating_sub(1) {
                let fan = [0, i, i + 1].map(|k| polygon.corners[k]);
                let [a, b, c] = fan.map(|k| k.position);
                let Some(normal) = (b - a).cross(c - a).try_normalize() else {
                    continue;
                };
                for corner in fan {
                    out.mesh.bounds.include(corner.position);
                    out.positions.push(corner.position.into());
                    out.attributes.push(VertexAttributes {
                        normal: normal.into(),
                        uv: corner.uv.into(),
                        color: u32::from_le_bytes(corner.color),
                        ..NO_VERTEX
                    });
                }
                out.triangles.push(Triangle {
                    fallback_row,
                    ..self.triangle(out.triangles.len() as u32, polygon.material)
                });
            }
        }
        out.mesh.triangle_count = out.triangles.len() as u32;
        Ok(out)
    }
}

impl Scene {
    /// Number of the material of a name: of the map's own, or of those it was loaded with.
    pub fn material(&self, name: &str) -> Option<u32> {
        let named = |m: &MaterialSource| m.name == name && m.visibility != Visibility::Invisible;
        Some(self.material_sources.iter().position(named)? as u32)
    }

    /// Puts polygons into the scene, in place of those before; for the CPU tracer, which builds its trees of the scene as it finds
    /// it. On the GPU each frame brings its own.
    ///
    /// # Errors
    /// [`PolygonError`] where there is no room for them.
    pub fn set_polygons(&mut self, polygons: &[Polygon]) -> Result<(), PolygonError> {
        let room = self.geometry.polygons.unwrap_or(Room::NONE);
        let shape = room.shape(&self.name, polygons, self.materials.len(), self.rows.all_row)?;
        if self.geometry.polygons.is_none() {
            return Ok(());
        }
        let g = &mut self.geometry;
        let (v, t) = (room.first_vertex as usize, room.first_triangle as usize);
        let used = shape.positions.len();
        g.positions[v..v + used].copy_from_slice(&shape.positions);
        // Without area, for those who look at all of the room.
        g.positions[v + used..v + 3 * room.triangles as usize].fill([0.0; 3]);
        g.attributes[v..v + shape.attributes.len()].copy_from_slice(&shape.attributes);
        g.triangles[t..t + shape.triangles.len()].copy_from_slice(&shape.triangles);
        g.meshes[room.mesh as usize] = shape.mesh;
        Ok(())
    }
}
