//! Random numbers of the recovery: a counter run through the PCG hash, the same on every machine.

use crate::scene::sampling::{key, pcg, unit};

/// A stream of numbers fixed by a seed and two labels.
#[derive(Clone, Copy, Debug)]
pub struct Random {
    key: u32,
    count: u32,
}

impl Random {
    /// The stream of `purpose` and `item` under a seed.
    pub fn new(seed: u32, purpose: u32, item: u32) -> Self {
        Self {
            key: key(seed, item, purpose),
            count: 0,
        }
    }

    /// 32 random bits.
    pub fn bits(&mut self) -> u32 {
        self.count = self.count.wrapping_add(1);
        pcg(self.key ^ pcg(self.count))
    }

    /// Uniform in [0, 1).
    pub fn unit(&mut self) -> f32 {
        unit(self.bits())
    }

    /// Uniform in [-1, 1).
    pub fn signed(&mut self) -> f32 {
        self.unit() * 2.0 - 1.0
    }

    /// Uniform in the cube of half edge 1.
    pub fn cube(&mut self) -> glam::Vec3 {
        glam::Vec3::new(self.signed(), self.signed(), self.signed())
    }
}
