//! Entities that place geometry: brush models and items.

use super::items::PlacedItem;
use super::motion::{Moment, Motion, step};
use super::player::Part;
use super::records::{Instance, SEEN_BY_ALL};
use super::static_geometry::Mesh;
use crate::assets::bsp::Bsp;
use crate::assets::entities::Entity;
use glam::{Affine3A, Vec3};

/// A mesh standing or moving somewhere in the world.
#[derive(Clone, Debug, PartialEq)]
pub struct Placement {
    /// Its first step's mesh; those of others follow.
    pub mesh: u32,
    pub steps: u32,
    /// Rounds of all steps: [`super::clock`].
    pub step_rate: u32,
    pub motion: Motion,
    /// Rays that meet it: `SEEN_BY_…`.
    pub seen_by: u32,
}

impl Placement {
    /// A mesh that keeps its form and is seen by all rays.
    pub fn new(mesh: u32, motion: Motion) -> Self {
        Self {
            mesh,
            steps: 1,
            step_rate: 0,
            motion,
            seen_by: SEEN_BY_ALL,
        }
    }

    /// A part of the player, whose models begin at mesh `first`.
    pub fn of_player(part: Part, first: u32) -> Self {
        Self {
            mesh: first + part.model,
            steps: part.steps,
            step_rate: part.rate,
            motion: part.motion,
            seen_by: part.seen_by,
        }
    }
}

/// The world, then every brush model that an entity of the lump shows, in entity order.
pub fn placements(bsp: &Bsp, entities: &[Entity]) -> Vec<Placement> {
    let mut out = Vec::new();
    if !bsp.models.is_empty() {
        out.push(Placement::new(0, Motion::Still(Affine3A::IDENTITY)));
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
        out.push(Placement::new(
            mesh,
            Motion::of_brush_model(entity, entities, mins, maxs),
        ));
    }
    out
}

/// Where an item's models stand; `meshes` are theirs, `middles` the middles of their boxes.
pub fn item_placements(item: &PlacedItem, meshes: [Option<u32>; 2], middles: [Vec3; 2]) -> Vec<Placement> {
    (0..2)
        .filter_map(|i| Some(Placement::new(meshes[i]?, item.motion(i == 1, middles[i]))))
        .collect()
}

/// An affine map as three rows of four.
pub fn rows(m: Affine3A) -> [[f32; 4]; 3] {
    let (x, y, z, t) = (m.matrix3.x_axis, m.matrix3.y_axis, m.matrix3.z_axis, m.translation);
    [[x.x, y.x, z.x, t.x], [x.y, y.y, z.y, t.y], [x.z, y.z, z.z, t.z]]
}

impl Placement {
    /// Mesh to world at a moment.
    pub fn pose(&self, moment: impl Into<Moment>) -> Affine3A {
        self.motion.pose(moment)
    }

    /// The record that tracers read. `before`: the moment of the frame before.
    pub fn record(&self, meshes: &[Mesh], now: &Moment, before: &Moment) -> Instance {
        let pose = self.pose(*now);
        let mesh = self.mesh + step(now.clock, self.step_rate, self.steps);
        let hidden = matches!(self.motion, Motion::View(_)) && !now.draw_gun;
        Instance {
            object_to_world: rows(pose),
            world_to_object: rows(pose.inverse()),
            old_object_to_world: rows(self.pose(*before)),
            first_triangle: meshes[mesh as usize].first_triangle,
            mesh,
            identity: u32::from(pose == Affine3A::IDENTITY),
            moves: u32::from(self.motion.moves()),
            seen_by: if hidden { 0 } else { self.seen_by },
        }
    }
}
