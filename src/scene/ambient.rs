//! What no known light explains: light from everywhere, as a constant and as a volume of irradiance.

use super::records::AmbientCube;
use glam::{UVec3, Vec3};

/// Irradiance/π of unexplained light, luxel units.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Ambient {
    /// The same everywhere and for every normal.
    pub constant: Vec3,
    pub volume: AmbientVolume,
}

/// Cubes of irradiance on a grid in world space.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct AmbientVolume {
    /// Place of the first point, units.
    pub origin: Vec3,
    /// Distance between points, units.
    pub step: Vec3,
    /// Points along each axis; x runs fastest. 0 where there is no volume.
    pub size: UVec3,
    pub cubes: Vec<AmbientCube>,
}

impl AmbientCube {
    /// Irradiance/π for a unit normal: each axis counts with the square of the normal's component (Mitchell, McTaggart and
    /// Green 2006, "Shading in Valve's Source Engine").
    pub fn towards(&self, n: Vec3) -> Vec3 {
        (0..3)
            .map(|a| Vec3::from(self.axes[2 * a + usize::from(n[a] < 0.0)]) * (n[a] * n[a]))
            .sum()
    }
}

impl AmbientVolume {
    /// Irradiance/π at a point for a unit normal: linear between the points that are in the open, zero where none is.
    pub fn at(&self, position: Vec3, normal: Vec3) -> Vec3 {
        if self.cubes.is_empty() {
            return Vec3::ZERO;
        }
        let most = (self.size - 1).as_vec3();
        let p = ((position - self.origin) / self.step).clamp(Vec3::ZERO, most);
        let low = p.floor();
        let f = p - low;
        let (mut sum, mut whole) = (Vec3::ZERO, 0.0);
        for corner in 0..8u32 {
            let up = UVec3::new(corner & 1, corner >> 1 & 1, corner >> 2);
            let at = (low.as_uvec3() + up).min(self.size - 1);
            let cube = &self.cubes[((at.z * self.size.y + at.y) * self.size.x + at.x) as usize];
            let share = Vec3::select(up.cmpeq(UVec3::ONE), f, Vec3::ONE - f);
            let weight = share.x * share.y * share.z * cube.open;
            if weight > 0.0 {
                sum += cube.towards(normal) * weight;
                whole += weight;
            }
        }
        if whole > 0.0 { sum / whole } else { Vec3::ZERO }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cube(value: f32, open: f32) -> AmbientCube {
        AmbientCube {
            axes: [[value; 3]; 6],
            open,
        }
    }

    #[test]
    fn values_lie_between_those_in_the_open() {
        let mut volume = AmbientVolume {
            origin: Vec3::splat(10.0),
            step: Vec3::new(64.0, 64.0, 128.0),
            size: UVec3::new(2, 1, 1),
            cubes: vec![cube(1.0, 1.0), cube(3.0, 1.0)],
        };
        let at = |v: &AmbientVolume, x: f32| v.at(Vec3::new(x, 0.0, 0.0), Vec3::new(0.6, 0.0, 0.8)).x;
        assert!((at(&volume, 42.0) - 2.0).abs() < 1e-6);
        assert_eq!((at(&volume, -500.0), at(&volume, 500.0)), (1.0, 3.0));
        volume.cubes[1].open = 0.0;
        assert_eq!(at(&volume, 60.0), 1.0);
        volume.cubes[0].open = 0.0;
        assert_eq!(at(&volume, 42.0), 0.0);
        assert_eq!(at(&AmbientVolume::default(), 0.0), 0.0);
    }

    #[test]
    fn cubes_weigh_their_sides() {
        let mut one = cube(0.0, 1.0);
        one.axes[0] = [4.0; 3];
        one.axes[3] = [2.0; 3];
        let n = Vec3::new(0.6, -0.8, 0.0);
        assert!((one.towards(n).x - (4.0 * 0.36 + 2.0 * 0.64)).abs() < 1e-6);
    }
}
