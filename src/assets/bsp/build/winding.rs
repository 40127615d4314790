//! Convex polygons in double precision, for the visibility computation.

use glam::DVec3;

/// Half-thickness of planes, units: what lies closer counts as on the plane. Windows narrower than this are closed.
pub const EPSILON: f64 = 1e-6;

/// Plane n·x = d with unit normal.
#[derive(Clone, Copy, Debug)]
pub struct Plane {
    pub normal: DVec3,
    pub dist: f64,
}

impl Plane {
    /// Signed distance, positive in front.
    pub fn height(&self, point: DVec3) -> f64 {
        self.normal.dot(point) - self.dist
    }

    /// The plane turned over.
    pub fn flipped(self) -> Self {
        Self {
            normal: -self.normal,
            dist: -self.dist,
        }
    }
}

/// The part of a convex polygon in front of a plane; `None` where nothing with area is.
pub fn clip(polygon: &[DVec3], plane: &Plane) -> Option<Vec<DVec3>> {
    let heights: Vec<f64> = polygon.iter().map(|&p| plane.height(p)).collect();
    if heights.iter().all(|&h| h <= EPSILON) {
        return None;
    }
    if heights.iter().all(|&h| h >= -EPSILON) {
        return Some(polygon.to_vec());
    }
    let mut out = Vec::with_capacity(polygon.len() + 2);
    for (i, &p) in polygon.iter().enumerate() {
        let j = (i + 1) % polygon.len();
        let (hp, hq) = (heights[i], heights[j]);
        if hp >= -EPSILON {
            out.push(p);
        }
        if (hp > EPSILON && hq < -EPSILON) || (hp < -EPSILON && hq > EPSILON) {
            out.push(p + (polygon[j] - p) * (hp / (hp - hq)));
        }
    }
    (out.len() >= 3).then_some(out)
}

/// Clips `target` to what lines through `source` and then `pass` can reach. With `beyond_source`, `target` lies on the
/// far side of `source` instead (the lines run `pass`, `source`, `target`).
///
/// Every plane through an edge of `source` and a corner of `pass` that has all of `source` on one side and all of `pass`
/// on the other separates them: no such line crosses it twice.
pub fn clip_to_separators(
    source: &[DVec3],
    pass: &[DVec3],
    target: Vec<DVec3>,
    beyond_source: bool,
) -> Option<Vec<DVec3>> {
    let mut target = target;
    for (i, &start) in source.iter().enumerate() {
        let edge = source[(i + 1) % source.len()] - start;
        for &corner in pass {
            let Some(normal) = edge.cross(corner - start).try_normalize() else {
                continue;
            };
            let plane = Plane {
                normal,
                dist: normal.dot(start),
            };
            let Some(separator) = orient(plane, source, pass) else {
                continue;
            };
            let kept = if beyond_source { separator.flipped() } else { separator };
            target = clip(&target, &kept)?;
        }
    }
    Some(target)
}

/// The plane turned so that `source` lies behind and `pass` in front; `None` where it does not separate the two.
fn orient(plane: Plane, source: &[DVec3], pass: &[DVec3]) -> Option<Plane> {
    let side = source.iter().map(|&p| plane.height(p)).find(|h| h.abs() > EPSILON)?;
    let plane = if side > 0.0 { plane.flipped() } else { plane };
    let behind = source.iter().all(|&p| plane.height(p) <= EPSILON);
    let in_front = pass.iter().all(|&p| plane.height(p) >= -EPSILON);
    let off_plane = pass.iter().any(|&p| plane.height(p) > EPSILON);
    (behind && in_front && off_plane).then_some(plane)
}
