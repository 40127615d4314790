//! Free-form drawn geometry: Bézier patches and triangle soups.

use super::error::BuildError;
use glam::{Vec2, Vec3};

/// Control point of a patch.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PatchPoint {
    pub position: Vec3,
    pub uv: Vec2,
}

/// Grid of quadratic Bézier control points, row by row. Its front is where ∂u × ∂v points, u along a row, v from row to
/// row (as in the original game's maps).
#[derive(Clone, Debug, PartialEq)]
pub struct Patch {
    pub width: usize,
    pub height: usize,
    pub points: Vec<PatchPoint>,
}

impl Patch {
    /// The same surface with its front on the side of `target` (or away from it, if `away`).
    #[must_use]
    pub fn facing(mut self, target: Vec3, away: bool) -> Self {
        let normals = self.normals();
        let towards: f32 = (self.points.iter().zip(&normals))
            .map(|(p, n)| n.dot(target - p.position))
            .sum();
        if (towards < 0.0) != away {
            for row in self.points.chunks_mut(self.width) {
                row.reverse();
            }
        }
        self
    }

    /// Unit normals of the surface where each control point belongs. Where the surface is pinched there, those of a place
    /// beside it; straight up for a grid of the wrong size.
    pub fn normals(&self) -> Vec<Vec3> {
        // Part of a 3x3 piece's edge to step inwards from a pinched place.
        const INWARDS: f32 = 0.05;
        if self.check(0).is_err() {
            return vec![Vec3::Z; self.points.len()];
        }
        let mut normals = Vec::with_capacity(self.points.len());
        for y in 0..self.height {
            for x in 0..self.width {
                let corner = [(x & !1).min(self.width - 3), (y & !1).min(self.height - 3)];
                let at = [(x - corner[0]) as f32 * 0.5, (y - corner[1]) as f32 * 0.5];
                let beside = at.map(|t| t.clamp(INWARDS, 1.0 - INWARDS));
                let normal = self.normal_at(corner, at).or_else(|| self.normal_at(corner, beside));
                normals.push(normal.unwrap_or(Vec3::Z));
            }
        }
        normals
    }

    /// Normal at parameters `at` (u, v in 0..1) of the 3x3 piece that begins at control point `corner`; `None` where the
    /// tangents are parallel.
    fn normal_at(&self, corner: [usize; 2], at: [f32; 2]) -> Option<Vec3> {
        let weights = |t: f32| [(1.0 - t) * (1.0 - t), 2.0 * t * (1.0 - t), t * t];
        let slopes = |t: f32| [2.0 * t - 2.0, 2.0 - 4.0 * t, 2.0 * t];
        let sum = |across: [f32; 3], down: [f32; 3]| {
            let term = |i: usize| {
                let point = &self.points[(corner[1] + i / 3) * self.width + corner[0] + i % 3];
                point.position * (across[i % 3] * down[i / 3])
            };
            (0..9).map(term).sum::<Vec3>()
        };
        let du = sum(slopes(at[0]), weights(at[1]));
        let dv = sum(weights(at[0]), slopes(at[1]));
        let cross = du.cross(dv);
        let parallel = cross.length() <= 1e-3 * du.length() * dv.length();
        if parallel { None } else { cross.try_normalize() }
    }

    pub(super) fn check(&self, index: usize) -> Result<(), BuildError> {
        let odd = |n: usize| n >= 3 && n % 2 == 1;
        if odd(self.width) && odd(self.height) && self.points.len() == self.width * self.height {
            return Ok(());
        }
        Err(BuildError::PatchGrid {
            index,
            width: self.width,
            height: self.height,
            points: self.points.len(),
        })
    }
}

/// Vertex of a triangle soup. `normal` has unit length.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MeshVertex {
    pub position: Vec3,
    pub normal: Vec3,
    pub uv: Vec2,
}

/// Triangle soup. Triangles are counter-clockwise as seen from their front; the file gets Quake III's clockwise order.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Mesh {
    pub vertices: Vec<MeshVertex>,
    pub triangles: Vec<[u32; 3]>,
}

impl Mesh {
    /// Adds a flat-shaded triangle, corners counter-clockwise as seen from its front.
    pub fn flat_triangle(&mut self, corners: [Vec3; 3]) {
        let first = self.vertices.len() as u32;
        let [a, b, c] = corners;
        let normal = (b - a).cross(c - a).normalize_or(Vec3::Z);
        for (position, uv) in corners.into_iter().zip([Vec2::ZERO, Vec2::X, Vec2::Y]) {
            self.vertices.push(MeshVertex { position, normal, uv });
        }
        self.triangles.push([first, first + 1, first + 2]);
    }

    pub(super) fn check(&self, index: usize) -> Result<(), BuildError> {
        let count = self.vertices.len();
        match self.triangles.as_flattened().iter().find(|&&v| v as usize >= count) {
            Some(&vertex) => Err(BuildError::MeshIndex { index, vertex, count }),
            None => Ok(()),
        }
    }
}
