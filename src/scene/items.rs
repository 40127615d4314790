//! What a map's item entities show: models, and how they stand.

use super::motion::Motion;
use crate::assets::bsp::Bsp;
use crate::assets::entities::Entity;
use glam::{Affine3A, Vec3};

/// Models of an item and how it behaves.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Item {
    pub class: &'static str,
    pub kind: Kind,
    /// One or two models, as paths.
    pub models: [&'static str; 2],
}

/// Kinds of items that stand differently.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    Weapon,
    Ammo,
    Armor,
    Health,
    Powerup,
    Holdable,
    Flag,
}

macro_rules! items {
    ($($kind:ident: $($class:literal $model:literal $(+ $second:literal)?;)*)*) => {
        /// All items of the game and of Team Arena.
        pub const ITEMS: &[Item] = &[$($(Item {
            class: $class,
            kind: Kind::$kind,
            models: [concat!("models/", $model, ".md3"), concat!("", $("models/", $second, ".md3")?)],
        },)*)*];
    };
}

items! {
    Weapon:
        "weapon_gauntlet" "weapons2/gauntlet/gauntlet";
        "weapon_shotgun" "weapons2/shotgun/shotgun";
        "weapon_machinegun" "weapons2/machinegun/machinegun";
        "weapon_grenadelauncher" "weapons2/grenadel/grenadel";
        "weapon_rocketlauncher" "weapons2/rocketl/rocketl";
        "weapon_lightning" "weapons2/lightning/lightning";
        "weapon_railgun" "weapons2/railgun/railgun";
        "weapon_plasmagun" "weapons2/plasma/plasma";
        "weapon_bfg" "weapons2/bfg/bfg";
        "weapon_grapplinghook" "weapons2/grapple/grapple";
        "weapon_nailgun" "weapons/nailgun/nailgun";
        "weapon_prox_launcher" "weapons/proxmine/proxmine";
        "weapon_chaingun" "weapons/vulcan/vulcan";
    Ammo:
        "ammo_shells" "powerups/ammo/shotgunam";
        "ammo_bullets" "powerups/ammo/machinegunam";
        "ammo_grenades" "powerups/ammo/grenadeam";
        "ammo_cells" "powerups/ammo/plasmaam";
        "ammo_lightning" "powerups/ammo/lightningam";
        "ammo_rockets" "powerups/ammo/rocketam";
        "ammo_slugs" "powerups/ammo/railgunam";
        "ammo_bfg" "powerups/ammo/bfgam";
        "ammo_nails" "powerups/ammo/nailgunam";
        "ammo_mines" "powerups/ammo/proxmineam";
        "ammo_belt" "powerups/ammo/chaingunam";
    Armor:
        "item_armor_shard" "powerups/armor/shard" + "powerups/armor/shard_sphere";
        "item_armor_combat" "powerups/armor/armor_yel";
        "item_armor_body" "powerups/armor/armor_red";
    Health:
        "item_health_small" "powerups/health/small_cross" + "powerups/health/small_sphere";
        "item_health" "powerups/health/medium_cross" + "powerups/health/medium_sphere";
        "item_health_large" "powerups/health/large_cross" + "powerups/health/large_sphere";
        "item_health_mega" "powerups/health/mega_cross" + "powerups/health/mega_sphere";
    Powerup:
        "item_quad" "powerups/instant/quad" + "powerups/instant/quad_ring";
        "item_enviro" "powerups/instant/enviro" + "powerups/instant/enviro_ring";
        "item_haste" "powerups/instant/haste" + "powerups/instant/haste_ring";
        "item_invis" "powerups/instant/invis" + "powerups/instant/invis_ring";
        "item_regen" "powerups/instant/regen" + "powerups/instant/regen_ring";
        "item_flight" "powerups/instant/flight" + "powerups/instant/flight_ring";
        "item_scout" "powerups/scout";
        "item_guard" "powerups/guard";
        "item_doubler" "powerups/doubler";
        "item_ammoregen" "powerups/ammo";
    Holdable:
        "holdable_teleporter" "powerups/holdable/teleporter";
        "holdable_medkit" "powerups/holdable/medkit" + "powerups/holdable/medkit_sphere";
        "holdable_kamikaze" "powerups/kamikazi";
        "holdable_portal" "powerups/holdable/porter";
        "holdable_invulnerability" "powerups/holdable/invulnerability";
    Flag:
        "team_CTF_redflag" "flags/r_flag";
        "team_CTF_blueflag" "flags/b_flag";
        "team_CTF_neutralflag" "flags/n_flag";
}

/// Half width of an item's box, and how far it falls at most, units.
const HALF: f32 = 15.0;
const FALL: f32 = 4096.0;
/// Weapons lie about larger than they are held, and higher than other items.
const WEAPON_SCALE: f32 = 1.5;
const WEAPON_HEIGHT: f32 = 8.0;
/// Height of a power-up's ring over it, units, and how it turns, turns a second.
const RING_HEIGHT: f32 = 12.0;
const CONTENTS_SOLID: i32 = 1;

