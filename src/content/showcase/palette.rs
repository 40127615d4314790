//! The paints of the show-case.

use crate::assets::bsp::build::{MapBuilder, Mapping, Paint, Paints};
use crate::assets::bsp::lumps::{content_flags, surface_flags};

/// Every paint in use. Lamps are stretched once over their panel; the rest repeats in world units.
pub struct Palette {
    pub brick: Paint,
    pub stone: Paint,
    pub tiles: Paint,
    pub checker: Paint,
    pub marble: Paint,
    pub concrete: Paint,
    pub plaster: Paint,
    pub wood: Paint,
    pub metal: Paint,
    pub trim: Paint,
    pub door: Paint,
    pub grate: Paint,
    pub glass: Paint,
    pub mirror: Paint,
    pub sky: Paint,
    pub coffer: Paint,
    pub sconce: Paint,
    pub strip: Paint,
    pub hall_light: Paint,
    pub cellar_lamp: Paint,
    pub ember: Paint,
    /// Red, teal, amber, violet.
    pub colored: [Paint; 4],
}

impl Palette {
    pub fn new(map: &mut MapBuilder) -> Self {
        let name = |stem: &str| format!("textures/showcase/{stem}");
        let mut surface = |stem: &str, units: f32| map.paint(&name(stem), units);
        let brick = surface("brick", 128.0);
        let stone = surface("stone", 160.0);
        let tiles = surface("tiles", 192.0);
        let checker = surface("checker", 128.0);
        let marble = surface("marble", 128.0);
        let concrete = surface("concrete", 160.0);
        let plaster = surface("plaster", 192.0);
        let wood = surface("wood", 128.0);
        let metal = surface("metal", 128.0);
        let trim = surface("trim", 32.0);
        let mut flagged = |stem: &str, mapping: Mapping, surface: i32, content: i32| Paint {
            shader: map.shader(&name(stem), surface, content),
            mapping,
        };
        let lamp = surface_flags::NODLIGHT | surface_flags::NOMARKS;
        let mut light = |stem: &str| flagged(stem, Mapping::Fit, lamp, content_flags::SOLID);
        let coffer = light("light_coffer");
        let sconce = light("light_sconce");
        let strip = light("light_strip");
        let hall_light = light("light_hall");
        let cellar_lamp = light("light_cellar");
        let colored = ["light_red", "light_teal", "light_amber", "light_violet"].map(light);
        let sky = surface_flags::SKY | surface_flags::NOIMPACT | surface_flags::NOLIGHTMAP | surface_flags::NODLIGHT;
        let grate = content_flags::TRANSLUCENT | content_flags::DETAIL;
        Self {
            brick,
            stone,
            tiles,
            checker,
            marble,
            concrete,
            plaster,
            wood,
            metal,
            trim,
            door: flagged("door", Mapping::Fit, 0, content_flags::SOLID),
            grate: flagged(
                "grate",
                Mapping::World(32.0),
                surface_flags::ALPHASHADOW | surface_flags::NOMARKS,
                grate,
            ),
            glass: flagged(
                "glass",
                Mapping::Fit,
                surface_flags::NOLIGHTMAP | surface_flags::NOMARKS,
                grate,
            ),
            mirror: flagged(
                "mirror",
                Mapping::Fit,
                surface_flags::NOLIGHTMAP | surface_flags::NOMARKS,
                content_flags::SOLID,
            ),
            sky: flagged("sky", Mapping::World(256.0), sky, content_flags::SOLID),
            coffer,
            sconce,
            strip,
            hall_light,
            cellar_lamp,
            ember: flagged("ember", Mapping::World(128.0), lamp, content_flags::SOLID),
            colored,
        }
    }
}

/// Faces of a room: walls, floor, ceiling.
pub fn room(walls: Paint, floor: Paint, ceiling: Paint) -> Paints {
    let walls = Some(walls);
    [walls, walls, walls, walls, Some(floor), Some(ceiling)]
}
