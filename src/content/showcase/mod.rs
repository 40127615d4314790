//! The map that ships: an atrium under an oculus, a sun-lit hall, a gallery of coloured lamps, a long corridor, stairs
//! down to a dark cellar, a forge above it, and a big hall under one large light with a mirror between glass tubes.
//!
//! ```text
//!                 gallery ───────────── big hall
//!   corridor ────┘   │                     │
//!      │             │                     │
//!      ├── door ── atrium ───────────── sun hall      y
//!      │             │                  ▒windows▒     │
//!    stairs        forge                 ▒ sky ▒      └── x
//!      └──────────── cellar (under the forge's grate)
//! ```

mod atrium;
mod below;
mod east;
mod fittings;
mod glass;
mod palette;
mod script;
mod west;

use crate::assets::bsp::build::{BuildError, Entity, MapBuilder};
use crate::content::textures::{self, TextureError};
use palette::Palette;
use thiserror::Error;

/// Why the show-case could not be made.
#[derive(Debug, Error)]
pub enum ContentError {
    #[error("the map cannot be built: {0}")]
    Map(#[from] BuildError),
    #[error(transparent)]
    Texture(#[from] TextureError),
}

/// All files of the show-case with their paths in the game folder; the same bytes every time.
///
/// # Errors
/// [`ContentError`] if the description of the map is at fault.
pub fn generate() -> Result<Vec<(String, Vec<u8>)>, ContentError> {
    let mut files = vec![
        ("maps/showcase.bsp".to_owned(), map().build()?.write()),
        ("scripts/showcase.shader".to_owned(), script::text().into_bytes()),
    ];
    for texture in textures::all(script::sun_direction()) {
        files.push((format!("{}.png", texture.name), textures::encode(&texture)?));
    }
    Ok(files)
}

/// The description of the map.
pub fn map() -> MapBuilder {
    let worldspawn = Entity::new("worldspawn")
        .with("message", "q3rays show-case")
        .with("_keepLights", "1");
    let mut map = MapBuilder::new(worldspawn);
    let paints = Palette::new(&mut map);
    let atrium = atrium::build(&mut map, &paints);
    let gallery = west::gallery(&mut map, &paints, atrium);
    let corridor = west::corridor(&mut map, &paints, atrium, &gallery);
    let sun_hall = east::sun_hall(&mut map, &paints, atrium);
    east::big_hall(&mut map, &paints, gallery.last, sun_hall);
    let forge = below::forge(&mut map, &paints, atrium);
    let stairs = below::stairs(&mut map, &paints, corridor);
    below::cellar(&mut map, &paints, stairs, forge);
    spawns(&mut map);
    map
}

/// Deathmatch spawns, each with a view worth a picture; the first is the README's.
fn spawns(map: &mut MapBuilder) {
    const SPAWNS: [([i32; 3], i32); 10] = [
        ([200, -96, 25], 117),    // atrium: sunlight through the arches, the gallery's colours behind
        ([1180, 36, 25], 207),    // sun hall: the windows and their light on the floor
        ([-540, 500, 25], 12),    // gallery: the row of coloured lamps
        ([-688, 690, 25], 270),   // corridor: its whole length
        ([-740, -1000, 25], 12),  // head of the stairs
        ([440, -620, -231], 232), // cellar: the grate's shadows
        ([280, -480, 25], 215),   // forge: the coals
        ([690, 950, 25], 329),    // big hall: the statue under the large light
        ([-216, -140, 25], 46),   // atrium again: columns and statue
        ([1256, 756, 25], 355),   // big hall: the mirror between glass tubes
    ];
    for (origin, angle) in SPAWNS {
        map.entity(Entity::spawn(origin, angle));
    }
}
