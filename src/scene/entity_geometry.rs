//! Entities that place geometry: brush models and items.

use super::clock::Clock;
use super::items::PlacedItem;
use super::motion::Motion;
use super::records::Instance;
use super::static_geometry::Mesh;
use crate::assets::bsp::Bsp;
use crate::assets::entities::Entity;
use glam::{Affine3A, Vec3};

/// A mesh standing or moving somewhere in the world.
#[derive(Clone, Debug, PartialEq)]
pub struct Placement {
    pub mesh: u32,
    pub motion: Motion,
}

/// The world, then every brush model that an entity of the lump shows, in entity order.
pub fn placements(bsp: &Bsp, entities: &[Entity]) -> Vec<Placement> {
    let mut out = Vec::new();
    if !bsp.models.is_empty() {
        out.push(Placement {
            mesh: 0,
            motion: Motion::Still(Affine3A::IDENTITY),
        });
    }
    for entity in entities {
        let model = entity.get("model").and_then(|m| m.strip_prefix('*'));
        let Some(mesh) = model.and_then(|m| m.parse::<u32>().ok()) else {
            continue;
        };
        let Some(model) = bsp.models.get(mesh as usize).filter(|_| mesh != 0) else {
            continue;
        };
        let (mins, maxs) = (Vec3::from(model.mins), Vec3::from(model.maxs));
        out.push(Placement {
            mesh,
            motion: Motion::of_brush_model(entity, entities, mins, maxs),
        });
    }
    out
}

/// Where an item's models stand; `meshes` are theirs, `middles` the middles of their boxes.
pub fn item_placements(item: &PlacedItem, meshes: [Option<u32>; 2], middles: [Vec3; 2]) -> Vec<Placement> {
    (0..2)
        .filter_map(|i| {
            Some(Placement {
                mesh: meshes[i]?,
                motion: item.motion(i == 1, middles[i]),
            })
        })
        .collect()
}

/// An affine map as three rows of four.
pub fn rows(m: Affine3A) -> [[f32; 4]; 3] {
    let (x, y, z, t) = (m.matrix3.x_axis, m.matrix3.y_axis, m.matrix3.z_axis, m.translation);
    [[x.x, y.x, z.x, t.x], [x.y, y.y, z.y, t.y], [x.z, y.z, z.z, t.z]]
}

impl Placement {
    /// Mesh to world at a moment.
    pub fn pose(&self, clock: Clock) -> Affine3A {
        self.motion.pose(clock)
    }

    /// The record that tracers read. `before`: the moment of the frame before.
    pub fn record(&self, meshes: &[Mesh], clock: Clock, before: Clock) -> Instance {
        let pose = self.pose(clock);
        Instance {
            object_to_world: rows(pose),
            world_to_object: rows(pose.inverse()),
            old_object_to_world: rows(self.pose(before)),
            first_triangle: meshes[self.mesh as usize].first_triangle,
            mesh: self.mesh,
            identity: u32::from(pose == Affine3A::IDENTITY),
            moves: u32::from(self.motion.moves()),
        }
    }
}
