//! Parametric maps for tests, each with the shader script and images it needs.
//!
//! Every fixture's walls have a uniform albedo, given as the encoded (sRGB) byte of all three channels; its emitters are
//! white with a constant radiance of 0.75·N/255 luxel units for a surfacelight of N. Boxes start at the origin.

use super::{BuildError, Entity, MapBuilder, Mapping, Paint, shape::Bounds, shape::Face};
use crate::assets::bsp::file::Bsp;
use crate::assets::bsp::lumps::{content_flags, surface_flags};
use glam::Vec3;
use image::{ExtendedColorType, ImageEncoder, codecs::png::PngEncoder};
use std::fmt::Write;

/// A small map and everything needed to load it.
#[derive(Clone, Debug)]
pub struct Fixture {
    pub name: String,
    pub bsp: Bsp,
    /// Text of `scripts/<name>.shader`.
    pub script: String,
    /// Path and PNG bytes.
    pub images: Vec<(String, Vec<u8>)>,
}

impl Fixture {
    /// All files as they would lie in a game folder.
    pub fn files(&self) -> Vec<(String, Vec<u8>)> {
        let mut files = vec![
            (format!("maps/{}.bsp", self.name), self.bsp.write()),
            (
                format!("scripts/{}.shader", self.name),
                self.script.clone().into_bytes(),
            ),
        ];
        files.extend(self.images.iter().cloned());
        files
    }
}

/// A map in the making with its shaders.
pub(super) struct Draft {
    pub map: MapBuilder,
    script: String,
    images: Vec<(String, Vec<u8>)>,
}

impl Draft {
    pub fn new() -> Self {
        Self {
            map: MapBuilder::new(Entity::new("worldspawn").with("message", "q3rays fixture")),
            script: String::new(),
            images: Vec::new(),
        }
    }

    /// Uniform diffuse paint.
    pub fn grey(&mut self, albedo: u8) -> Paint {
        let name = format!("textures/fixture/grey{albedo}");
        self.image(&name, albedo);
        self.map.paint(&name, 64.0)
    }

    /// Emitter over a black (or, with `albedo`, grey) surface.
    pub fn emitter(&mut self, surfacelight: u32, two_sided: bool, albedo: u8) -> Paint {
        let side = if two_sided { "_twosided" } else { "" };
        let name = format!("textures/fixture/light{surfacelight}_{albedo}{side}");
        let image = format!("textures/fixture/grey{albedo}");
        self.image(&image, albedo);
        let cull = if two_sided { "\tcull none\n" } else { "" };
        let _ = write!(
            self.script,
            "{name}\n{{\n{cull}\tq3map_surfacelight {surfacelight}\n\tq3map_lightRGB 1 1 1\n\tq3map_backsplash 0 0\n\
             \t{{\n\t\tmap {image}.png\n\t\trgbGen identity\n\t}}\n}}\n"
        );
        Paint {
            shader: self.map.shader(&name, surface_flags::NODLIGHT, content_flags::SOLID),
            mapping: Mapping::Fit,
        }
    }

    fn image(&mut self, name: &str, value: u8) {
        let path = format!("{name}.png");
        if self.images.iter().any(|(p, _)| *p == path) {
            return;
        }
        const SIDE: u32 = 4;
        let mut png = Vec::new();
        let pixels = [value; (SIDE * SIDE * 3) as usize];
        // Writing to memory an image of the right size cannot fail; an empty file would show in any test that reads it.
        let _ = PngEncoder::new(&mut png).write_image(&pixels, SIDE, SIDE, ExtendedColorType::Rgb8);
        self.images.push((path, png));
    }

    pub fn finish(self, name: &str) -> Result<Fixture, BuildError> {
        Ok(Fixture {
            name: name.to_owned(),
            bsp: self.map.build()?,
            script: self.script,
            images: self.images,
        })
    }

