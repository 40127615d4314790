//! Mirrors and portals: where a view into one goes on. Counterpart of `shaders/include/portal.glsl`.

use super::primary::CameraRay;
use super::surface::{SurfaceHit, offset_point};
use crate::scene::Scene;
use glam::Vec3;

fn mapped(rows: &[[f32; 4]; 3], v: Vec3, w: f32) -> Vec3 {
    let row = |r: &[f32; 4]| r[0] * v.x + r[1] * v.y + r[2] * v.z + r[3] * w;
    Vec3::new(row(&rows[0]), row(&rows[1]), row(&rows[2]))
}

/// Where a ray that meets a portal's surface goes on.
pub fn go_through(scene: &Scene, surface: u32, at: &SurfaceHit, direction: Vec3) -> CameraRay {
    let camera = scene.portals.iter().find(|p| p.surface == surface && p.mirror == 0);
    match camera {
        Some(portal) => CameraRay {
            origin: mapped(&portal.there, at.position, 1.0),
            direction: mapped(&portal.there, direction, 0.0).normalize(),
        },
        None => {
            let n = at.geometric_normal;
            CameraRay {
                origin: offset_point(at.position, n),
                direction: (direction - n * (2.0 * n.dot(direction))).normalize(),
            }
        }
    }
}
