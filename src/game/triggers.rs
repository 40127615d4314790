//! What happens to who walks into it: jump pads, teleporters, things that hurt.

use super::collision::{CollisionWorld, Placed};
use super::movement::GRAVITY;
use crate::assets::entities::Entity;
use glam::{Affine3A, Quat, Vec3};
use std::sync::Arc;

/// What a trigger does.
#[derive(Clone, Debug, PartialEq)]
pub enum Effect {
    /// Throws with a velocity.
    Push(Vec3),
    /// Puts elsewhere, looking along `yaw` degrees.
    Teleport { to: Vec3, yaw: f32 },
    /// Takes so much health a second.
    Hurt(f32),
    /// Sets off what has a name.
    Fire(String),
}

/// A volume that acts on who touches it.
#[derive(Clone, Debug, PartialEq)]
pub struct Trigger {
    pub placed: Placed,
    pub effect: Arc<Effect>,
}

/// Damage of a `trigger_hurt` that says none, and how often a second it is dealt; slow ones hurt once a second.
const DAMAGE: f32 = 5.0;
const OFTEN: f32 = 10.0;
const START_OFF: i32 = 1;
const SLOW: i32 = 16;
const SPECTATORS_ONLY: i32 = 1;

/// The number of an entity's brush model.
pub fn model_of(entity: &Entity) -> Option<usize> {
    entity.get("model")?.strip_prefix('*')?.parse().ok()
}

/// All triggers of a map.
pub fn triggers(entities: &[Entity], world: &CollisionWorld) -> Vec<Trigger> {
    entities.iter().filter_map(|e| trigger(e, entities, world)).collect()
}

fn trigger(entity: &Entity, entities: &[Entity], world: &CollisionWorld) -> Option<Trigger> {
    let model = model_of(entity)?;
    let bounds = world.bounds(model)?;
    let origin = entity.origin();
    let target = || {
        let name = entity.get("target")?;
        entities.iter().find(|e| e.get("targetname") == Some(name))
    };
    let effect = match entity.class() {
        "trigger_push" => Effect::Push(thrown(bounds.centre() + origin, target()?.origin())?),
        "trigger_teleport" if entity.spawnflags() & SPECTATORS_ONLY == 0 => {
            let there = target()?;
            Effect::Teleport {
                to: there.origin() + Vec3::Z,
                yaw: there.number("angle").unwrap_or(0.0),
            }
        }
        "trigger_hurt" if entity.spawnflags() & START_OFF == 0 => {
            let damage = entity.number("dmg").filter(|d| *d != 0.0).unwrap_or(DAMAGE);
            let often = if entity.spawnflags() & SLOW != 0 { 1.0 } else { OFTEN };
            Effect::Hurt(damage * often)
        }
        "trigger_multiple" => Effect::Fire(entity.get("target")?.to_owned()),
        _ => return None,
    };
    Some(Trigger {
        placed: Placed {
            model,
            pose: Affine3A::from_translation(origin),
        },
        effect: effect.into(),
    })
}

/// The velocity that brings one from a jump pad to the top of a flight at `target`; `None` where that is not above it.
fn thrown(from: Vec3, target: Vec3) -> Option<Vec3> {
    let way = target - from;
    let time = (way.z / (0.5 * GRAVITY)).sqrt();
    (time > 0.0 && time.is_finite()).then(|| way.with_z(0.0) / time + Vec3::Z * (time * GRAVITY))
}

/// Unit vector along a yaw, degrees.
pub fn along(yaw: f32) -> Vec3 {
    Quat::from_rotation_z(yaw.to_radians()) * Vec3::X
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn flights_end_on_top_of_their_target() {
        let (from, target) = (Vec3::new(10.0, 20.0, 0.0), Vec3::new(410.0, -280.0, 200.0));
        let v = thrown(from, target).unwrap();
        let time = v.z / GRAVITY;
        let top = from + v * time - Vec3::Z * (0.5 * GRAVITY * time * time);
        assert!(top.distance(target) < 0.1, "{top}");
        assert!(thrown(from, from - Vec3::Z).is_none());
    }
}
