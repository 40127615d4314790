//! A camera that flies where the keys say.

use super::input::{Action, Input};
use crate::scene::camera::Camera;
use glam::Vec3;

/// Speed in units per second, as a player runs; `Fast` multiplies it.
const SPEED: f32 = 320.0;
const FAST: f32 = 3.0;
/// Degrees of turn per mouse count at sensitivity 1.
const DEGREES_PER_COUNT: f32 = 0.022;

/// Moves a camera by the held keys over `seconds`, and turns it by the mouse counts since the last call. True where it
/// has changed.
pub fn fly(camera: &mut Camera, input: &mut Input, sensitivity: f32, seconds: f32) -> bool {
    let before = *camera;
    let (dx, dy) = input.take_mouse();
    camera.yaw = (camera.yaw - dx * DEGREES_PER_COUNT * sensitivity).rem_euclid(360.0);
    camera.pitch = (camera.pitch + dy * DEGREES_PER_COUNT * sensitivity).clamp(-89.0, 89.0);
    let axes = camera.axes();
    let along = |plus, minus| f32::from(input.held(plus)) - f32::from(input.held(minus));
    let wish = axes.forward * along(Action::Forward, Action::Back)
        + axes.right * along(Action::Right, Action::Left)
        + Vec3::Z * along(Action::Up, Action::Down);
    let speed = if input.held(Action::Fast) { SPEED * FAST } else { SPEED };
    camera.eye = (Vec3::from(camera.eye) + wish.normalize_or_zero() * speed * seconds).into();
    *camera != before
}
