//! Patches for arches, columns and rounded edges.

use super::drawn::{Patch, PatchPoint};
use glam::{Vec2, Vec3};

/// A profile of quadratic arcs (3, 5, 7… control points) swept along a straight line. The texture repeats every `units`
/// along both; which side is the front is left to [`Patch::facing`].
pub fn sweep(profile: &[Vec3], along: Vec3, units: f32) -> Patch {
    let mut lengths = vec![0.0; profile.len()];
    for i in 1..profile.len() {
        lengths[i] = lengths[i - 1] + profile[i].distance(profile[i - 1]);
    }
    let points = [0.0, 0.5, 1.0].iter().flat_map(|&t| {
        profile.iter().zip(&lengths).map(move |(&p, &length)| PatchPoint {
            position: p + along * t,
            uv: Vec2::new(length, -along.length() * t) / units,
        })
    });
    Patch {
        width: profile.len(),
        height: 3,
        points: points.collect(),
    }
}

/// A round column standing on `base`, drawn on the outside. The texture repeats a whole number of times around it, about
/// every `units`.
pub fn column(base: Vec3, radius: f32, height: f32, units: f32) -> Patch {
    const RING: [(f32, f32); 9] = [
        (1., 0.),
        (1., 1.),
        (0., 1.),
        (-1., 1.),
        (-1., 0.),
        (-1., -1.),
        (0., -1.),
        (1., -1.),
        (1., 0.),
    ];
    let repeats = (std::f32::consts::TAU * radius / units).round().max(1.0);
    let profile: Vec<Vec3> = RING
        .iter()
        .map(|&(x, y)| base + Vec3::new(x, y, 0.0) * radius)
        .collect();
    let mut patch = sweep(&profile, Vec3::Z * height, units);
    for (i, point) in patch.points.iter_mut().enumerate() {
        point.uv.x = repeats * (i % 9) as f32 / 8.0;
    }
    patch
}

/// Control points of a half-ellipse from `left` over the top to `right`, rising by `rise`.
fn half_ellipse(left: Vec3, right: Vec3, rise: Vec3) -> [Vec3; 5] {
    let middle = (left + right) * 0.5;
    [left, left + rise, middle + rise, right + rise, right]
}

/// The underside of an arch: a half-ellipse between two springing points, `rise` high, `depth` deep.
pub fn arch(left: Vec3, right: Vec3, rise: f32, depth: Vec3, units: f32) -> Patch {
    let profile = half_ellipse(left, right, Vec3::Z * rise);
    sweep(&profile, depth, units).facing((left + right + depth) * 0.5, false)
}

/// The two flat pieces that fill the corners above an arch in its rectangular opening, facing `normal`.
pub fn spandrels(left: Vec3, right: Vec3, rise: f32, normal: Vec3, units: f32) -> [Patch; 2] {
    let arc = half_ellipse(left, right, Vec3::Z * rise);
    let across = (right - left).normalize_or(Vec3::X);
    let piece = |from: [Vec3; 3]| {
        let corner = from[1];
        let points = (0..9).map(|i| {
            let position = from[i % 3].lerp(corner, (i / 3) as f32 * 0.5);
            PatchPoint {
                position,
                uv: Vec2::new(position.dot(across), -position.z) / units,
            }
        });
        let patch = Patch {
            width: 3,
            height: 3,
            points: points.collect(),
        };
        patch.facing(corner + normal * 64.0, false)
    };
    [piece([arc[0], arc[1], arc[2]]), piece([arc[2], arc[3], arc[4]])]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_face_out_and_arches_down() {
        let shaft = column(Vec3::ZERO, 10.0, 50.0, 16.0);
        for (point, normal) in shaft.points.iter().zip(shaft.normals()) {
            assert!(normal.dot(point.position.with_z(0.0)) > 0.0);
        }
        let soffit = arch(Vec3::ZERO, Vec3::X * 20.0, 10.0, Vec3::Y * 8.0, 16.0);
        assert!(soffit.normals()[2].z < -0.9, "the crown looks down");
    }

    #[test]
    fn spandrels_face_as_told() {
        for patch in spandrels(Vec3::ZERO, Vec3::X * 20.0, 10.0, Vec3::NEG_Y, 16.0) {
            assert!(patch.normals().iter().all(|n| n.abs_diff_eq(Vec3::NEG_Y, 1e-5)));
        }
    }
}
