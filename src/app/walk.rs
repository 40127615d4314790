//! From keys and mouse to what the player does.

use super::input::{Action, Input};
use crate::game::movement::{Body, Command, EYE, Mode};
use crate::game::play::{Event, Play};
use crate::scene::Scene;
use crate::scene::camera::Camera;
use crate::scene::clock::Clock;
use crate::scene::spawns::overview;
use glam::Vec3;

/// Degrees of turn per mouse count at sensitivity 1.
const DEGREES_PER_COUNT: f32 = 0.022;
const STEEPEST: f32 = 89.0;

/// Somebody at the first spawn of a scene, and what they see; without any spawn, somebody who flies over it.
pub fn enter(scene: &Scene, fov: f32) -> (Play, Camera) {
    let mut play = Play::new(&scene.bsp, &scene.entities, &scene.spawns);
    let camera = match scene.spawns.first() {
        Some(spawn) => Camera::new(play.body.eye(), spawn.angle, fov),
        None => {
            let camera = overview(&scene.bsp, fov);
            play.body = Body {
                mode: Mode::NoClip,
                ..Body::at(Vec3::from(camera.eye) - Vec3::Z * EYE)
            };
            camera
        }
    };
    (play, camera)
}

/// Turns the view by the mouse and lets the player walk by the held keys for `seconds`, at whose end the scene's time is `clock`. True
/// where the view has changed.
pub fn walk(
    play: &mut Play,
    camera: &mut Camera,
    input: &mut Input,
    sensitivity: f32,
    seconds: f32,
    (clock, frozen): (Clock, bool),
) -> bool {
    let before = *camera;
    let (dx, dy) = input.take_mouse();
    camera.yaw = (camera.yaw - dx * DEGREES_PER_COUNT * sensitivity).rem_euclid(360.0);
    camera.pitch = (camera.pitch + dy * DEGREES_PER_COUNT * sensitivity).clamp(-STEEPEST, STEEPEST);
    let along = |plus, minus| f32::from(input.held(plus)) - f32::from(input.held(minus));
    let command = Command {
        forward: along(Action::Forward, Action::Back),
        right: along(Action::Right, Action::Left),
        up: along(Action::Up, Action::Down),
        pitch: camera.pitch,
        yaw: camera.yaw,
        fast: input.held(Action::Fast),
    };
    for event in play.advance(seconds, clock, frozen, &command) {
        if let Event::Turned(yaw) = event {
            (camera.yaw, camera.pitch) = (yaw.rem_euclid(360.0), 0.0);
        }
    }
    camera.eye = play.body.eye().into();
    *camera != before
}
