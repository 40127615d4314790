//! From keys, mouse and sticks to what the player does.

use super::input::Input;
use crate::console::Cvars;
use crate::console::commands::Button;
use crate::game::movement::{Body, Command, EYE, Mode};
use crate::game::play::{Event, Play};
use crate::scene::Scene;
use crate::scene::camera::Camera;
use crate::scene::clock::Clock;
use crate::scene::spawns::overview;
use glam::Vec3;

/// Turn of the keys for it, degrees a second.
const KEY_TURN: f32 = 140.0;
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

/// What a step of time is made of.
pub struct Step {
    /// Scene time that goes by, seconds.
    pub seconds: f32,
    /// Time of the user that goes by, seconds: what turns is not slowed down.
    pub real_seconds: f32,
    /// The scene's time at its end.
    pub clock: Clock,
    /// Nothing moves but the player.
    pub frozen: bool,
}

/// Turns the view by mouse, keys and sticks, and lets the player walk. Returns what they did, and what happened.
pub fn walk(
    play: &mut Play,
    camera: &mut Camera,
    input: &mut Input,
    cvars: &Cvars,
    step: &Step,
) -> (Command, Vec<Event>) {
    let number = |name| cvars.number(name) as f32;
    let (dx, dy) = input.take_mouse();
    let sensitivity = number("sensitivity");
    let stick = |x: f32| dead(x, number("joy_threshold"));
    let [stick_right, stick_up] = input.sticks.look.map(stick);
    let stick_turn = number("joy_sensitivity") * step.real_seconds;
    let key_turn = KEY_TURN * step.real_seconds;
    let yaw = input.along(Button::Left, Button::Right) * key_turn
        - stick_right * stick_turn
        - dx * number("m_yaw") * sensitivity;
    let pitch = input.along(Button::LookDown, Button::LookUp) * key_turn - stick_up * stick_turn
        + dy * number("m_pitch") * sensitivity;
    camera.yaw = (camera.yaw + yaw).rem_euclid(360.0);
    camera.pitch = (camera.pitch + pitch).clamp(-STEEPEST, STEEPEST);
    let [walk_right, walk_forward] = input.sticks.walk.map(stick);
    let sum = |keys: f32, stick: f32| (keys + stick).clamp(-1.0, 1.0);
    let command = Command {
        forward: sum(input.along(Button::Forward, Button::Back), walk_forward),
        right: sum(input.along(Button::MoveRight, Button::MoveLeft), walk_right),
        up: input.along(Button::MoveUp, Button::MoveDown),
        pitch: camera.pitch,
        yaw: camera.yaw,
        fast: input.held(Button::Speed),
    };
    let steps = play.steps;
    let events = play.advance(step.seconds, step.clock, step.frozen, &command);
    if play.steps > steps {
        input.seen();
    }
    for event in &events {
        if let Event::Turned(yaw) = event {
            (camera.yaw, camera.pitch) = (yaw.rem_euclid(360.0), 0.0);
        }
    }
    camera.eye = play.body.eye().into();
    (command, events)
}

/// A stick's way without its middle.
fn dead(x: f32, threshold: f32) -> f32 {
    let beyond = (x.abs() - threshold).max(0.0) / (1.0 - threshold);
    beyond.min(1.0).copysign(x)
}
