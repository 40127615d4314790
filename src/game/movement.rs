//! How a player moves: the original's rules from their numbers. Steps of [`STEP`] seconds, independent of the frame rate.

mod slide;

use super::collision::{CollisionWorld, Extent, PLAYER_SOLID, Placed, Trace};
use crate::assets::bsp::lumps::{content_flags, surface_flags};
use crate::scene::camera::EYE_HEIGHT;
use glam::{Quat, Vec3};

/// Length of a step, seconds.
pub const STEP: f32 = 0.008;
pub const GRAVITY: f32 = 800.0;
pub const SPEED: f32 = 320.0;
/// Upward speed of a jump.
pub const JUMP: f32 = 270.0;
/// Highest step that is walked up.
pub const STEP_HEIGHT: f32 = 18.0;
/// Least z of the normal of what one can stand on.
pub const WALKABLE: f32 = 0.7;
const ACCELERATION: f32 = 10.0;
const AIR_ACCELERATION: f32 = 1.0;
const WATER_ACCELERATION: f32 = 4.0;
const FLIGHT_ACCELERATION: f32 = 8.0;
const FRICTION: f32 = 6.0;
const WATER_FRICTION: f32 = 1.0;
const FLIGHT_FRICTION: f32 = 5.0;
/// Below this speed friction brakes as at it.
const STOP_SPEED: f32 = 100.0;
const FAST: f32 = 3.0;
const CROUCH_SCALE: f32 = 0.25;
const SWIM_SCALE: f32 = 0.5;
/// Speed at which one sinks who does not swim.
const SINK: f32 = 60.0;
/// How far below the feet ground is still stood on.
const GROUND: f32 = 0.25;
/// Speed away from the ground at which one leaves it.
const KICK_OFF: f32 = 10.0;
const WIDTH: f32 = 15.0;
const BELOW: f32 = 24.0;
const STANDING: f32 = 32.0;
const CROUCHED: f32 = 16.0;
/// Heights of the eye over the origin.
pub const EYE: f32 = EYE_HEIGHT;
pub const CROUCHED_EYE: f32 = 12.0;
/// Share of a step in the view's height that is left after a second, about: it goes smoothly.
const STEP_VIEW_RATE: f32 = 12.0;

/// How somebody moves.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub enum Mode {
    #[default]
    Walk,
    /// A spectator: no weight, but walls.
    Fly,
    /// Neither.
    NoClip,
}

/// What somebody wants, −1..1 each, and where they look, degrees.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Command {
    pub forward: f32,
    pub right: f32,
    /// Up: jump or swim; down: crouch or dive.
    pub up: f32,
    /// Down is positive.
    pub pitch: f32,
    pub yaw: f32,
    /// Through walls, three times as fast.
    pub fast: bool,
}

/// What moves are made in.
#[derive(Clone, Copy)]
pub struct World<'a> {
    pub collision: &'a CollisionWorld,
    /// Brush models where they stand.
    pub placed: &'a [Placed],
}

impl World<'_> {
    fn sweep(&self, extent: Extent, start: Vec3, end: Vec3) -> Trace {
        self.collision.sweep(extent, start, end, PLAYER_SOLID, self.placed)
    }
}

/// How deep in a liquid.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, serde::Serialize, serde::Deserialize)]
pub enum Depth {
    #[default]
    Dry,
    Feet,
    Waist,
    Eyes,
}

/// A player's body.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Body {
    /// The middle of the feet is 24 below.
    pub origin: Vec3,
    /// Units a second.
    pub velocity: Vec3,
    pub mode: Mode,
    pub crouched: bool,
    /// What is stood on.
    pub ground: Option<Ground>,
    pub depth: Depth,
    /// Contents of the liquid.
    pub liquid: i32,
    /// A jump lasts until the key is let go.
    pub jump_held: bool,
    /// Seconds for which the keys do nothing to the speed: after a teleporter, or jumping out of water.
    pub held: f32,
    /// What the view is lower than the body for having gone up a step; it catches up.
    pub view_lag: f32,
    /// A jump pad has thrown it: no friction until it lands.
    pub thrown: bool,
    /// It leaps out of water.
    pub leaping: bool,
}

