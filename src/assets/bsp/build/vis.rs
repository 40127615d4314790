//! The potentially visible set, found by following lines through sequences of portals.
//!
//! Cells are convex and empty as far as this goes (solids within them are ignored), so a cell sees another where a
//! straight line runs through a sequence of portals between them. The sequences are walked depth first; what a line from
//! the first portal can reach of the next one is found by clipping with separating planes, as id's vis does, against
//! *every* portal passed before and back again onto the first. Clipping only takes away what no line reaches, so the set
//! is conservative; what two flows in opposite directions do not agree on is taken out, as either alone is conservative.

use super::shape::{Bounds, plane_axes};
use super::winding::{Plane, clip, clip_to_separators};
use crate::assets::bsp::visibility::Visibility;
use glam::DVec3;

/// Portals followed from one first portal before giving up and calling everything reachable visible.
const STEP_LIMIT: u64 = 2_000_000;

/// Rectangle between two cells.
pub struct Portal {
    pub cells: [usize; 2],
    pub rect: Bounds,
    /// Axis that the rectangle is perpendicular to; `cells[0]` lies below it.
    pub axis: usize,
}

/// A portal as seen from the cell that one leaves through it.
struct Exit {
    into: usize,
    winding: Vec<DVec3>,
    /// Points into the cell that is entered.
    plane: Plane,
}

struct Flow<'a> {
    exits: &'a [Vec<Exit>],
    seen: Vec<bool>,
    path: Vec<usize>,
    passes: Vec<Vec<DVec3>>,
    steps: u64,
}

/// The visibility of `cell_count` cells joined by portals.
pub fn visibility(cell_count: usize, portals: &[Portal]) -> Visibility {
    let exits = exits(cell_count, portals);
    let row_bytes = cell_count.div_ceil(64) * 8;
    let mut rows = vec![0_u8; cell_count * row_bytes];
    for cell in 0..cell_count {
        let mut flow = Flow {
            exits: &exits,
            seen: vec![false; cell_count],
            path: vec![cell],
            passes: Vec::new(),
            steps: 0,
        };
        flow.seen[cell] = true;
        for first in &exits[cell] {
            flow.steps = 0;
            flow.path.push(first.into);
            flow.follow(&first.winding, &first.plane, first.into);
            flow.path.pop();
        }
        for (to, _) in flow.seen.iter().enumerate().filter(|(_, seen)| **seen) {
            rows[cell * row_bytes + to / 8] |= 1 << (to % 8);
        }
    }
    let sees = |rows: &[u8], a: usize, b: usize| rows[a * row_bytes + b / 8] >> (b % 8) & 1 == 1;
    for a in 0..cell_count {
        for b in 0..cell_count {
            if sees(&rows, a, b) && !sees(&rows, b, a) {
                rows[a * row_bytes + b / 8] &= !(1 << (b % 8));
            }
        }
    }
    Visibility {
        cluster_count: cell_count as u32,
        row_bytes: row_bytes as u32,
        rows,
    }
}

fn exits(cell_count: usize, portals: &[Portal]) -> Vec<Vec<Exit>> {
    let mut exits: Vec<Vec<Exit>> = (0..cell_count).map(|_| Vec::new()).collect();
    for portal in portals {
        let [u, v] = plane_axes(portal.axis);
        let (mins, maxs) = (portal.rect.mins.as_dvec3(), portal.rect.maxs.as_dvec3());
        let winding = [(false, false), (true, false), (true, true), (false, true)].map(|(at_u, at_v)| {
            let mut corner = mins;
            corner[u] = if at_u { maxs[u] } else { mins[u] };
            corner[v] = if at_v { maxs[v] } else { mins[v] };
            corner
        });
        let mut normal = DVec3::ZERO;
        normal[portal.axis] = 1.0;
        let up = Plane {
            normal,
            dist: mins[portal.axis],
        };
        let [below, above] = portal.cells;
        for (from, into, plane) in [(below, above, up), (above, below, up.flipped())] {
            exits[from].push(Exit {
                into,
                winding: winding.to_vec(),
                plane,
            });
        }
    }
    exits
}

impl Flow<'_> {
    /// Marks `cell` and goes on through its portals. `source` is what is left of the first portal on this path.
    fn follow(&mut self, source: &[DVec3], source_plane: &Plane, cell: usize) {
        self.seen[cell] = true;
        self.steps += 1;
        if self.steps == STEP_LIMIT {
            self.flood();
        }
        if self.steps >= STEP_LIMIT {
            return;
        }
        let exits = self.exits;
        for exit in &exits[cell] {
            // A line meets a convex cell once.
            if self.path.contains(&exit.into) {
                continue;
            }
            if let Some((source, pass)) = self.narrow(source, source_plane, exit) {
                self.path.push(exit.into);
                self.passes.push(pass);
                self.follow(&source, source_plane, exit.into);
                self.passes.pop();
                self.path.pop();
            }
        }
    }

    /// What lines through the portals so far and `exit` leave of the first portal and of `exit`.
    fn narrow(&self, source: &[DVec3], source_plane: &Plane, exit: &Exit) -> Option<(Vec<DVec3>, Vec<DVec3>)> {
        // Lines run forwards through both: no line leaves through a portal in the plane it came in by.
        let mut pass = clip(&exit.winding, source_plane)?;
        let mut source = clip(source, &exit.plane.flipped())?;
        for before in &self.passes {
            pass = clip_to_separators(&source, before, pass, false)?;
            pass = clip_to_separators(before, &source, pass, true)?;
        }
        for before in &self.passes {
            source = clip_to_separators(&pass, before, source, false)?;
            source = clip_to_separators(before, &pass, source, true)?;
        }
        Some((source, pass))
    }

    fn flood(&mut self) {
        let mut open = self.path.clone();
        let mut reached = vec![false; self.exits.len()];
        while let Some(cell) = open.pop() {
            if !std::mem::replace(&mut reached[cell], true) {
                self.seen[cell] = true;
                open.extend(self.exits[cell].iter().map(|exit| exit.into));
            }
        }
    }
}
