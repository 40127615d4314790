//! Views: where the eye is and how it looks.

use glam::Vec3;

/// Height of a player's eye over the entity's origin, units.
pub const EYE_HEIGHT: f32 = 26.0;

/// A pinhole or thin-lens view. Angles in degrees: pitch positive looks down, yaw counter-clockwise from +x, roll
/// positive tilts the image clockwise; `fov` is horizontal.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Camera {
    pub eye: [f32; 3],
    pub pitch: f32,
    pub yaw: f32,
    pub roll: f32,
    pub fov: f32,
}

/// A view while the shutter is open.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shot {
    /// When it opens.
    pub open: Camera,
    /// When it closes.
    pub close: Camera,
}

impl From<&Camera> for Shot {
    /// A camera that stands still.
    fn from(camera: &Camera) -> Self {
        Self {
            open: *camera,
            close: *camera,
        }
    }
}

impl Shot {
    /// The view at a share 0..1 of the time between: straight on, and turning evenly.
    pub fn at(&self, share: f32) -> Camera {
        if self.open == self.close {
            return self.open;
        }
        let (a, b) = (&self.open, &self.close);
        let mix = |a: f32, b: f32| a + (b - a) * share;
        let turn = |a: f32, b: f32| a + ((b - a + 180.0).rem_euclid(360.0) - 180.0) * share;
        Camera {
            eye: [0, 1, 2].map(|i| mix(a.eye[i], b.eye[i])),
            pitch: turn(a.pitch, b.pitch),
            yaw: turn(a.yaw, b.yaw),
            roll: turn(a.roll, b.roll),
            fov: mix(a.fov, b.fov),
        }
    }
}

/// Unit axes of a view in world space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Axes {
    pub forward: Vec3,
    pub right: Vec3,
    pub up: Vec3,
}

/// Sine and cosine, exact at multiples of 90 degrees.
fn sin_cos_degrees(degrees: f32) -> (f32, f32) {
    let reduced = f64::from(degrees).rem_euclid(360.0);
    let quarter = (reduced / 90.0).round();
    let (s, c) = (reduced - quarter * 90.0).to_radians().sin_cos();
    let (s, c) = match quarter as i32 % 4 {
        0 => (s, c),
        1 => (c, -s),
        2 => (-s, -c),
        _ => (-c, s),
    };
    (s as f32, c as f32)
}

impl Camera {
    /// A level view.
    pub fn new(eye: Vec3, yaw: f32, fov: f32) -> Self {
        Self {
            eye: eye.into(),
            pitch: 0.0,
            yaw,
            roll: 0.0,
            fov,
        }
    }

    /// Whether all its numbers are finite.
    pub fn is_finite(&self) -> bool {
        let angles = [self.pitch, self.yaw, self.roll, self.fov];
        self.eye.iter().chain(&angles).all(|x| x.is_finite())
    }

    /// Unit axes: forward, right (−y at yaw 0), up.
    pub fn axes(&self) -> Axes {
        let (sp, cp) = sin_cos_degrees(self.pitch);
        let (sy, cy) = sin_cos_degrees(self.yaw);
        let (sr, cr) = sin_cos_degrees(self.roll);
        let forward = Vec3::new(cp * cy, cp * sy, -sp);
        let level_right = Vec3::new(sy, -cy, 0.0);
        let level_up = Vec3::new(sp * cy, sp * sy, cp);
        Axes {
            forward,
            right: level_right * cr - level_up * sr,
            up: level_up * cr + level_right * sr,
        }
    }

    /// Half width and half height of the image plane at distance 1, from the horizontal field of view.
    pub fn half_extent(&self, width: u32, height: u32) -> (f32, f32) {
        let half = (f64::from(self.fov.clamp(1.0, 179.0)).to_radians() * 0.5).tan() as f32;
        (half, half * height as f32 / width as f32)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shots_turn_the_short_way() {
        let shot = Shot {
            open: Camera::new(Vec3::ZERO, 350.0, 90.0),
            close: Camera::new(Vec3::X, 10.0, 90.0),
        };
        let middle = shot.at(0.5);
        assert_eq!((middle.eye[0], middle.yaw.rem_euclid(360.0)), (0.5, 0.0));
    }

    #[test]
    fn axes_follow_the_games_conventions() {
        let mut camera = Camera::new(Vec3::ZERO, 0.0, 90.0);
        assert_eq!(camera.axes().forward, Vec3::X);
        assert_eq!(camera.axes().right, Vec3::NEG_Y);
        assert_eq!(camera.axes().up, Vec3::Z);
        camera.yaw = 90.0;
        assert_eq!(camera.axes().forward, Vec3::Y);
        camera.pitch = 90.0;
        assert_eq!(camera.axes().forward, Vec3::NEG_Z);
        camera.pitch = -30.0;
        camera.roll = 17.0;
        let Axes { forward, right, up } = camera.axes();
        assert!(right.cross(forward).distance(up) < 1e-6);
        assert!(forward.z > 0.0);
        assert_eq!(camera.half_extent(640, 360), (1.0, 0.5625));
    }
}
