//! Point location and leaf enumeration in the BSP tree.

use super::file::Bsp;
use super::lumps::Leaf;
use glam::Vec3;

/// Distance within which a point counts as lying on a plane, units: more than rounding, less than any detail.
const ON_PLANE: f32 = 1.0 / 64.0;

/// Axis-aligned box in world units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounds {
    pub min: Vec3,
    pub max: Vec3,
}

impl Bounds {
    /// Contains nothing; grows with [`Bounds::include`].
    pub const EMPTY: Self = Self {
        min: Vec3::INFINITY,
        max: Vec3::NEG_INFINITY,
    };

    /// Grows to hold `point`.
    pub fn include(&mut self, point: Vec3) {
        self.min = self.min.min(point);
        self.max = self.max.max(point);
    }

    /// The smallest box around both.
    pub fn union(self, other: Self) -> Self {
        Self {
            min: self.min.min(other.min),
            max: self.max.max(other.max),
        }
    }

    /// Middle of the box.
    pub fn centre(self) -> Vec3 {
        (self.min + self.max) * 0.5
    }

    /// The box grown by `by` units on every side.
    pub fn grown(self, by: f32) -> Self {
        Self {
            min: self.min - by,
            max: self.max + by,
        }
    }

    /// Largest distance between a point of one box and a point of the other's nearest corner: the gap between boxes.
    pub fn gap(self, other: Self) -> f32 {
        (self.min - other.max)
            .max(other.min - self.max)
            .max(Vec3::ZERO)
            .length()
    }
}

impl Bsp {
    /// Index of the leaf that holds `point`; `None` for a map without leaves.
    pub fn leaf_at(&self, point: Vec3) -> Option<usize> {
        if self.leafs.is_empty() {
            return None;
        }
        if self.nodes.is_empty() {
            return Some(0);
        }
        let mut at = 0i32;
        while at >= 0 {
            let node = &self.nodes[at as usize];
            let plane = &self.planes[node.plane as usize];
            let side = Vec3::from(plane.normal).dot(point) - plane.dist;
            at = node.children[usize::from(side < 0.0)];
        }
        Some((-1 - at) as usize)
    }

    /// Cluster of the leaf that holds `point`; `None` in solid.
    pub fn cluster_at(&self, point: Vec3) -> Option<u32> {
        self.leaf_at(point)
            .and_then(|leaf| u32::try_from(self.leafs[leaf].cluster).ok())
    }

    /// Calls `visit` with every leaf that the box touches.
    pub fn leafs_in_box(&self, bounds: Bounds, mut visit: impl FnMut(usize)) {
        if self.nodes.is_empty() {
            if !self.leafs.is_empty() {
                visit(0);
            }
            return;
        }
        let (centre, half) = (bounds.centre(), (bounds.max - bounds.min) * 0.5);
        let mut stack = vec![0i32];
        while let Some(at) = stack.pop() {
            if at < 0 {
                visit((-1 - at) as usize);
                continue;
            }
            let node = &self.nodes[at as usize];
            let plane = &self.planes[node.plane as usize];
            let normal = Vec3::from(plane.normal);
            let side = normal.dot(centre) - plane.dist;
            let reach = normal.abs().dot(half);
            if side >= -reach {
                stack.push(node.children[0]);
            }
            if side <= reach {
                stack.push(node.children[1]);
            }
        }
    }

    /// Calls `visit` with every leaf that the triangle touches; a few beside it may be among them.
    pub fn leafs_at_triangle(&self, corners: [Vec3; 3], mut visit: impl FnMut(usize)) {
        if self.nodes.is_empty() {
            if !self.leafs.is_empty() {
                visit(0);
            }
            return;
        }
        let mut bounds = Bounds::EMPTY;
        corners.into_iter().for_each(|p| bounds.include(p));
        let meets = |leaf: &Leaf| {
            // Leaf bounds are whole numbers in the file.
            let (min, max) = (leaf.mins.map(|x| x as f32 - 1.0), leaf.maxs.map(|x| x as f32 + 1.0));
            bounds.max.cmpge(min.into()).all() && bounds.min.cmple(max.into()).all()
        };
        let mut stack = vec![0i32];
        while let Some(at) = stack.pop() {
            if at < 0 {
                let leaf = (-1 - at) as usize;
                if meets(&self.leafs[leaf]) {
                    visit(leaf);
                }
                continue;
            }
            let node = &self.nodes[at as usize];
            let plane = &self.planes[node.plane as usize];
            let sides = corners.map(|p| Vec3::from(plane.normal).dot(p) - plane.dist);
            if sides.iter().any(|&s| s >= -ON_PLANE) {
                stack.push(node.children[0]);
            }
            if sides.iter().any(|&s| s <= ON_PLANE) {
                stack.push(node.children[1]);
            }
        }
    }

    /// Number of PVS clusters: what the visibility lump says, or else the largest number any leaf names.
    pub fn cluster_count(&self) -> u32 {
        let named = self.leafs.iter().map(|l| l.cluster + 1).max().unwrap_or(0).max(0) as u32;
        self.visibility.as_ref().map_or(named, |v| v.cluster_count)
    }

    /// Bounds of the world model; of the vertices where there is no model.
    pub fn world_bounds(&self) -> Bounds {
        if let Some(m) = self.models.first() {
            let b = Bounds {
                min: m.mins.into(),
                max: m.maxs.into(),
            };
            if b.min.is_finite() && b.max.is_finite() && b.min.cmple(b.max).all() {
                return b;
            }
        }
        let mut b = Bounds::EMPTY;
        for v in &self.vertices {
            b.include(v.position.into());
        }
        if self.vertices.is_empty() {
            b = Bounds {
                min: Vec3::ZERO,
                max: Vec3::ZERO,
            };
        }
        b
    }
}