    fn spawn_in(&mut self, room: &Bounds) {
        let middle = (room.mins + room.maxs) / 2;
        self.map
            .entity(Entity::spawn([middle.x, middle.y, room.mins.z + 25], 0));
    }
}

fn cube(size: i32) -> Bounds {
    Bounds::new([0; 3], [size; 3])
}

/// A closed cube without any light.
///
/// # Errors
/// [`BuildError`] where the size makes no box.
pub fn closed_box(size: i32, albedo: u8) -> Result<Fixture, BuildError> {
    let mut draft = Draft::new();
    let grey = draft.grey(albedo);
    draft.map.cell("box", cube(size), [Some(grey); 6]);
    draft.spawn_in(&cube(size));
    draft.finish("closed_box")
}

/// A closed cube whose walls all emit and reflect: the white furnace.
///
/// # Errors
/// [`BuildError`] where the size makes no box.
pub fn furnace(size: i32, albedo: u8, surfacelight: u32) -> Result<Fixture, BuildError> {
    let mut draft = Draft::new();
    let glowing = draft.emitter(surfacelight, false, albedo);
    draft.map.cell("box", cube(size), [Some(glowing); 6]);
    draft.spawn_in(&cube(size));
    draft.finish("furnace")
}

/// What [`lit_box`] makes: a cube with a rectangular light flush in its ceiling.
#[derive(Clone, Copy, Debug)]
pub struct LitBox {
    /// Edge of the cube, units.
    pub size: i32,
    /// Encoded byte of the walls.
    pub albedo: u8,
    /// Least and greatest x, y of the light.
    pub light: [[i32; 2]; 2],
    pub surfacelight: u32,
}

/// A cube with one rectangular light in its ceiling, looking down.
///
/// # Errors
/// [`BuildError`] where the light does not lie in the ceiling.
pub fn lit_box(shape: &LitBox) -> Result<Fixture, BuildError> {
    let mut draft = Draft::new();
    let grey = draft.grey(shape.albedo);
    let light = draft.emitter(shape.surfacelight, false, 0);
    let room = draft.map.cell("box", cube(shape.size), [Some(grey); 6]);
    let [least, greatest] = shape.light;
    let rect = Bounds::new([least[0], least[1], shape.size], [greatest[0], greatest[1], shape.size]);
    draft.map.panel(room, Face::MaxZ, rect, light);
    draft.spawn_in(&cube(shape.size));
    draft.finish("lit_box")
}

/// A cube of 256 units with a free square emitter of `side` units in its middle, upright, front towards +x.
///
/// # Errors
/// None in practice; as [`MapBuilder::build`].
pub fn free_emitter(side: f32, surfacelight: u32, two_sided: bool) -> Result<Fixture, BuildError> {
    let mut draft = Draft::new();
    let grey = draft.grey(128);
    let light = draft.emitter(surfacelight, two_sided, 0);
    draft.map.cell("box", cube(256), [Some(grey); 6]);
    let corner = |y: f32, z: f32| Vec3::new(128.0, 128.0 + y * side / 2.0, 128.0 + z * side / 2.0);
    let corners = [
        corner(-1.0, -1.0),
        corner(1.0, -1.0),
        corner(1.0, 1.0),
        corner(-1.0, 1.0),
    ];
    draft.map.quad(corners, light);
    draft.map.entity(Entity::spawn([40, 128, 25], 0));
    draft.finish(if two_sided { "two_sided_emitter" } else { "free_emitter" })
}

