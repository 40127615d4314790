//! Places from which a map's materials can be seen well, found by looking: for pictures of every feature.

use super::surface::drawn;
use super::trace::{Tracer, point_to_world};
use crate::scene::Scene;
use crate::scene::clusters::cluster_at;
use crate::scene::features::materials_by_feature;
use crate::scene::records::MATERIAL_BACK;
use glam::{Vec2, Vec3};
use serde::Serialize;
use std::collections::BTreeMap;

/// Triangles of a material that are tried, the largest ones.
const TRIED: usize = 48;
/// Distances to stand at, units, the best first.
const DISTANCES: [f32; 6] = [192.0, 128.0, 288.0, 96.0, 64.0, 420.0];
/// Heights of the eye over the point, as a share of the distance: within a level view 90 degrees wide.
const SLOPES: [f32; 5] = [0.2, 0.0, -0.2, 0.4, -0.4];
/// Directions to look in.
const TURNS: u32 = 16;
/// Room that an eye needs, units.
const ROOM: f32 = 12.0;
/// Least cosine to the surface's normal.
const LEAST_COSINE: f32 = 0.15;

/// A level view of a surface.
#[derive(Clone, Debug, Serialize)]
pub struct FeatureView {
    pub feature: &'static str,
    pub material: String,
    /// World, units.
    pub eye: [f32; 3],
    /// Degrees counter-clockwise from +x.
    pub yaw: f32,
    /// Where the surface is in a view 90 degrees wide: right and up, −1..1 over the width.
    pub at: [f32; 2],
}

/// A triangle in the world.
#[derive(Clone, Copy)]
struct Target {
    centre: Vec3,
    normal: Vec3,
    area: f32,
    material: u32,
    two_sided: bool,
}

/// The largest triangles of each material.
fn targets(scene: &Scene, tracer: &Tracer) -> BTreeMap<u32, Vec<Target>> {
    let mut out: BTreeMap<u32, Vec<Target>> = BTreeMap::new();
    for instance in &tracer.instances {
        let mesh = &scene.geometry.meshes[instance.mesh as usize];
        for t in mesh.first_triangle..mesh.first_triangle + mesh.triangle_count {
            let [a, b, c] = tracer.corners(scene, t).map(|p| point_to_world(instance, p));
            let cross = (b - a).cross(c - a);
            let area = cross.length() * 0.5;
            if area > 0.0 {
                let material = scene.geometry.triangles[t as usize].material;
                out.entry(material).or_default().push(Target {
                    centre: (a + b + c) / 3.0,
                    normal: cross / (2.0 * area),
                    area,
                    material,
                    two_sided: scene.materials[material as usize].flags & MATERIAL_BACK != 0,
                });
            }
        }
    }
    for list in out.values_mut() {
        list.sort_by(|a, b| b.area.total_cmp(&a.area));
        list.truncate(TRIED);
    }
    out
}

/// Whether an eye has room around it.
fn roomy(scene: &Scene, tracer: &Tracer, eye: Vec3) -> bool {
    cluster_at(&scene.bsp_nodes, eye).is_some()
        && [Vec3::X, -Vec3::X, Vec3::Y, -Vec3::Y, Vec3::Z, -Vec3::Z]
            .iter()
            .all(|d| tracer.closest(scene, eye, *d, f64::from(ROOM)).is_none())
}

/// Whether a ray from an eye meets the target's material first.
fn meets(scene: &Scene, tracer: &Tracer, eye: Vec3, target: &Target) -> bool {
    let to = target.centre - eye;
    let (direction, length) = (to.normalize(), to.length());
    let mut after = None;
    while let Some(hit) = tracer.next(scene, eye, direction, f64::from(length) + 1.0, after) {
        let material = scene.geometry.triangles[hit.triangle as usize].material;
        let place = super::surface::point_at(scene, tracer, &hit, direction);
        let front = place.normal.dot(direction) <= 0.0;
        if drawn(&scene.materials[material as usize], front) {
            return material == target.material && (hit.t as f32 - length).abs() < 0.1 * length;
        }
        after = Some(hit);
    }
    false
}

fn view_of(scene: &Scene, tracer: &Tracer, target: &Target) -> Option<(Vec3, f32, Vec2)> {
    for distance in DISTANCES {
        for slope in SLOPES {
            for turn in 0..TURNS {
                // Looking against the normal first.
                let half = (turn as f32 / 2.0).ceil() * if turn % 2 == 0 { 1.0 } else { -1.0 };
                let base = (-target.normal.y).atan2(-target.normal.x);
                let yaw = base + half * std::f32::consts::TAU / TURNS as f32;
                let forward = Vec3::new(yaw.cos(), yaw.sin(), 0.0);
                let eye = target.centre - forward * distance + Vec3::Z * (slope * distance);
                let cosine = target.normal.dot((eye - target.centre).normalize());
                let faces = cosine > LEAST_COSINE || (target.two_sided && cosine < -LEAST_COSINE);
                if faces && roomy(scene, tracer, eye) && meets(scene, tracer, eye, target) {
                    return Some((eye, yaw.to_degrees(), Vec2::new(0.0, -slope)));
                }
            }
        }
    }
    None
}

/// One view of each feature that the map's materials have, where one is found.
pub fn feature_views(scene: &Scene) -> Vec<FeatureView> {
    let tracer = Tracer::new(scene);
    let targets = targets(scene, &tracer);
    let mut found = BTreeMap::new();
    let mut out = Vec::new();
    for (feature, materials) in materials_by_feature(scene) {
        let view = materials.iter().find_map(|&m| {
            let view = *found.entry(m).or_insert_with(|| {
                let list = targets.get(&m)?;
                list.iter().find_map(|t| view_of(scene, &tracer, t))
            });
            view.map(|v| (m, v))
        });
        if let Some((m, (eye, yaw, at))) = view {
            out.push(FeatureView {
                feature,
                material: scene.material_sources[m as usize].name.clone(),
                eye: eye.into(),
                yaw,
                at: at.into(),
            });
        }
    }
    out
}
