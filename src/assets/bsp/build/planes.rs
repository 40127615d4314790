//! The plane lump: axial planes in pairs.

use super::shape::Face;
use crate::assets::bsp::lumps::Plane;
use std::collections::HashMap;

/// Collects planes; the even one of each pair points up its axis.
#[derive(Default)]
pub struct Planes {
    pub list: Vec<Plane>,
    pairs: HashMap<(usize, i32), i32>,
}

impl Planes {
    /// Number of the plane `axis = level`, pointing up the axis.
    pub fn axial(&mut self, axis: usize, level: i32) -> i32 {
        *self.pairs.entry((axis, level)).or_insert_with(|| {
            let number = self.list.len() as i32;
            let normal = Face::ALL[axis * 2 + 1].normal();
            let dist = level as f32;
            self.list.push(Plane {
                normal: normal.to_array(),
                dist,
            });
            self.list.push(Plane {
                normal: (-normal).to_array(),
                dist: -dist,
            });
            number
        })
    }

    /// Number of the outward plane of a box's face.
    pub fn outward(&mut self, face: Face, level: i32) -> i32 {
        self.axial(face.axis(), level) ^ i32::from(!face.is_max())
    }
}