/// Two rooms and the doorway between them; a light just under the lintel reaches from the first room through the doorway
/// into the second, so that its surface belongs to three clusters.
///
/// # Errors
/// None in practice; as [`MapBuilder::build`].
pub fn doorway_light(surfacelight: u32) -> Result<Fixture, BuildError> {
    let mut draft = Draft::new();
    let grey = draft.grey(128);
    let light = draft.emitter(surfacelight, false, 0);
    let rooms = [
        Bounds::new([0, 0, 0], [256, 256, 192]),
        Bounds::new([288, 0, 0], [544, 256, 192]),
    ];
    let [a, b] = rooms.map(|room| draft.map.cell("room", room, [Some(grey); 6]));
    let door = Bounds::new([256, 96, 0], [288, 160, 128]);
    draft.map.passage("doorway", a, b, door, [Some(grey); 6]);
    let corner = |x: f32, y: f32| Vec3::new(x, y, 120.0);
    // Counter-clockwise seen from below.
    draft.map.quad(
        [
            corner(224.0, 112.0),
            corner(224.0, 144.0),
            corner(320.0, 144.0),
            corner(320.0, 112.0),
        ],
        light,
    );
    draft.spawn_in(&rooms[0]);
    draft.spawn_in(&rooms[1]);
    draft.finish("doorway_light")
}

/// Where the doorways of a [`chain`] are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Doorways {
    /// In one line: every room sees every other.
    InLine,
    /// In turn at either side: only near rooms see each other.
    Staggered,
}

/// A row of rooms along x with doorways between them and a light of `surfacelight` in each ceiling. Cells alternate:
/// cluster 2i is room i, cluster 2i + 1 the doorway after it.
///
/// # Errors
/// [`BuildError::NoCells`] without rooms.
pub fn chain(rooms: usize, doorways: Doorways, surfacelight: u32) -> Result<Fixture, BuildError> {
    chain_draft(rooms, doorways, surfacelight).finish("chain")
}

/// The same without a visibility lump.
///
/// # Errors
/// [`BuildError::NoCells`] without rooms.
pub fn unvised(rooms: usize, surfacelight: u32) -> Result<Fixture, BuildError> {
    let mut draft = chain_draft(rooms, Doorways::Staggered, surfacelight);
    draft.map.unvised();
    draft.finish("unvised")
}

fn chain_draft(rooms: usize, doorways: Doorways, surfacelight: u32) -> Draft {
    let mut draft = Draft::new();
    let grey = draft.grey(128);
    let light = draft.emitter(surfacelight, false, 0);
    let mut before = None;
    for i in 0..rooms as i32 {
        let x = i * 288;
        if let Some(room) = before {
            let y = if doorways == Doorways::InLine || i % 2 == 0 {
                32
            } else {
                160
            };
            let door = Bounds::new([x - 32, y, 0], [x, y + 64, 128]);
            let passage = draft.map.cell("doorway", door, [Some(grey); 6]);
            draft.map.connect(room, passage);
            before = Some(passage);
        }
        let bounds = Bounds::new([x, 0, 0], [x + 256, 256, 192]);
        let room = draft.map.cell("room", bounds, [Some(grey); 6]);
        let rect = Bounds::new([x + 96, 96, 192], [x + 160, 160, 192]);
        draft.map.panel(room, Face::MaxZ, rect, light);
        if let Some(passage) = before {
            draft.map.connect(passage, room);
        }
        draft.spawn_in(&bounds);
        before = Some(room);
    }
    draft
}

/// A lit box and an emitter that lies wholly in the solid outside it: a surface that no leaf lists.
///
/// # Errors
/// None in practice; as [`MapBuilder::build`].
pub fn surface_in_solid(surfacelight: u32) -> Result<Fixture, BuildError> {
    let mut draft = Draft::new();
    let grey = draft.grey(128);
    let light = draft.emitter(surfacelight, false, 0);
    let room = draft.map.cell("box", cube(256), [Some(grey); 6]);
    draft
        .map
        .panel(room, Face::MaxZ, Bounds::new([96, 96, 256], [160, 160, 256]), light);
    let corner = |x: f32, y: f32| Vec3::new(x, y, -8.0);
    draft.map.quad(
        [
            corner(96.0, 96.0),
            corner(160.0, 96.0),
            corner(160.0, 160.0),
            corner(96.0, 160.0),
        ],
        light,
    );
    draft.spawn_in(&cube(256));
    draft.finish("surface_in_solid")
}