/// What somebody stands on or slides down.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Ground {
    pub normal: Vec3,
    /// Flat enough to walk.
    pub walkable: bool,
    pub slick: bool,
    /// Brush model; 0: the world.
    pub model: usize,
}

/// Size of a body.
pub fn extent(crouched: bool) -> Extent {
    Extent {
        mins: Vec3::new(-WIDTH, -WIDTH, -BELOW),
        maxs: Vec3::new(WIDTH, WIDTH, if crouched { CROUCHED } else { STANDING }),
    }
}

/// Forward, right, up of a view.
fn axes(pitch: f32, yaw: f32) -> [Vec3; 3] {
    let turn = Quat::from_rotation_z(yaw.to_radians()) * Quat::from_rotation_y(pitch.to_radians());
    [turn * Vec3::X, turn * Vec3::NEG_Y, turn * Vec3::Z]
}

impl Body {
    /// Somebody who stands at a spawn point.
    pub fn at(origin: Vec3) -> Self {
        Self {
            origin,
            ..Self::default()
        }
    }

    /// Where the eye is.
    pub fn eye(&self) -> Vec3 {
        let height = if self.crouched { CROUCHED_EYE } else { EYE };
        self.origin + Vec3::Z * (height - self.view_lag)
    }

    /// One step of time.
    pub fn step(&mut self, world: &World<'_>, command: &Command) {
        self.view_lag *= (-STEP_VIEW_RATE * STEP).exp();
        self.held = (self.held - STEP).max(0.0);
        if command.up < 0.1 {
            self.jump_held = false;
        }
        let [forward, right, up] = axes(command.pitch, command.yaw);
        match self.mode {
            Mode::NoClip => {
                self.crouched = false;
                self.brake(1.5 * FRICTION);
                let wish = forward * command.forward + right * command.right + Vec3::Z * command.up;
                let speed = self.speed_of(command) * if command.fast { FAST } else { 1.0 };
                self.accelerate(wish, speed, ACCELERATION);
                self.origin += self.velocity * STEP;
                self.ground = None;
                (self.depth, self.liquid) = (Depth::Dry, 0);
            }
            Mode::Fly => {
                self.crouched = false;
                self.brake(FLIGHT_FRICTION);
                let wish = forward * command.forward + right * command.right + up * command.up;
                self.accelerate(wish, self.speed_of(command), FLIGHT_ACCELERATION);
                self.step_slide(world, false);
                self.ground = None;
            }
            Mode::Walk => self.walk(world, command, [forward, right]),
        }
    }

    fn walk(&mut self, world: &World<'_>, command: &Command, [forward, right]: [Vec3; 2]) {
        self.crouch(world, command.up < -0.1);
        self.find_liquid(world);
        self.find_ground(world);
        if self.leaping {
            self.leap(world);
        } else if self.depth > Depth::Feet {
            self.swim(world, command, [forward, right]);
        } else {
            let walking = self.ground.is_some_and(|g| g.walkable) && !self.jumps(command);
            self.friction();
            let level = |v: Vec3| v.with_z(0.0).normalize_or_zero();
            let along = |v: Vec3| match self.ground.filter(|_| walking) {
                Some(g) => slide::clip(level(v), g.normal).normalize_or_zero(),
                None => level(v),
            };
            let wish = along(forward) * command.forward + along(right) * command.right;
            // Who holds the key of a jump that is done runs no slower for it.
            let up = if walking && command.up > 0.0 { 0.0 } else { command.up };
            let speed = self.speed_of(&Command { up, ..*command });
            if walking {
                self.run(world, wish, speed);
            } else {
                self.fall(world, wish, speed);
            }
        }
        self.find_ground(world);
        self.find_liquid(world);
    }

    /// Greatest speed that a command asks for: its largest part counts, so that going aslant is no faster.
    fn speed_of(&self, command: &Command) -> f32 {
        let parts = Vec3::new(command.forward, command.right, command.up);
        let total = parts.length();
        if total == 0.0 {
            return 0.0;
        }
        // What is asked for sideways and along alone comes to this share of the whole.
        let level = if self.mode == Mode::Walk && self.depth <= Depth::Feet {
            parts.truncate().length()
        } else {
            total
        };
        SPEED * parts.abs().max_element() * level / total
    }

