//! The entity lump's text.

use glam::Vec3;
use std::fmt::Write;

/// One entity: keys and values in the order given. Quotes and line breaks cannot be stored and are dropped.
#[derive(Clone, Debug, PartialEq)]
pub struct Entity {
    pairs: Vec<(String, String)>,
}

impl Entity {
    /// An entity of a class.
    pub fn new(class: &str) -> Self {
        Self { pairs: Vec::new() }.with("classname", class)
    }

    /// A deathmatch spawn: `origin` is the player's, 24 units above the floor it stands on; `angle` is the yaw in degrees.
    pub fn spawn(origin: [i32; 3], angle: i32) -> Self {
        Self::new("info_player_deathmatch")
            .with("origin", &format!("{} {} {}", origin[0], origin[1], origin[2]))
            .with("angle", &angle.to_string())
    }

    /// A point light of `light` (the map compiler's units) and linear colour.
    pub fn light(origin: Vec3, light: f32, color: [f32; 3]) -> Self {
        Self::new("light")
            .with("origin", &format!("{} {} {}", origin.x, origin.y, origin.z))
            .with("light", &light.to_string())
            .with("_color", &format!("{} {} {}", color[0], color[1], color[2]))
    }

    /// The entity with one more key.
    #[must_use]
    pub fn with(mut self, key: &str, value: &str) -> Self {
        let clean = |s: &str| s.replace(['"', '\n', '\r'], "");
        self.pairs.push((clean(key), clean(value)));
        self
    }

    /// Value of a key.
    pub fn get(&self, key: &str) -> Option<&str> {
        self.pairs.iter().find(|(k, _)| k == key).map(|(_, v)| v.as_str())
    }

    /// Class name.
    pub fn class(&self) -> &str {
        self.get("classname").unwrap_or_default()
    }

    /// Appends the entity as the lump spells it.
    pub(super) fn write(&self, out: &mut String) {
        out.push_str("{\n");
        for (key, value) in &self.pairs {
            let _ = writeln!(out, "\"{key}\" \"{value}\"");
        }
        out.push_str("}\n");
    }
}
