//! Spawn points and the views from them.

use super::camera::{Camera, EYE_HEIGHT};
use crate::assets::bsp::Bsp;
use crate::assets::entities::Entity;
use glam::Vec3;

/// Classes of entities that a player may start at.
const SPAWN_CLASSES: [&str; 6] = [
    "info_player_deathmatch",
    "info_player_start",
    "team_CTF_redplayer",
    "team_CTF_redspawn",
    "team_CTF_blueplayer",
    "team_CTF_bluespawn",
];

/// A place to start at.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Spawn {
    pub class: String,
    /// Entity origin, units.
    pub origin: [f32; 3],
    /// Degrees counter-clockwise from +x.
    pub angle: f32,
}

/// All spawn points in entity-lump order.
pub fn spawns(entities: &[Entity]) -> Vec<Spawn> {
    entities
        .iter()
        .filter(|e| SPAWN_CLASSES.iter().any(|c| c.eq_ignore_ascii_case(e.class())))
        .map(|e| Spawn {
            class: e.class().to_owned(),
            origin: e.origin().into(),
            angle: e.number("angle").unwrap_or(0.0),
        })
        .collect()
}

/// The view of a player standing at a spawn point.
pub fn view(spawn: &Spawn, fov: f32) -> Camera {
    Camera::new(Vec3::from(spawn.origin) + Vec3::Z * EYE_HEIGHT, spawn.angle, fov)
}

/// The view from the first spawn point, or an overview of a map without any.
pub fn first_view(spawns: &[Spawn], bsp: &Bsp, fov: f32) -> Camera {
    spawns
        .first()
        .map_or_else(|| overview(bsp, fov), |spawn| view(spawn, fov))
}

/// A view for maps without any spawn point: the middle of the bounds, moved into the nearest open leaf.
pub fn overview(bsp: &Bsp, fov: f32) -> Camera {
    let centre = bsp.world_bounds().centre();
    let middle = |leaf: &crate::assets::bsp::lumps::Leaf| {
        (Vec3::from(leaf.mins.map(|x| x as f32)) + Vec3::from(leaf.maxs.map(|x| x as f32))) * 0.5
    };
    let eye = if bsp.cluster_at(centre).is_some() {
        centre
    } else {
        bsp.leafs
            .iter()
            .filter(|l| l.cluster >= 0)
            .map(middle)
            .filter(|p| bsp.cluster_at(*p).is_some())
            .min_by(|a, b| a.distance_squared(centre).total_cmp(&b.distance_squared(centre)))
            .unwrap_or(centre)
    };
    Camera::new(eye, 0.0, fov)
}
