//! Entities that place geometry: brush models.

use super::records::Instance;
use super::static_geometry::Geometry;
use crate::assets::entities::Entity;
use glam::{Affine3A, Vec3};

/// A mesh standing somewhere in the world.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Placement {
    pub mesh: u32,
    pub object_to_world: Affine3A,
}

/// The world, then every brush model that an entity of the lump shows, in entity order.
pub fn placements(entities: &[Entity], mesh_count: usize) -> Vec<Placement> {
    let mut out = Vec::new();
    if mesh_count > 0 {
        out.push(Placement {
            mesh: 0,
            object_to_world: Affine3A::IDENTITY,
        });
    }
    for entity in entities {
        let model = entity.get("model").and_then(|m| m.strip_prefix('*'));
        let Some(mesh) = model.and_then(|m| m.parse::<u32>().ok()) else {
            continue;
        };
        if mesh == 0 || mesh as usize >= mesh_count {
            continue;
        }
        let origin = entity.vector("origin").unwrap_or(Vec3::ZERO);
        out.push(Placement {
            mesh,
            object_to_world: Affine3A::from_translation(origin),
        });
    }
    out
}

impl Placement {
    /// The record that tracers read.
    pub fn record(&self, geometry: &Geometry) -> Instance {
        let rows = |m: Affine3A| {
            let (x, y, z, t) = (m.matrix3.x_axis, m.matrix3.y_axis, m.matrix3.z_axis, m.translation);
            [[x.x, y.x, z.x, t.x], [x.y, y.y, z.y, t.y], [x.z, y.z, z.z, t.z]]
        };
        Instance {
            object_to_world: rows(self.object_to_world),
            world_to_object: rows(self.object_to_world.inverse()),
            first_triangle: geometry.meshes[self.mesh as usize].first_triangle,
            mesh: self.mesh,
            identity: u32::from(self.object_to_world == Affine3A::IDENTITY),
            padding: 0,
        }
    }
}