/// An item of a map: its model and how it stands.
#[derive(Clone, Debug, PartialEq)]
pub struct PlacedItem {
    pub item: &'static Item,
    /// Number of the entity.
    pub number: u32,
    /// Where it stands, on the floor unless it floats.
    pub place: Affine3A,
}

/// The items that free-for-all shows.
pub fn placed(bsp: &Bsp, entities: &[Entity]) -> Vec<PlacedItem> {
    let solids = Solids::new(bsp);
    entities
        .iter()
        .enumerate()
        .filter_map(|(number, entity)| {
            let item = ITEMS.iter().find(|i| i.class.eq_ignore_ascii_case(entity.class()))?;
            if entity.number("notfree").unwrap_or(0.0) != 0.0 {
                return None;
            }
            let mut origin = entity.origin();
            if entity.spawnflags() & 1 == 0 {
                origin.z -= solids.drop(origin);
            }
            let yaw = entity.number("angle").unwrap_or(0.0).to_radians();
            Some(PlacedItem {
                item,
                number: number as u32,
                place: Affine3A::from_translation(origin) * Affine3A::from_rotation_z(yaw),
            })
        })
        .collect()
}

impl PlacedItem {
    /// Motion of its first or second model. `middle`: of the model's box.
    pub fn motion(&self, second: bool, middle: Vec3) -> Motion {
        let origin = Affine3A::from_translation(self.place.translation.into());
        match (self.item.kind, second) {
            (Kind::Flag, _) => Motion::Still(self.place),
            (Kind::Weapon, _) => {
                let centred = Affine3A::from_translation(Vec3::Z * WEAPON_HEIGHT)
                    * Affine3A::from_scale(Vec3::splat(WEAPON_SCALE));
                let mut motion = Motion::item(origin * centred, self.number, false, true);
                if let Motion::Item { shift, .. } = &mut motion {
                    *shift = -middle;
                }
                motion
            }
            (Kind::Powerup, true) => Motion::item(
                origin * Affine3A::from_translation(Vec3::Z * RING_HEIGHT),
                self.number,
                true,
                true,
            ),
            (Kind::Health, true) => Motion::item(origin, self.number, false, false),
            (kind, _) => Motion::item(origin, self.number, kind == Kind::Health, true),
        }
    }
}

/// The world's solid brushes.
struct Solids<'a> {
    bsp: &'a Bsp,
    brushes: Vec<usize>,
}

impl<'a> Solids<'a> {
    fn new(bsp: &'a Bsp) -> Self {
        let world = bsp.models.first().map_or(0..0, |m| {
            let first = m.first_brush.max(0) as usize;
            first..first + m.brush_count.max(0) as usize
        });
        let solid = |i: &usize| {
            let shader = bsp.brushes[*i].shader.max(0) as usize;
            bsp.shaders
                .get(shader)
                .is_some_and(|s| s.content_flags & CONTENTS_SOLID != 0)
        };
        Self {
            bsp,
            brushes: world.filter(|i| *i < bsp.brushes.len()).filter(solid).collect(),
        }
    }

    /// How far an item's box falls from a place; 0 where it starts in solid or never lands.
    fn drop(&self, from: Vec3) -> f32 {
        let mut fall = f32::INFINITY;
        for &index in &self.brushes {
            let brush = &self.bsp.brushes[index];
            let sides = brush.first_side.max(0) as usize..(brush.first_side + brush.side_count).max(0) as usize;
            // The box is a point among planes moved out by its extent.
            let (mut enter, mut leave) = (f32::NEG_INFINITY, f32::INFINITY);
            for side in self.bsp.brush_sides.get(sides).unwrap_or_default() {
                let plane = &self.bsp.planes[side.plane as usize];
                let n = Vec3::from(plane.normal);
                let outside = n.dot(from) - plane.dist - n.abs().dot(Vec3::splat(HALF));
                // Distance after a fall of t: outside − t·n.z.
                if n.z > 0.0 {
                    enter = enter.max(outside / n.z);
                } else if n.z < 0.0 {
                    leave = leave.min(outside / n.z);
                } else if outside > 0.0 {
                    enter = f32::INFINITY;
                }
            }
            if enter >= leave || leave <= 0.0 {
                continue;
            }
            if enter < -0.01 {
                return 0.0;
            }
            fall = fall.min(enter.max(0.0));
        }
        if fall < FALL { fall } else { 0.0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_item_has_a_model_and_a_name_of_its_own() {
        for (i, item) in ITEMS.iter().enumerate() {
            assert!(item.models[0].ends_with(".md3"), "{item:?}");
            assert!(ITEMS[..i].iter().all(|o| o.class != item.class), "{item:?}");
        }
    }
}
