//! Somebody in a map: the body, what it touches, and what moves because of it. In fixed steps of time.

use super::collision::{CollisionWorld, PLAYER_SOLID, Placed};
use super::movement::{Body, Command, Depth, Mode, STEP, World, extent};
use super::movers::{Kind, Mover, WayNow};
use super::triggers::{Effect, Trigger, along, model_of, triggers};
use crate::assets::bsp::lumps::content_flags;
use crate::assets::bsp::{Bounds, Bsp};
use crate::assets::entities::Entity;
use crate::scene::clock::Clock;
use crate::scene::entity_geometry::EntityState;
use crate::scene::items::{self, PlacedItem};
use crate::scene::motion::Motion;
use crate::scene::spawns::Spawn;
use glam::Vec3;

/// Health at a spawn, and what is taken a second in liquids, at each depth.
const HEALTH: f32 = 100.0;
const LAVA: f32 = 43.0;
const SLIME: f32 = 14.0;
/// Speed out of a teleporter, and seconds until the keys count again.
const TELEPORT_SPEED: f32 = 400.0;
const TELEPORT_HOLD: f32 = 0.16;
/// An item is taken by who stands within this of its place.
const ITEM_REACH: [Vec3; 2] = [Vec3::new(-50.0, -36.0, -36.0), Vec3::new(44.0, 36.0, 36.0)];
/// Below the map by this much one has fallen out of it.
const OUT: f32 = 1024.0;
/// Most time that is made up for after a stop, seconds.
const MOST_BEHIND: f32 = 0.25;

/// What happened in some steps, for those who show it.
#[derive(Clone, Debug, PartialEq)]
pub enum Event {
    /// Looks along this yaw now.
    Turned(f32),
    Thrown,
    Teleported,
    /// Health came to nothing: back at a spawn.
    Died,
    /// Out of the map: likewise.
    Fell,
    Took(&'static str),
    Moved {
        entity: u32,
    },
}

/// An item and when it is back.
struct Item {
    placed: PlacedItem,
    /// Seconds until it is there again; 0: it is.
    gone: f32,
}

/// A brush model that follows the clock.
struct Driven {
    model: usize,
    motion: Motion,
}

/// Everything about a [`Play`] that changes, to go on from later.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct PlayState {
    body: Body,
    health: f32,
    next_spawn: usize,
    behind: f32,
    /// Scene time of the last step.
    stepped: Clock,
    movers: Vec<WayNow>,
    /// Seconds until each item is back.
    items: Vec<f32>,
}

/// A map with somebody in it.
pub struct Play {
    pub collision: CollisionWorld,
    pub body: Body,
    pub health: f32,
    triggers: Vec<Trigger>,
    pub movers: Vec<Mover>,
    driven: Vec<Driven>,
    items: Vec<Item>,
    spawns: Vec<Spawn>,
    next_spawn: usize,
    bounds: Bounds,
    /// Brush models where they stand now: movers, then driven ones, then those that never move.
    placed: Vec<Placed>,
    /// Time not yet stepped through, seconds.
    behind: f32,
    /// Scene time of the last step.
    stepped: Clock,
    /// Steps so far.
    pub steps: u64,
    frozen: bool,
}

impl Play {
    /// Somebody at the first spawn of a map.
    pub fn new(bsp: &Bsp, entities: &[Entity], spawns: &[Spawn]) -> Self {
        let collision = CollisionWorld::new(bsp);
        let mut out = Self {
            triggers: triggers(entities, &collision),
            movers: Vec::new(),
            driven: Vec::new(),
            items: items::placed(bsp, entities)
                .into_iter()
                .map(|placed| Item { placed, gone: 0.0 })
                .collect(),
            spawns: spawns.to_vec(),
            next_spawn: 0,
            bounds: bsp.world_bounds(),
            placed: Vec::new(),
            behind: 0.0,
            stepped: Clock::default(),
            steps: 0,
            frozen: false,
            body: Body::default(),
            health: HEALTH,
            collision,
        };
        for (number, entity) in (0u32..).zip(entities) {
            let Some(model) = model_of(entity) else { continue };
            let Some(bounds) = out.collision.bounds(model) else {
                continue;
            };
            if let Some(mover) = Mover::new(number, entity, bounds) {
                out.movers.push(mover);
            } else if entity.class().starts_with("func_") {
                out.driven.push(Driven {
                    model,
                    motion: Motion::of_brush_model(entity, entities, bounds.min, bounds.max),
                });
            }
        }
        out.place(Clock::default());
        out.respawn();
        out
    }

    /// Brush models where they stand.
    pub fn placed(&self) -> &[Placed] {
        &self.placed
    }

