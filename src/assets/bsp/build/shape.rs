//! Integer boxes and their faces: all that cells, solids and portals are made of.
//!
//! Whole-number coordinates keep the tree, the cuts and the contacts exact (node and leaf bounds are whole in the file).

use glam::{IVec3, Vec3};
use std::fmt;

/// Axis-aligned box, Quake units. A *rectangle* is a box without extent along one axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Bounds {
    pub mins: IVec3,
    pub maxs: IVec3,
}

/// Side of a box, in the order of a brush's first six sides.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[repr(usize)]
pub enum Face {
    MinX,
    MaxX,
    MinY,
    MaxY,
    MinZ,
    MaxZ,
}

impl Face {
    /// All faces in brush-side order: −x +x −y +y −z +z.
    pub const ALL: [Face; 6] = [Face::MinX, Face::MaxX, Face::MinY, Face::MaxY, Face::MinZ, Face::MaxZ];

    /// 0, 1, 2 for x, y, z.
    pub fn axis(self) -> usize {
        self as usize / 2
    }

    /// Whether the face is the box's upper bound along its axis.
    pub fn is_max(self) -> bool {
        self as usize % 2 == 1
    }

    /// The same axis, other end.
    pub fn opposite(self) -> Face {
        Face::ALL[self as usize ^ 1]
    }

    /// Unit normal pointing out of the box.
    pub fn normal(self) -> Vec3 {
        let mut n = Vec3::ZERO;
        n[self.axis()] = if self.is_max() { 1.0 } else { -1.0 };
        n
    }

    /// Name used in messages.
    pub fn name(self) -> &'static str {
        ["-x", "+x", "-y", "+y", "-z", "+z"][self as usize]
    }
}

impl Bounds {
    /// Box from its least to its greatest corner.
    pub const fn new(mins: [i32; 3], maxs: [i32; 3]) -> Self {
        Self {
            mins: IVec3::from_array(mins),
            maxs: IVec3::from_array(maxs),
        }
    }

    /// Whether the box lacks volume.
    pub fn is_empty(&self) -> bool {
        self.mins.cmpge(self.maxs).any()
    }

    /// The box grown by `units` on all sides.
    pub fn grown(&self, units: i32) -> Self {
        Self {
            mins: self.mins - units,
            maxs: self.maxs + units,
        }
    }

    /// Smallest box around both.
    pub fn union(&self, other: &Self) -> Self {
        Self {
            mins: self.mins.min(other.mins),
            maxs: self.maxs.max(other.maxs),
        }
    }

    /// Common part; may be empty or inverted.
    pub fn intersection(&self, other: &Self) -> Self {
        Self {
            mins: self.mins.max(other.mins),
            maxs: self.maxs.min(other.maxs),
        }
    }

    /// Whether the interiors meet.
    pub fn overlaps(&self, other: &Self) -> bool {
        self.mins.cmplt(other.maxs).all() && other.mins.cmplt(self.maxs).all()
    }

    /// Whether `other` lies within this box (touching allowed).
    pub fn encloses(&self, other: &Self) -> bool {
        self.mins.cmple(other.mins).all() && other.maxs.cmple(self.maxs).all()
    }

    /// Whether the point lies strictly inside.
    pub fn contains(&self, point: Vec3) -> bool {
        point.cmpgt(self.mins.as_vec3()).all() && point.cmplt(self.maxs.as_vec3()).all()
    }

    /// Coordinate of a face along its axis.
    pub fn level(&self, face: Face) -> i32 {
        if face.is_max() {
            self.maxs[face.axis()]
        } else {
            self.mins[face.axis()]
        }
    }

    /// The rectangle of a face.
    pub fn face(&self, face: Face) -> Self {
        let mut rect = *self;
        let level = self.level(face);
        rect.mins[face.axis()] = level;
        rect.maxs[face.axis()] = level;
        rect
    }

    /// Whether the box fills the space just before a plane: at `level` along `axis`, on its upper side or its lower one.
    pub fn fills_side(&self, axis: usize, level: i32, upper: bool) -> bool {
        if upper {
            self.mins[axis] <= level && level < self.maxs[axis]
        } else {
            self.mins[axis] < level && level <= self.maxs[axis]
        }
    }

    /// What is left of this box outside `hole`, cut along the given axes only (two of them for a rectangle in its plane).
    pub fn cut(&self, hole: &Self, axes: &[usize], out: &mut Vec<Self>) {
        let apart = |&a: &usize| hole.maxs[a] <= self.mins[a] || self.maxs[a] <= hole.mins[a];
        if axes.iter().any(apart) {
            out.push(*self);
            return;
        }
        let mut rest = *self;
        for &axis in axes {
            if rest.mins[axis] < hole.mins[axis] {
                let mut below = rest;
                below.maxs[axis] = hole.mins[axis];
                out.push(below);
                rest.mins[axis] = hole.mins[axis];
            }
            if hole.maxs[axis] < rest.maxs[axis] {
                let mut above = rest;
                above.mins[axis] = hole.maxs[axis];
                out.push(above);
                rest.maxs[axis] = hole.maxs[axis];
            }
        }
    }

    /// What is left outside all `holes`.
    pub fn cut_all<'a>(&self, holes: impl IntoIterator<Item = &'a Self>, axes: &[usize]) -> Vec<Self> {
        let mut pieces = vec![*self];
        let mut next = Vec::new();
        for hole in holes {
            for piece in pieces.drain(..) {
                piece.cut(hole, axes, &mut next);
            }
            std::mem::swap(&mut pieces, &mut next);
        }
        pieces
    }

    /// The rectangle in which two boxes touch, and the face of `self` it lies on. Edges and corners do not count.
    pub fn contact(&self, other: &Self) -> Option<(Face, Self)> {
        let rect = self.intersection(other);
        let flat = (0..3).filter(|&a| rect.mins[a] == rect.maxs[a]).count();
        if flat != 1 || rect.mins.cmpgt(rect.maxs).any() {
            return None;
        }
        let axis = (0..3).find(|&a| rect.mins[a] == rect.maxs[a])?;
        let face = Face::ALL[axis * 2 + usize::from(self.maxs[axis] == rect.mins[axis])];
        (self.level(face) == rect.mins[axis]).then_some((face, rect))
    }
}

/// The two axes that span a face perpendicular to `axis`.
pub fn plane_axes(axis: usize) -> [usize; 2] {
    [[1, 2], [0, 2], [0, 1]][axis]
}

impl fmt::Display for Bounds {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}..{}", self.mins, self.maxs)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cutting_keeps_the_volume() {
        let block = Bounds::new([0, 0, 0], [10, 10, 10]);
        let hole = Bounds::new([2, 3, -5], [4, 12, 6]);
        let volume = |b: &Bounds| (b.maxs - b.mins).to_array().iter().product::<i32>();
        let rest: i32 = block.cut_all([&hole], &[0, 1, 2]).iter().map(volume).sum();
        assert_eq!(rest, 1000 - 2 * 7 * 6);
    }

    #[test]
    fn contact_needs_area() {
        let a = Bounds::new([0, 0, 0], [10, 10, 10]);
        let beside = Bounds::new([10, 2, 2], [12, 20, 4]);
        let edge = Bounds::new([10, 10, 0], [12, 20, 4]);
        assert_eq!(
            a.contact(&beside),
            Some((Face::MaxX, Bounds::new([10, 2, 2], [10, 10, 4])))
        );
        assert_eq!(beside.contact(&a).map(|(f, _)| f), Some(Face::MinX));
        assert_eq!(a.contact(&edge), None);
    }
}
