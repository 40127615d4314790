//! How things of a map move by themselves: the pose of each at any moment, from its entity alone.

use super::camera::{Camera, EYE_HEIGHT};
use super::clock::{Clock, rate};
use crate::assets::entities::Entity;
use glam::{Affine3A, Mat3A, Quat, Vec3};
use std::f32::consts::TAU;

/// A pose that follows the clock.
#[derive(Clone, Debug, PartialEq)]
pub enum Motion {
    /// Stands still.
    Still(Affine3A),
    /// An item: it turns about z and bobs. Rates: [`super::clock`].
    Item {
        /// Where it would stand.
        place: Affine3A,
        /// What is moved to the axis that it turns about, model space.
        shift: Vec3,
        /// Middle of the bobbing, units over `place`.
        height: f32,
        /// Turns.
        spin: u32,
        /// Periods of the bobbing.
        bob: u32,
        /// Of the bobbing, units.
        amplitude: f32,
    },
    /// Turns about an axis through its origin.
    Rotating { origin: Vec3, axis: Vec3, turns: u32 },
    /// Moves along a line as a sine.
    Bobbing {
        origin: Vec3,
        way: Vec3,
        periods: u32,
        phase: f32,
    },
    /// Swings about an axis through its origin as a sine. `angle`: radians.
    Pendulum {
        origin: Vec3,
        axis: Vec3,
        angle: f32,
        periods: u32,
        phase: f32,
    },
    /// Goes round its corners, with a wait at each.
    Train { legs: Vec<Leg>, seconds: f32 },
    /// A door, platform or button: rests, and goes by `way` and back when somebody comes: [`crate::game::movers`].
    Mover { rest: Vec3, way: Vec3 },
    /// A part of the player who stands under the eye: each joint in the frame of the one before.
    Body(Vec<Steps>),
    /// Something held before the eye, likewise.
    View(Vec<Steps>),
}

/// A joint that goes round its poses.
#[derive(Clone, Debug, PartialEq)]
pub struct Steps {
    pub poses: Vec<Affine3A>,
    /// Rounds: [`super::clock`].
    pub rate: u32,
}

/// What poses depend on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Moment {
    pub clock: Clock,
    /// The player's view.
    pub camera: Camera,
    /// The weapon before the eye is drawn.
    pub draw_gun: bool,
    /// Levels by which models have less detail than their size calls for; `None`: full detail everywhere.
    pub lod_bias: Option<i32>,
}

impl From<Clock> for Moment {
    /// A moment of a map without a player.
    fn from(clock: Clock) -> Self {
        Self {
            clock,
            camera: Camera::new(Vec3::ZERO, 0.0, 90.0),
            draw_gun: false,
            lod_bias: None,
        }
    }
}

/// The weapon is shown so much nearer and smaller than it is, which looks the same, so that it doesn't reach into walls.
const WEAPON_SCALE: f32 = 0.25;

/// Product of joints.
fn joined(chain: &[Steps], clock: Clock) -> Affine3A {
    chain.iter().fold(Affine3A::IDENTITY, |pose, steps| {
        pose * steps.poses[step(clock, steps.rate, steps.poses.len() as u32) as usize]
    })
}

/// Which of `count` steps a round is at.
pub fn step(clock: Clock, rate: u32, count: u32) -> u32 {
    ((clock.fraction(rate) * count as f32) as u32).min(count.max(1) - 1)
}

/// A straight leg of a train's way. Times: seconds after the start of a round.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Leg {
    pub from: Vec3,
    pub to: Vec3,
    pub start: f32,
    pub end: f32,
}

/// How an item bobs, radians a second.
const BOB_RADIANS_A_SECOND: f32 = 5.0;
/// Units that an item bobs up and down, and how high over its place.
const BOB: f32 = 4.0;