    /// Back at a spawn: the next in turn. Returns where one looks, degrees.
    pub fn respawn(&mut self) -> f32 {
        let mode = self.body.mode;
        let spawn = self.spawns.get(self.next_spawn % self.spawns.len().max(1)).cloned();
        self.next_spawn += 1;
        let (origin, yaw) = spawn.map_or((self.bounds.centre(), 0.0), |s| (Vec3::from(s.origin), s.angle));
        self.body = Body {
            mode,
            // Spawns lie a little in the floor, some of them.
            ..Body::at(origin + Vec3::Z * 9.0)
        };
        self.health = HEALTH;
        yaw
    }

    /// All that changes, as it is now.
    pub fn state(&self) -> PlayState {
        PlayState {
            body: self.body,
            health: self.health,
            next_spawn: self.next_spawn,
            behind: self.behind,
            stepped: self.stepped,
            movers: self.movers.iter().map(Mover::way_now).collect(),
            items: self.items.iter().map(|i| i.gone).collect(),
        }
    }

    /// Goes on from a state of the same map. False, and nothing changed, where it is another map's.
    pub fn restore(&mut self, state: &PlayState) -> bool {
        if (state.movers.len(), state.items.len()) != (self.movers.len(), self.items.len()) {
            return false;
        }
        (self.body, self.health) = (state.body, state.health);
        (self.next_spawn, self.behind) = (state.next_spawn, state.behind);
        self.movers
            .iter_mut()
            .zip(&state.movers)
            .for_each(|(m, was)| m.set_way(*was));
        self.items
            .iter_mut()
            .zip(&state.items)
            .for_each(|(i, gone)| i.gone = *gone);
        self.place(state.stepped);
        true
    }

    /// Lets `seconds` go by, the scene's time being `clock` at their end; what is left over is made up for later. In a scene that is
    /// `frozen` nothing moves but the player.
    pub fn advance(&mut self, seconds: f32, clock: Clock, frozen: bool, command: &Command) -> Vec<Event> {
        self.frozen = frozen;
        self.behind = (self.behind + seconds).min(MOST_BEHIND);
        let mut events = Vec::new();
        let mut command = *command;
        while self.behind >= STEP {
            self.behind -= STEP;
            let ago = if frozen { 0.0 } else { f64::from(self.behind) };
            self.step(clock.after(-ago), &command, &mut events);
            if let Some(Event::Turned(yaw)) = events.iter().rev().find(|e| matches!(e, Event::Turned(_))) {
                command.yaw = *yaw;
            }
        }
        events
    }

    /// One step of time, which ends at `clock`.
    pub fn step(&mut self, clock: Clock, command: &Command, events: &mut Vec<Event>) {
        self.steps += 1;
        self.move_models(clock, events);
        let world = World {
            collision: &self.collision,
            placed: &self.placed,
        };
        self.body.step(&world, command);
        if !self.frozen {
            for item in &mut self.items {
                item.gone = (item.gone - STEP).max(0.0);
            }
        }
        if self.body.mode == Mode::NoClip {
            return;
        }
        self.touch_triggers(events);
        self.touch_movers(events);
        self.take_items(events);
        self.suffer(events);
    }

    fn place(&mut self, clock: Clock) {
        self.stepped = clock;
        self.placed.clear();
        let movers = self.movers.iter().map(|m| Placed {
            model: m.model,
            pose: m.pose(),
        });
        let driven = self.driven.iter().map(|d| Placed {
            model: d.model,
            pose: d.motion.pose(clock),
        });
        self.placed.extend(movers.chain(driven));
    }

    /// Moves what moves, and who stands on it or in its way.
    fn move_models(&mut self, clock: Clock, events: &mut Vec<Event>) {
        let before = self.placed.clone();
        let ways: Vec<_> = self.movers.iter().map(Mover::way_now).collect();
        if !self.frozen {
            self.movers.iter_mut().for_each(|m| m.advance(STEP));
        }
        self.place(clock);
        if self.body.mode == Mode::NoClip {
            return;
        }
        for (i, old) in before.into_iter().enumerate() {
            let new = self.placed[i];
            if old.pose == new.pose {
                continue;
            }
            let size = extent(self.body.crouched);
            let rides = self.body.ground.is_some_and(|g| g.model == new.model);
            let shoved = self.collision.touches(size, self.body.origin, PLAYER_SOLID, &new);
            if !rides && !shoved {
                continue;
            }
            let there = (new.pose * old.pose.inverse()).transform_point3(self.body.origin);
            let fits = |at: Vec3| {
                let sweep = self.collision.sweep(size, at, at, PLAYER_SOLID, &self.placed);
                !sweep.all_solid
            };
            if fits(there) {
                self.body.origin = there;
            } else if shoved && !fits(self.body.origin) {
                if self.movers.get(i).is_none_or(|m| m.crusher) {
                    self.die(events);
                    continue;
                }
                // All that move together go back to where they were, where nobody was inside of them.
                for (k, was) in ways.iter().enumerate() {
                    if k == i || self.movers[k].is_team(&self.movers[i]) {
                        self.movers[k].turn_back(*was);
                        self.placed[k].pose = self.movers[k].pose();
                    }
                }
            }
        }
    }

