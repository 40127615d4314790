//! Entities that place geometry: brush models and items.

use super::clock::Clock;
use super::items::PlacedItem;
use super::models::Models;
use super::motion::{Moment, Motion, step};
use super::player::Part;
use super::records::{Instance, NONE, SEEN_BY_ALL};
use super::static_geometry::Mesh;
use crate::assets::bsp::Bsp;
use crate::assets::entities::Entity;
use glam::{Affine3A, Vec3};
use std::sync::Arc;

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
    /// Meshes that it is shown by when it is small, the most detailed first.
    pub less_detailed: Vec<u32>,
    /// Number of the entity that places it, or [`NONE`].
    pub entity: u32,
}

/// How an entity is otherwise than the map and the clock have it.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct EntityState {
    /// Its number in the map's list.
    pub entity: u32,
    /// How far it has moved, world space.
    pub offset: Vec3,
    /// It is not there.
    pub hidden: bool,
}

/// Instances as some entities' states have them, `now` and in the frame `before`.
pub fn apply(states: [&[EntityState]; 2], placements: &[Placement], records: &mut [Instance]) {
    let [now, before] = states;
    if now.is_empty() && before.is_empty() {
        return;
    }
    for (placement, record) in placements.iter().zip(records) {
        let of = |states: &[EntityState]| states.iter().find(|s| s.entity == placement.entity).copied();
        let (now, before) = (of(now), of(before));
        if placement.entity == NONE || (now.is_none() && before.is_none()) {
            continue;
        }
        let offset = |state: Option<EntityState>| state.map_or(Vec3::ZERO, |s| s.offset);
        let (shift, old) = (offset(now), offset(before));
        let back = record
            .world_to_object
            .map(|row| Vec3::new(row[0], row[1], row[2]).dot(shift));
        for axis in 0..3 {
            record.object_to_world[axis][3] += shift[axis];
            record.old_object_to_world[axis][3] += old[axis];
            record.world_to_object[axis][3] -= back[axis];
        }
        record.identity &= u32::from(shift == Vec3::ZERO);
        record.moves |= u32::from(shift != old);
        if now.is_some_and(|s| s.hidden) {
            record.seen_by = 0;
        }
    }
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
            less_detailed: Vec::new(),
            entity: NONE,
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
            less_detailed: Vec::new(),
            entity: NONE,
        }
    }
}

/// The world, then every brush model that an entity of the lump shows, in entity order.
pub fn placements(bsp: &Bsp, entities: &[Entity]) -> Vec<Placement> {
    let mut out = Vec::new();
    if !bsp.models.is_empty() {
        out.push(Placement::new(0, Motion::Still(Affine3A::IDENTITY)));
    }
    for (number, entity) in (0u32..).zip(entities) {
        let model = entity.get("model").and_then(|m| m.strip_prefix('*'));
        let Some(mesh) = model.and_then(|m| m.parse::<u32>().ok()) else {
            continue;
        };
        let Some(model) = bsp.models.get(mesh as usize).filter(|_| mesh != 0) else {
            continue;
        };
        let (mins, maxs) = (Vec3::from(model.mins), Vec3::from(model.maxs));
        out.push(Placement {
            entity: number,
            ..Placement::new(mesh, Motion::of_brush_model(entity, entities, mins, maxs))
        });
    }
    out
}

/// Where a mesh stands at the start, and how it moves from there.
#[derive(Clone, Debug)]
pub struct Standing {
    /// Mesh to world.
    pub pose: Affine3A,
    /// Of one that moves: its placement, and its poses relative to `pose`.
    pub mover: Option<(u32, Arc<[Affine3A]>)>,
}

/// Where each mesh stands first; `None` where no entity places it.
pub fn standings(placements: &[Placement], meshes: usize) -> Vec<Option<Standing>> {
    let mut first = vec![None; meshes];
    for (number, p) in (0u32..).zip(placements) {
        first[p.mesh as usize].get_or_insert_with(|| {
            let pose = p.pose(Clock::default());
            let back = pose.inverse();
            let sweep = || p.motion.sweep().into_iter().map(|at| at * back).collect();
            Standing {
                pose,
                mover: p.motion.may_move().then(|| (number, sweep())),
            }
        });
    }
    first
}

/// Where an item's models, which are meshes from `first` on, stand.
pub fn item_placements(item: &PlacedItem, numbers: [Option<u32>; 2], models: &Models, first: u32) -> Vec<Placement> {
    let place = |(i, number): (usize, Option<u32>)| {
        let number = number?;
        let less_detailed = models.less_detailed(number);
        Some(Placement {
            less_detailed: less_detailed.iter().map(|n| first + n).collect(),
            entity: item.number,
            ..Placement::new(first + number, item.motion(i == 1, models.middle(number)))
        })
    };
    numbers.into_iter().enumerate().filter_map(place).collect()
}

/// Share of the view's half width that a model's radius fills when it is first shown with less detail.
const FULL_DETAIL: f32 = 0.2;

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

    /// Levels of detail go down evenly from where the model fills [`FULL_DETAIL`] of the view to where it is a point: the
    /// original's rule. 0 is full detail. All rays of a frame meet the same.
    fn level_of_detail(&self, meshes: &[Mesh], pose: Affine3A, now: &Moment) -> usize {
        let levels = self.less_detailed.len() + 1;
        let Some(bias) = now.lod_bias.filter(|_| levels > 1) else {
            return 0;
        };
        let bounds = meshes[self.mesh as usize].bounds;
        let radius = bounds.min.abs().max(bounds.max.abs()).length();
        let distance = Vec3::from(pose.translation).distance(now.camera.eye.into());
        let half_width = distance * (now.camera.fov.to_radians() * 0.5).tan();
        let small = 1.0 - radius / (FULL_DETAIL * half_width).max(f32::MIN_POSITIVE);
        let level = (small.max(0.0) * levels as f32) as i32 + bias;
        level.clamp(0, levels as i32 - 1) as usize
    }

    /// The record that tracers read. `before`: the moment of the frame before.
    pub fn record(&self, meshes: &[Mesh], now: &Moment, before: &Moment) -> Instance {
        let pose = self.pose(*now);
        let mesh = match self.level_of_detail(meshes, pose, now) {
            0 => self.mesh + step(now.clock, self.step_rate, self.steps),
            level => self.less_detailed[level - 1],
        };
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