impl Motion {
    /// An item at `place`. `number`: of its entity, which the bobbing differs by; `fast` ones turn twice as fast; `spins`
    /// is false for what only bobs.
    pub fn item(place: Affine3A, number: u32, fast: bool, spins: bool) -> Self {
        let radians = BOB_RADIANS_A_SECOND + number as f32 * 0.01;
        let turns = match (spins, fast) {
            (false, _) => 0.0,
            (true, false) => 1000.0 / 2048.0,
            (true, true) => 1000.0 / 1024.0,
        };
        Self::Item {
            place,
            shift: Vec3::ZERO,
            height: BOB,
            spin: rate(turns),
            bob: rate(radians / TAU),
            amplitude: BOB,
        }
    }

    /// Motion of a brush model by its entity. Doors, buttons and platforms rest until someone comes. `entities`: all of the
    /// map, for the corners of a train's way; `mins`, `maxs`: of the model.
    pub fn of_brush_model(entity: &Entity, entities: &[Entity], mins: Vec3, maxs: Vec3) -> Self {
        let origin = entity.origin();
        let number = |key: &str, default: f32| entity.number(key).unwrap_or(default);
        let (flags, phase) = (entity.spawnflags(), number("phase", 0.0));
        match entity.class() {
            "func_rotating" => {
                let axis = match flags {
                    f if f & 4 != 0 => Vec3::X,
                    f if f & 8 != 0 => Vec3::Y,
                    _ => Vec3::Z,
                };
                let speed = match number("speed", 100.0) {
                    0.0 => 100.0,
                    s => s,
                };
                Self::Rotating {
                    origin,
                    axis,
                    turns: rate(speed / 360.0),
                }
            }
            "func_bobbing" => {
                let height = number("height", 32.0);
                let way = match flags {
                    f if f & 1 != 0 => Vec3::X,
                    f if f & 2 != 0 => Vec3::Y,
                    _ => Vec3::Z,
                };
                Self::Bobbing {
                    origin,
                    way: way * height,
                    periods: rate(1.0 / number("speed", 4.0).max(0.01)),
                    phase,
                }
            }
            "func_pendulum" => {
                let length = (-mins.z).max(8.0);
                // A pendulum of this length in the game's gravity of 800 units/s².
                let frequency = (800.0 / (3.0 * length)).sqrt() / TAU;
                let yaw = Quat::from_rotation_z(number("angle", 0.0).to_radians());
                Self::Pendulum {
                    origin,
                    axis: yaw * Vec3::X,
                    angle: number("speed", 30.0).to_radians(),
                    periods: rate(frequency),
                    phase,
                }
            }
            "func_train" => Self::train(entity, entities, mins),
            "func_plat" => {
                // It waits at the bottom.
                let height = number("height", maxs.z - mins.z - number("lip", 8.0));
                let way = Vec3::Z * height;
                Self::Mover {
                    rest: origin - way,
                    way,
                }
            }
            class @ ("func_door" | "func_button") => {
                let lip = number("lip", if class == "func_door" { 8.0 } else { 4.0 });
                let along = door_way(entity);
                let way = along * (along.abs().dot(maxs - mins) - lip);
                // Some doors stand open.
                if class == "func_door" && flags & 1 != 0 {
                    Self::Mover {
                        rest: origin + way,
                        way: -way,
                    }
                } else {
                    Self::Mover { rest: origin, way }
                }
            }
            _ => Self::Still(Affine3A::from_translation(origin)),
        }
    }

    fn train(entity: &Entity, entities: &[Entity], mins: Vec3) -> Self {
        let corner = |name: &str| entities.iter().find(|e| e.get("targetname") == Some(name));
        let speed = entity.number("speed").filter(|s| *s > 0.0).unwrap_or(100.0);
        let mut way: Vec<&Entity> = Vec::new();
        let mut next = entity.get("target");
        while let Some(found) = next.and_then(corner) {
            if way.iter().any(|e| std::ptr::eq(*e, found)) {
                break;
            }
            way.push(found);
            next = found.get("target");
        }
        let mut legs = Vec::new();
        let mut time = 0.0;
        for (i, from) in way.iter().enumerate() {
            let to = way[(i + 1) % way.len()];
            time += from.number("wait").unwrap_or(0.0).clamp(0.0, 3600.0);
            let (a, b) = (from.origin() - mins, to.origin() - mins);
            let speed = from.number("speed").filter(|s| *s > 0.0).unwrap_or(speed);
            let end = time + (b - a).length() / speed;
            legs.push(Leg {
                from: a,
                to: b,
                start: time,
                end,
            });
            time = end;
        }
        match legs.first() {
            Some(_) if legs.len() > 1 && time > 0.0 => Self::Train { legs, seconds: time },
            Some(only) => Self::Still(Affine3A::from_translation(only.from)),
            None => Self::Still(Affine3A::from_translation(entity.origin())),
        }
    }

