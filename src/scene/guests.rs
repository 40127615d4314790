//! Lights that a frame brings along: no part of the map, in no row and no tree, and elsewhere in each frame.

use super::camera::{Camera, EYE_HEIGHT};
use super::lights::point_light;
use super::records::{LIGHT_SPHERE, LIGHT_SPOT, Light};
use glam::Vec3;

/// Lights of numbers from here on are the frame's own.
pub const GUEST_LIGHT: u32 = 1 << 31;
/// Share of light samples that are taken of guests, where there are any that can light the receiver.
pub const GUEST_SHARE: f32 = 0.25;

/// Where a flashlight is held, units to the right of the eye and below it: within the player's box.
const HELD: [f32; 2] = [8.0, EYE_HEIGHT * 0.3];
/// Radius of its beam at distance 1.
const BEAM: f32 = 0.45;

/// A lamp in the hand of somebody who looks through `camera`, as bright as a light entity of `brightness`.
pub fn flashlight(camera: &Camera, brightness: f32) -> Light {
    let axes = camera.axes();
    let place = Vec3::from(camera.eye) + axes.right * HELD[0] - axes.up * HELD[1];
    let mut light = point_light(place, brightness, Vec3::ONE);
    light.flags |= LIGHT_SPOT;
    light.p1 = axes.forward.into();
    light.p2[0] = BEAM;
    light
}

/// All guests of a frame: its own that are spheres, and the flashlight where it is on.
pub fn guests(own: &[Light], camera: &Camera, brightness: f32) -> Vec<Light> {
    let mut out: Vec<Light> = own.iter().filter(|l| l.kind == LIGHT_SPHERE).copied().collect();
    if brightness > 0.0 {
        out.push(flashlight(camera, brightness));
    }
    out
}
