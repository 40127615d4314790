//! Doors, platforms and buttons: brush models that go between two places when somebody comes.

use super::triggers::model_of;
use crate::assets::bsp::Bounds;
use crate::assets::entities::Entity;
use crate::scene::motion::Motion;
use glam::{Affine3A, Vec3};

/// How far around a door somebody is noticed, units.
const DOOR_REACH: f32 = 120.0;
/// A platform's own trigger: so far inside its rim, and so high over it.
const PLATFORM_RIM: f32 = 33.0;
const PLATFORM_OVER: f32 = 8.0;

/// Kinds that behave differently.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    Door,
    Platform,
    Button,
}

/// Where it is on its way.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
enum State {
    Resting,
    Going,
    /// At the other end; seconds until it goes back.
    There(f32),
    Returning,
}

/// A moment of a mover's way.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct WayNow(State, f32);

/// A brush model between two places.
#[derive(Clone, Debug, PartialEq)]
pub struct Mover {
    pub kind: Kind,
    /// Number of the entity.
    pub entity: u32,
    pub model: usize,
    /// Where it rests.
    pub rest: Vec3,
    /// From there to its other end.
    pub way: Vec3,
    /// Units a second.
    speed: f32,
    /// Seconds at the other end; negative: for good.
    wait: f32,
    state: State,
    /// Share of the way that it has gone.
    share: f32,
    /// Those who come in here set it off; world space.
    pub field: Option<Bounds>,
    pub name: Option<String>,
    team: Option<String>,
    /// What it sets off itself.
    pub target: Option<String>,
    /// Does not turn back when something is in its way.
    pub crusher: bool,
}

impl Mover {
    /// From its entity; `None` for other entities. `bounds`: of its model.
    pub fn new(number: u32, entity: &Entity, bounds: Bounds) -> Option<Self> {
        let positive = |key: &str, default: f32| entity.number(key).filter(|n| *n != 0.0).unwrap_or(default);
        let size = bounds.max - bounds.min;
        let flags = entity.spawnflags();
        let Motion::Mover { rest, way } = Motion::of_brush_model(entity, &[], bounds.min, bounds.max) else {
            return None;
        };
        let name = entity.get("targetname").map(str::to_owned);
        let (kind, speed, wait) = match entity.class() {
            "func_door" => (Kind::Door, positive("speed", 400.0), positive("wait", 2.0)),
            "func_plat" => (Kind::Platform, positive("speed", 200.0), positive("wait", 1.0)),
            _ => (Kind::Button, positive("speed", 40.0), positive("wait", 1.0)),
        };
        let here = Bounds {
            min: bounds.min + rest,
            max: bounds.max + rest,
        };
        let field = match kind {
            // Named ones wait for what names them.
            _ if name.is_some() => None,
            // These want to be shot at.
            Kind::Door | Kind::Button if positive("health", 0.0) != 0.0 => None,
            Kind::Button => Some(here.grown(1.0)),
            Kind::Door => {
                // Out of the thinnest sides.
                let thin = if size.x <= size.y && size.x <= size.z {
                    Vec3::X
                } else if size.y <= size.z {
                    Vec3::Y
                } else {
                    Vec3::Z
                };
                Some(Bounds {
                    min: here.min - thin * DOOR_REACH,
                    max: here.max + thin * DOOR_REACH,
                })
            }
            Kind::Platform => {
                let rim =
                    Vec3::new(PLATFORM_RIM, PLATFORM_RIM, 0.0).min((size * 0.5 - 1.0).with_z(0.0).max(Vec3::ZERO));
                Some(Bounds {
                    min: here.min + rim,
                    max: (here.max - rim) + Vec3::Z * PLATFORM_OVER,
                })
            }
        };
        Some(Self {
            kind,
            entity: number,
            model: model_of(entity)?,
            rest,
            way,
            speed,
            wait,
            state: State::Resting,
            share: 0.0,
            field,
            name,
            team: entity.get("team").map(str::to_owned),
            target: entity.get("target").map(str::to_owned),
            crusher: flags & 4 != 0,
        })
    }

    /// How far it is from where it rests.
    pub fn offset(&self) -> Vec3 {
        self.way * self.share
    }

    /// Model to world.
    pub fn pose(&self) -> Affine3A {
        Affine3A::from_translation(self.rest + self.offset())
    }

    /// Whether both move together.
    pub fn is_team(&self, other: &Self) -> bool {
        self.team.is_some() && self.team == other.team
    }

    /// Somebody sets it off. True where it starts, which then sets off others.
    pub fn set_off(&mut self) -> bool {
        match self.state {
            State::Resting => {
                self.state = State::Going;
                true
            }
            State::Returning if self.kind == Kind::Door => {
                self.state = State::Going;
                false
            }
            State::There(_) => {
                self.state = State::There(self.wait);
                false
            }
            _ => false,
        }
    }

    /// Puts it where it was.
    pub fn set_way(&mut self, was: WayNow) {
        (self.state, self.share) = (was.0, was.1.clamp(0.0, 1.0));
    }

    /// Where on its way it is, for [`Self::turn_back`] and [`Self::set_way`].
    pub fn way_now(&self) -> WayNow {
        WayNow(self.state, self.share)
    }

    /// Goes the other way from where it was: something is between.
    pub fn turn_back(&mut self, was: WayNow) {
        self.share = was.1;
        self.state = match was.0 {
            State::Going => State::Returning,
            State::Returning => State::Going,
            other => other,
        };
    }

    /// Some time later.
    pub fn advance(&mut self, seconds: f32) {
        let step = seconds * self.speed / self.way.length().max(1e-3);
        match self.state {
            State::Resting => {}
            State::Going => {
                self.share = (self.share + step).min(1.0);
                if self.share >= 1.0 {
                    self.state = State::There(self.wait);
                }
            }
            State::There(left) if left < 0.0 => {}
            State::There(left) if left > seconds => self.state = State::There(left - seconds),
            State::There(_) => self.state = State::Returning,
            State::Returning => {
                self.share = (self.share - step).max(0.0);
                if self.share <= 0.0 {
                    self.state = State::Resting;
                }
            }
        }
    }
}