    /// Model to world at a moment.
    pub fn pose(&self, moment: impl Into<Moment>) -> Affine3A {
        let Moment { clock, camera, .. } = moment.into();
        let sine = |periods: u32, phase: f32| ((clock.fraction(periods) + phase) * TAU).sin();
        match self {
            Self::Still(pose) => *pose,
            Self::Mover { rest, .. } => Affine3A::from_translation(*rest),
            Self::Item {
                place,
                shift,
                height,
                spin,
                bob,
                amplitude,
            } => {
                let lift = height + amplitude * (clock.fraction(*bob) * TAU).cos();
                Affine3A::from_translation(Vec3::Z * lift)
                    * *place
                    * Affine3A::from_rotation_z(clock.fraction(*spin) * TAU)
                    * Affine3A::from_translation(*shift)
            }
            Self::Rotating { origin, axis, turns } => {
                Affine3A::from_rotation_translation(Quat::from_axis_angle(*axis, clock.fraction(*turns) * TAU), *origin)
            }
            Self::Bobbing {
                origin,
                way,
                periods,
                phase,
            } => Affine3A::from_translation(*origin + *way * sine(*periods, *phase)),
            Self::Pendulum {
                origin,
                axis,
                angle,
                periods,
                phase,
            } => Affine3A::from_rotation_translation(
                Quat::from_axis_angle(*axis, angle * sine(*periods, *phase)),
                *origin,
            ),
            Self::Train { legs, seconds } => {
                let time = (clock.seconds() % f64::from(*seconds)) as f32;
                let leg = legs.iter().find(|leg| time < leg.end).unwrap_or(&legs[legs.len() - 1]);
                let share = ((time - leg.start) / (leg.end - leg.start).max(1e-3)).clamp(0.0, 1.0);
                Affine3A::from_translation(leg.from.lerp(leg.to, share))
            }
            Self::Body(chain) => {
                let feet = Vec3::from(camera.eye) - Vec3::Z * EYE_HEIGHT;
                Affine3A::from_translation(feet)
                    * Affine3A::from_rotation_z(camera.yaw.to_radians())
                    * joined(chain, clock)
            }
            Self::View(chain) => {
                let axes = camera.axes();
                let view = Affine3A {
                    matrix3: Mat3A::from_cols(axes.forward.into(), (-axes.right).into(), axes.up.into()) * WEAPON_SCALE,
                    translation: camera.eye.into(),
                };
                view * joined(chain, clock)
            }
        }
    }

    /// Poses that a motion goes through, so densely that what lies between any two is within a hundredth of the size of the
    /// bounds of all. A player has none: they go anywhere.
    pub fn sweep(&self) -> Vec<Affine3A> {
        const STEPS: u32 = 64;
        let turned = |turn: &dyn Fn(f32) -> Quat, origin: Vec3| -> Vec<Affine3A> {
            let at = |i| Affine3A::from_rotation_translation(turn(i as f32 / STEPS as f32 * TAU), origin);
            (0..STEPS).map(at).collect()
        };
        match self {
            Self::Still(pose) => vec![*pose],
            Self::Mover { rest, way } => vec![
                Affine3A::from_translation(*rest),
                Affine3A::from_translation(*rest + *way),
            ],
            Self::Train { legs, .. } => legs.iter().map(|l| Affine3A::from_translation(l.from)).collect(),
            Self::Rotating { origin, axis, .. } => turned(&|angle| Quat::from_axis_angle(*axis, angle), *origin),
            Self::Pendulum {
                origin, axis, angle, ..
            } => turned(&|phase| Quat::from_axis_angle(*axis, angle * phase.sin()), *origin),
            Self::Bobbing { origin, way, .. } => [-1.0, 1.0]
                .map(|s| Affine3A::from_translation(*origin + *way * s))
                .to_vec(),
            Self::Item {
                place,
                shift,
                amplitude,
                ..
            } => {
                let reach = Vec3::Z * (2.0 * amplitude);
                let turns = turned(&Quat::from_rotation_z, Vec3::ZERO);
                let at = |t: &Affine3A| *place * *t * Affine3A::from_translation(*shift);
                turns
                    .iter()
                    .flat_map(|t| [at(t), Affine3A::from_translation(reach) * at(t)])
                    .collect()
            }
            Self::Body(_) | Self::View(_) => Vec::new(),
        }
    }