    fn crouch(&mut self, world: &World<'_>, wanted: bool) {
        if wanted {
            self.crouched = true;
        } else if self.crouched {
            let fits = world.sweep(extent(false), self.origin, self.origin);
            self.crouched = fits.all_solid;
        }
    }

    fn find_liquid(&mut self, world: &World<'_>) {
        const LIQUID: i32 = content_flags::WATER | content_flags::LAVA | content_flags::SLIME;
        let eye = if self.crouched { CROUCHED_EYE } else { EYE };
        let at = |height: f32| {
            let point = self.origin + Vec3::Z * (height - BELOW);
            world.collision.contents(point, world.placed) & LIQUID
        };
        let whole = eye + BELOW;
        let (feet, waist, eyes) = (at(1.0), at(whole * 0.5), at(whole));
        self.liquid = feet;
        self.depth = match (feet != 0, waist != 0, eyes != 0) {
            (false, ..) => Depth::Dry,
            (true, false, _) => Depth::Feet,
            (true, true, false) => Depth::Waist,
            (true, true, true) => Depth::Eyes,
        };
    }

    fn find_ground(&mut self, world: &World<'_>) {
        let mut below = world.sweep(extent(self.crouched), self.origin, self.origin - Vec3::Z * GROUND);
        if below.all_solid {
            let Some(free) = self.freed(world) else {
                self.ground = None;
                return;
            };
            self.origin = free;
            below = world.sweep(extent(self.crouched), self.origin, self.origin - Vec3::Z * GROUND);
        }
        let leaves = self.velocity.z > 0.0 && self.velocity.dot(below.normal) > KICK_OFF;
        self.ground = (below.fraction < 1.0 && !leaves).then(|| Ground {
            normal: below.normal,
            walkable: below.normal.z >= WALKABLE,
            slick: below.surface_flags & surface_flags::SLICK != 0,
            model: below.model.unwrap_or(0),
        });
        if self.ground.is_some_and(|g| g.walkable) {
            self.thrown = false;
        }
    }

    /// A place a unit away where a body that is in something solid is not.
    fn freed(&self, world: &World<'_>) -> Option<Vec3> {
        const STEPS: [f32; 3] = [0.0, -1.0, 1.0];
        (0..27)
            .map(|i| Vec3::new(STEPS[i % 3], STEPS[i / 3 % 3], STEPS[i / 9]))
            .map(|off| self.origin + off)
            .find(|at| !world.sweep(extent(self.crouched), *at, *at).all_solid)
    }

    fn jumps(&mut self, command: &Command) -> bool {
        if command.up < 0.1 || self.jump_held || self.held > 0.0 {
            return false;
        }
        self.jump_held = true;
        self.velocity.z = JUMP;
        self.ground = None;
        true
    }

    fn friction(&mut self) {
        let grip = self.ground.is_some_and(|g| g.walkable && !g.slick) && self.held == 0.0 && !self.thrown;
        let wet = match self.depth {
            Depth::Dry => 0.0,
            Depth::Feet => 1.0,
            Depth::Waist => 2.0,
            Depth::Eyes => 3.0,
        };
        // Somebody who walks is braked along the ground alone.
        let vertical = self.velocity.z;
        if self.ground.is_some_and(|g| g.walkable) {
            self.velocity.z = 0.0;
        }
        let speed = self.velocity.length();
        self.velocity.z = vertical;
        if speed < 1.0 {
            self.velocity = Vec3::new(0.0, 0.0, vertical);
            return;
        }
        let mut drop = speed * WATER_FRICTION * wet * STEP;
        if grip && self.depth <= Depth::Feet {
            drop += speed.max(STOP_SPEED) * FRICTION * STEP;
        }
        self.velocity *= (speed - drop).max(0.0) / speed;
    }

