//! Convex brushes: sweeping a box against one, and whether a point is inside.

use super::Impact;
use glam::DVec3;

/// Moving things stop this far before what they meet, units.
pub const GAP: f64 = 0.125;

/// A side of a brush: what is behind all of them is inside.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Side {
    /// Unit length, out of the brush.
    pub normal: DVec3,
    pub dist: f64,
    pub surface_flags: i32,
}

/// A brush.
#[derive(Clone, Debug, PartialEq)]
pub struct Brush {
    pub contents: i32,
    pub sides: Vec<Side>,
}

/// A box on its way: `half` is half its size, `start` and `end` its middle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sweep {
    pub start: DVec3,
    pub end: DVec3,
    pub half: DVec3,
}

impl Sweep {
    /// Bounds of all that the box touches.
    pub fn bounds(&self) -> (DVec3, DVec3) {
        (
            self.start.min(self.end) - self.half,
            self.start.max(self.end) + self.half,
        )
    }
}

/// How a sweep and a brush meet.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Meeting {
    Apart,
    /// The box is in the brush at the start, and leaves it or does not.
    Inside {
        to_the_end: bool,
    },
    At(Impact),
}

impl Brush {
    /// Sides moved out by the box turn the sweep into a line (Minkowski's sum with an axial box; the edges between slanted sides
    /// are exact where the map's compiler has added bevels, as it does).
    pub fn meet(&self, sweep: &Sweep) -> Meeting {
        let (mut enter, mut leave) = (f64::NEG_INFINITY, 1.0);
        let mut first: Option<&Side> = None;
        let (mut starts_out, mut ends_out) = (false, false);
        for side in &self.sides {
            let reach = side.dist + side.normal.abs().dot(sweep.half);
            let from = side.normal.dot(sweep.start) - reach;
            let to = side.normal.dot(sweep.end) - reach;
            starts_out |= from > 0.0;
            ends_out |= to > 0.0;
            if from > 0.0 && (to >= GAP || to >= from) {
                return Meeting::Apart;
            }
            if from <= 0.0 && to <= 0.0 {
                continue;
            }
            if from > to {
                let at = ((from - GAP) / (from - to)).max(0.0);
                if at > enter {
                    (enter, first) = (at, Some(side));
                }
            } else {
                leave = f64::min(leave, ((from + GAP) / (from - to)).min(1.0));
            }
        }
        // Nonsense from a damaged map stops nobody.
        let sane = sweep.start.is_finite() && sweep.end.is_finite();
        if self.sides.is_empty() || !sane {
            return Meeting::Apart;
        }
        if !starts_out {
            return Meeting::Inside { to_the_end: !ends_out };
        }
        match first.filter(|_| enter < leave) {
            Some(side) => Meeting::At(Impact {
                fraction: enter,
                normal: side.normal,
                surface_flags: side.surface_flags,
                contents: self.contents,
            }),
            None => Meeting::Apart,
        }
    }

    /// Whether a point is inside.
    pub fn holds(&self, point: DVec3) -> bool {
        !self.sides.is_empty() && self.sides.iter().all(|s| s.normal.dot(point) <= s.dist)
    }
}