    /// Whether the pose changes with time.
    pub fn moves(&self) -> bool {
        !matches!(self, Self::Still(_) | Self::Mover { .. })
    }

    /// Whether it may ever stand elsewhere.
    pub fn may_move(&self) -> bool {
        !matches!(self, Self::Still(_))
    }
}

/// Unit direction that a door opens to: `angle` −1 is up, −2 down.
fn door_way(entity: &Entity) -> Vec3 {
    match entity.number("angle").unwrap_or(0.0) {
        -1.0 => Vec3::Z,
        -2.0 => Vec3::NEG_Z,
        angle => Quat::from_rotation_z(angle.to_radians()) * Vec3::X,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::assets::entities::parse;

    fn motion(text: &str) -> Motion {
        let (entities, _) = parse(text.as_bytes());
        Motion::of_brush_model(&entities[0], &entities, Vec3::splat(-16.0), Vec3::splat(16.0))
    }

    fn at(motion: &Motion, seconds: f64) -> Vec3 {
        motion.pose(Clock::from_seconds(seconds)).translation.into()
    }

    #[test]
    fn bobbing_follows_a_sine_of_its_period() {
        let m = motion(r#"{ "classname" "func_bobbing" "height" "40" "speed" "2" "origin" "0 0 8" }"#);
        assert!((at(&m, 0.5) - Vec3::new(0.0, 0.0, 48.0)).length() < 0.01);
        assert!((at(&m, 1.5) - Vec3::new(0.0, 0.0, -32.0)).length() < 0.01);
    }

    #[test]
    fn rotating_turns_at_its_speed() {
        let m = motion(r#"{ "classname" "func_rotating" "speed" "90" }"#);
        let x = m.pose(Clock::from_seconds(1.0)).transform_vector3(Vec3::X);
        assert!((x - Vec3::Y).length() < 1e-3);
    }

    #[test]
    fn trains_go_round_and_wait() {
        let m = motion(
            r#"{ "classname" "func_train" "target" "a" "speed" "100" }
               { "classname" "path_corner" "targetname" "a" "target" "b" "origin" "0 0 0" }
               { "classname" "path_corner" "targetname" "b" "target" "a" "origin" "100 0 0" "wait" "2" }"#,
        );
        let corner = Vec3::splat(16.0);
        assert!((at(&m, 0.5) - corner - Vec3::X * 50.0).length() < 0.1);
        assert!((at(&m, 2.0) - corner - Vec3::X * 100.0).length() < 0.1);
        assert!((at(&m, 3.5) - corner - Vec3::X * 50.0).length() < 0.1);
        assert!((at(&m, 4.5) - corner - Vec3::X * 50.0).length() < 0.1);
    }

    #[test]
    fn items_turn_and_bob() {
        let m = Motion::item(Affine3A::from_translation(Vec3::Z * 100.0), 0, false, true);
        let heights: Vec<f32> = (0..200).map(|i| at(&m, f64::from(i) * 0.01).z).collect();
        let (low, high) = heights
            .iter()
            .fold((f32::MAX, 0f32), |(l, h), z| (l.min(*z), h.max(*z)));
        assert!((low - 100.0).abs() < 0.1 && (high - 108.0).abs() < 0.1);
    }
}