    fn brake(&mut self, friction: f32) {
        let speed = self.velocity.length();
        if speed < 1.0 {
            self.velocity = Vec3::ZERO;
            return;
        }
        let drop = speed.max(STOP_SPEED) * friction * STEP;
        self.velocity *= (speed - drop).max(0.0) / speed;
    }

    /// Towards a direction at a speed: what is gained depends on the speed along it, which is why turning in the air makes faster.
    fn accelerate(&mut self, wish: Vec3, speed: f32, acceleration: f32) {
        let Some(direction) = wish.try_normalize() else { return };
        let lacking = speed - self.velocity.dot(direction);
        if lacking > 0.0 && self.held == 0.0 {
            self.velocity += direction * (acceleration * STEP * speed).min(lacking);
        }
    }

    fn run(&mut self, world: &World<'_>, wish: Vec3, speed: f32) {
        let Some(ground) = self.ground else { return };
        let mut speed = if self.crouched {
            speed.min(SPEED * CROUCH_SCALE)
        } else {
            speed
        };
        if self.depth > Depth::Dry {
            speed = speed.min(SPEED * (1.0 - (1.0 - SWIM_SCALE) / 3.0));
        }
        let acceleration = if ground.slick { AIR_ACCELERATION } else { ACCELERATION };
        self.accelerate(wish, speed, acceleration);
        if ground.slick {
            self.velocity.z -= GRAVITY * STEP;
        }
        // Along the ground as fast as before: slopes don't slow down.
        let fast = self.velocity.length();
        self.velocity = slide::clip(self.velocity, ground.normal).normalize_or_zero() * fast;
        if self.velocity.truncate() != glam::Vec2::ZERO {
            self.step_slide(world, false);
        }
    }

    fn fall(&mut self, world: &World<'_>, wish: Vec3, speed: f32) {
        self.accelerate(wish, speed, AIR_ACCELERATION);
        // Too steep to walk.
        if let Some(ground) = self.ground {
            self.velocity = slide::clip(self.velocity, ground.normal);
        }
        self.step_slide(world, true);
    }

    fn swim(&mut self, world: &World<'_>, command: &Command, [forward, right]: [Vec3; 2]) {
        if self.leaps_out(world, forward) {
            self.leap(world);
            return;
        }
        self.friction();
        let wish = forward * command.forward + right * command.right + Vec3::Z * command.up;
        let speed = self.speed_of(command);
        if speed == 0.0 {
            self.accelerate(Vec3::NEG_Z, SINK, WATER_ACCELERATION);
        } else {
            self.accelerate(wish, speed.min(SPEED * SWIM_SCALE), WATER_ACCELERATION);
        }
        // Slopes under water are swum up without loss.
        if let Some(ground) = self.ground
            && self.velocity.dot(ground.normal) < 0.0
        {
            let fast = self.velocity.length();
            self.velocity = slide::clip(self.velocity, ground.normal).normalize_or_zero() * fast;
        }
        self.slide(world, false);
    }

    /// At the rim of a pool: out of the water onto what is ahead.
    fn leaps_out(&mut self, world: &World<'_>, forward: Vec3) -> bool {
        if self.depth != Depth::Waist || self.held > 0.0 {
            return false;
        }
        let level = forward.with_z(0.0).normalize_or_zero();
        let solid = |height: f32| {
            let spot = self.origin + level * 30.0 + Vec3::Z * height;
            world.collision.contents(spot, world.placed) & content_flags::SOLID != 0
        };
        if !solid(4.0) || solid(20.0) {
            return false;
        }
        self.velocity = forward * 200.0 + Vec3::Z * (350.0 - forward.z * 200.0);
        self.held = 2.0;
        self.leaping = true;
        true
    }

    /// On the way out of the water: what is in the way does not take the speed, until one falls.
    fn leap(&mut self, world: &World<'_>) {
        let before = self.velocity;
        self.ground = None;
        self.step_slide(world, true);
        self.velocity = before - Vec3::Z * (2.0 * GRAVITY * STEP);
        if self.velocity.z < 0.0 || self.held == 0.0 {
            self.leaping = false;
            self.held = 0.0;
        }
    }
}

#[cfg(test)]
mod tests;
