//! Triangles of curved surfaces: sweeping a box against one, by separating axes.

use super::Impact;
use super::brush::{GAP, Sweep};
use glam::DVec3;

/// A triangle that stops movement from both sides.
#[derive(Clone, Debug, PartialEq)]
pub struct Facet {
    pub corners: [DVec3; 3],
    pub contents: i32,
    pub surface_flags: i32,
}

/// Axes shorter than this are parallels crossed.
const LEAST_AXIS: f64 = 1e-9;

impl Facet {
    /// Bounds of the triangle.
    pub fn bounds(&self) -> (DVec3, DVec3) {
        let [a, b, c] = self.corners;
        (a.min(b).min(c), a.max(b).max(c))
    }

    /// Where a moving box meets the triangle. A box that touches it at the start is stopped only on the way further in, so that
    /// nothing sticks to it.
    pub fn meet(&self, sweep: &Sweep) -> Option<Impact> {
        let [a, b, c] = self.corners;
        let edges = [b - a, c - b, a - c];
        let way = sweep.end - sweep.start;
        let (mut enter, mut leave) = (f64::NEG_INFINITY, f64::INFINITY);
        let mut first = DVec3::ZERO;
        // Of a box that touches the triangle already: the way out that is shortest.
        let (mut depth, mut out) = (f64::INFINITY, DVec3::ZERO);
        let units = [DVec3::X, DVec3::Y, DVec3::Z];
        let crossed = edges.iter().flat_map(|e| units.map(|u| e.cross(u)));
        for axis in [edges[0].cross(edges[1])].into_iter().chain(units).chain(crossed) {
            let length = axis.length();
            if length <= LEAST_AXIS {
                continue;
            }
            let axis = axis / length;
            let on = self.corners.map(|p| axis.dot(p));
            let reach = axis.abs().dot(sweep.half);
            let low = on.into_iter().fold(f64::INFINITY, f64::min) - reach;
            let high = on.into_iter().fold(f64::NEG_INFINITY, f64::max) + reach;
            let (from, speed) = (axis.dot(sweep.start), axis.dot(way));
            // Outwards on the side where the box starts.
            let facing = if from - low < high - from { -axis } else { axis };
            let gap = f64::max(low - from, from - high);
            if -gap < depth {
                (depth, out) = (-gap, facing);
            }
            if speed == 0.0 {
                if gap > 0.0 {
                    return None;
                }
                continue;
            }
            let (near, far) = if speed > 0.0 { (low, high) } else { (high, low) };
            let (t0, t1) = ((near - from) / speed, (far - from) / speed);
            if t0 > enter {
                (enter, first) = (t0, if speed > 0.0 { -axis } else { axis });
            }
            leave = leave.min(t1);
            if enter > leave || leave < 0.0 {
                return None;
            }
        }
        let impact = |fraction: f64, normal: DVec3| Impact {
            fraction,
            normal,
            surface_flags: self.surface_flags,
            contents: self.contents,
        };
        if depth > 0.0 {
            return (way.dot(out) < 0.0).then(|| impact(0.0, out));
        }
        // Contact just beyond the end counts, too: what ends nearer than the gap would touch sooner or later.
        let at = enter - GAP / -way.dot(first);
        (at < 1.0).then(|| impact(at.max(0.0), first))
    }
}
