//! Mirrors and portals: where a view into one of their surfaces goes on.

use super::material::MaterialSource;
use super::records::Portal;
use crate::assets::bsp::Bsp;
use crate::assets::entities::Entity;
use glam::{Affine3A, Mat3A, Quat, Vec3, Vec3A};

/// A portal's entity may stand this far off its surface's plane, units.
const REACH: f32 = 64.0;

/// A unit vector across another, as the game chooses it: from the axis that the vector follows least.
fn across(v: Vec3) -> Vec3 {
    let a = v.abs();
    let axis = if a.x <= a.y && a.x <= a.z {
        Vec3::X
    } else if a.y <= a.z {
        Vec3::Y
    } else {
        Vec3::Z
    };
    (axis - v * v.dot(axis)).normalize_or(Vec3::Z)
}

/// The view that a camera entity gives: its axes.
fn camera_axes(camera: &Entity, entities: &[Entity]) -> Mat3A {
    let target = camera.get("target").and_then(|name| {
        let named = |e: &&Entity| e.get("targetname") == Some(name);
        entities.iter().find(named)
    });
    let direction = match target {
        Some(target) => (target.origin() - camera.origin()).normalize_or(Vec3::X),
        None => {
            let angles = camera.vector("angles").unwrap_or(Vec3::ZERO);
            let yaw = camera.number("angle").unwrap_or(angles.y).to_radians();
            Quat::from_rotation_z(yaw) * Quat::from_rotation_y(angles.x.to_radians()) * Vec3::X
        }
    };
    let roll = camera.number("roll").unwrap_or(0.0).to_radians();
    let side = Quat::from_axis_angle(direction, roll) * -across(direction);
    Mat3A::from_cols(direction.into(), side.into(), direction.cross(side).into())
}

/// The portals of a map, one for each of their surfaces.
pub fn portals(bsp: &Bsp, entities: &[Entity], materials: &[MaterialSource]) -> Vec<Portal> {
    let places: Vec<&Entity> = entities.iter().filter(|e| e.class() == "misc_portal_surface").collect();
    let mut out = Vec::new();
    for (index, surface) in bsp.surfaces.iter().enumerate() {
        if !materials[surface.shader as usize].portal {
            continue;
        }
        let vertices =
            &bsp.vertices[surface.first_vertex as usize..(surface.first_vertex + surface.vertex_count) as usize];
        let [Some(a), Some(b), Some(c)] = [0, 1, 2].map(|i| vertices.get(i).map(|v| Vec3::from(v.position))) else {
            continue;
        };
        let mut normal = (b - a).cross(c - a).normalize_or(Vec3::X);
        if normal.dot(vertices[0].normal.into()) < 0.0 {
            normal = -normal;
        }
        let off = |e: &&&Entity| normal.dot(e.origin() - a).abs() <= REACH;
        let place = places.iter().filter(off).min_by(|p, q| {
            let far = |e: &Entity| e.origin().distance_squared(a);
            far(p).total_cmp(&far(q))
        });
        let camera = place.and_then(|p| p.get("target")).and_then(|name| {
            let named = |e: &&Entity| e.get("targetname") == Some(name);
            entities.iter().find(named)
        });
        let mut portal = Portal {
            surface: index as u32,
            mirror: 1,
            there: [[0.0; 4]; 3],
            back: [[0.0; 4]; 3],
        };
        if let (Some(place), Some(camera)) = (place, camera) {
            let side = across(normal);
            let own = Mat3A::from_cols(normal.into(), side.into(), normal.cross(side).into());
            let view = camera_axes(camera, entities);
            let view = Mat3A::from_cols(-view.x_axis, -view.y_axis, view.z_axis);
            // Into the surface's axes, out of the camera's.
            let turn = view * own.transpose();
            let origin = Vec3A::from(place.origin() - normal * normal.dot(place.origin() - a));
            let there = Affine3A {
                matrix3: turn,
                translation: Vec3A::from(camera.origin()) - turn * origin,
            };
            portal.mirror = 0;
            portal.there = super::entity_geometry::rows(there);
            portal.back = super::entity_geometry::rows(there.inverse());
        }
        out.push(portal);
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_vector_across_is_across() {
        for v in [Vec3::X, Vec3::new(0.3, -0.5, 0.81).normalize(), Vec3::NEG_Z] {
            assert!(across(v).dot(v).abs() < 1e-6 && (across(v).length() - 1.0).abs() < 1e-6);
        }
    }
}