    fn die(&mut self, events: &mut Vec<Event>) {
        let yaw = self.respawn();
        events.extend([Event::Died, Event::Turned(yaw)]);
    }

    fn touch_triggers(&mut self, events: &mut Vec<Event>) {
        let size = extent(self.body.crouched);
        let touched: Vec<_> = self
            .triggers
            .iter()
            .filter(|t| self.collision.touches(size, self.body.origin, -1, &t.placed))
            .map(|t| t.effect.clone())
            .collect();
        for effect in touched {
            match &*effect {
                Effect::Push(velocity) => {
                    if !self.body.thrown {
                        events.push(Event::Thrown);
                    }
                    self.body.velocity = *velocity;
                    self.body.ground = None;
                    self.body.thrown = true;
                }
                Effect::Teleport { to, yaw } => {
                    self.body.origin = *to;
                    self.body.velocity = along(*yaw) * TELEPORT_SPEED;
                    self.body.held = TELEPORT_HOLD;
                    self.body.view_lag = 0.0;
                    events.extend([Event::Teleported, Event::Turned(*yaw)]);
                }
                Effect::Hurt(rate) => self.health -= rate * STEP,
                Effect::Fire(name) => self.fire(name, events),
            }
        }
    }

    /// Sets off what has a name.
    fn fire(&mut self, name: &str, events: &mut Vec<Event>) {
        let named: Vec<usize> = (0..self.movers.len())
            .filter(|i| self.movers[*i].name.as_deref() == Some(name))
            .collect();
        for i in named {
            self.set_off(i, events);
        }
    }

    fn set_off(&mut self, number: usize, events: &mut Vec<Event>) {
        for i in 0..self.movers.len() {
            if (i == number || self.movers[i].is_team(&self.movers[number])) && self.movers[i].set_off() {
                events.push(Event::Moved {
                    entity: self.movers[i].entity,
                });
                if let Some(target) = self.movers[i].target.clone() {
                    self.fire(&target, events);
                }
            }
        }
    }

    fn touch_movers(&mut self, events: &mut Vec<Event>) {
        let size = extent(self.body.crouched);
        let (low, high) = (self.body.origin + size.mins, self.body.origin + size.maxs);
        for i in 0..self.movers.len() {
            let m = &self.movers[i];
            let inside = m
                .field
                .is_some_and(|f| low.cmple(f.max).all() && high.cmpge(f.min).all());
            // A platform stays up while somebody is on it.
            let rides = m.kind == Kind::Platform && self.body.ground.is_some_and(|g| g.model == m.model);
            if inside || rides {
                self.set_off(i, events);
            }
        }
    }

    fn take_items(&mut self, events: &mut Vec<Event>) {
        for item in &mut self.items {
            let off = self.body.origin - Vec3::from(item.placed.place.translation);
            let [low, high] = ITEM_REACH;
            if item.gone == 0.0 && off.cmpge(low).all() && off.cmple(high).all() {
                item.gone = seconds_gone(item.placed.item.kind);
                if item.gone > 0.0 {
                    events.push(Event::Took(item.placed.item.class));
                }
            }
        }
    }

    fn suffer(&mut self, events: &mut Vec<Event>) {
        let depth = match self.body.depth {
            Depth::Dry => 0.0,
            Depth::Feet => 1.0,
            Depth::Waist => 2.0,
            Depth::Eyes => 3.0,
        };
        if self.body.liquid & content_flags::LAVA != 0 {
            self.health -= LAVA * depth * STEP;
        } else if self.body.liquid & content_flags::SLIME != 0 {
            self.health -= SLIME * depth * STEP;
        }
        let fell = self.body.origin.z < self.bounds.min.z - OUT;
        if fell {
            events.push(Event::Fell);
        }
        if self.health <= 0.0 || fell {
            self.die(events);
        }
    }

    /// Entities that are not as the map has them at rest, for [`crate::render::frame::FrameInput`].
    pub fn states(&self) -> Vec<EntityState> {
        let movers = self.movers.iter().map(|m| EntityState {
            entity: m.entity,
            offset: m.offset(),
            hidden: false,
        });
        let items = self.items.iter().map(|i| EntityState {
            entity: i.placed.number,
            offset: Vec3::ZERO,
            hidden: i.gone > 0.0,
        });
        movers
            .chain(items)
            .filter(|s| s.hidden || s.offset != Vec3::ZERO)
            .collect()
    }
}

/// Seconds until an item that was taken is back; 0 for what is not taken.
fn seconds_gone(kind: items::Kind) -> f32 {
    match kind {
        items::Kind::Weapon => 5.0,
        items::Kind::Ammo => 40.0,
        items::Kind::Armor => 25.0,
        items::Kind::Health => 35.0,
        items::Kind::Powerup => 120.0,
        items::Kind::Holdable => 60.0,
        items::Kind::Flag => 0.0,
    }
}
