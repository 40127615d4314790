//! The description of a map, before it is built.

use super::drawn::{Mesh, Patch};
use super::entity::Entity;
use super::error::BuildError;
use super::shape::{Bounds, Face};
use crate::assets::bsp::file::Bsp;
use crate::assets::bsp::lumps::{Name, Shader, content_flags, surface_flags};
use glam::Vec3;
use std::collections::HashMap;

/// A shader of the map, by its place in the shader lump.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct ShaderId(pub(super) i32);

/// A cell of the map; its number is also its PVS cluster.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct CellId(pub(super) usize);

impl CellId {
    /// The PVS cluster of the cell's leaves.
    pub fn cluster(self) -> u32 {
        self.0 as u32
    }
}

/// How texture coordinates come about.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Mapping {
    /// Projected along the main axis of the normal; the image repeats every so many units of the world.
    World(f32),
    /// The whole image once over the surface as described, before anything is cut out of it.
    Fit,
}

/// What a surface is drawn with.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Paint {
    pub shader: ShaderId,
    pub mapping: Mapping,
}

/// Paint of the six faces in [`Face::ALL`]'s order; `None` draws nothing there.
pub type Paints = [Option<Paint>; 6];

/// Solid box.
#[derive(Clone, Debug, PartialEq)]
pub struct Solid {
    pub bounds: Bounds,
    pub faces: Paints,
    /// Shader whose content flags the brush has (faces that are not painted get it too).
    pub contents: ShaderId,
    /// Whether the box becomes solid leaves. A clip brush does not: it only stands in the leaves' brush lists.
    pub carves: bool,
}

pub(super) struct Cell {
    pub name: String,
    pub bounds: Bounds,
    pub faces: Paints,
}

pub(super) struct Panel {
    pub cell: usize,
    pub face: Face,
    pub rect: Bounds,
    pub paint: Paint,
}

pub(super) struct Quad {
    pub corners: [Vec3; 4],
    pub paint: Paint,
}

pub(super) struct BrushModel {
    pub solids: Vec<Solid>,
    pub class: String,
}

/// Collects a map; [`MapBuilder::build`] checks and compiles it.
pub struct MapBuilder {
    pub(super) shaders: Vec<Shader>,
    shader_ids: HashMap<String, i32>,
    pub(super) cells: Vec<Cell>,
    pub(super) portals: Vec<(usize, usize)>,
    pub(super) solids: Vec<Solid>,
    pub(super) panels: Vec<Panel>,
    pub(super) quads: Vec<Quad>,
    pub(super) patches: Vec<(Patch, ShaderId)>,
    pub(super) meshes: Vec<(Mesh, ShaderId)>,
    pub(super) models: Vec<BrushModel>,
    pub(super) entities: Vec<Entity>,
    pub(super) vised: bool,
}

impl MapBuilder {
    /// Shader of everything that is solid but never drawn.
    pub const CAULK: ShaderId = ShaderId(0);

    /// An empty map whose `worldspawn` is given.
    pub fn new(worldspawn: Entity) -> Self {
        let mut map = Self {
            shaders: Vec::new(),
            shader_ids: HashMap::new(),
            cells: Vec::new(),
            portals: Vec::new(),
            solids: Vec::new(),
            panels: Vec::new(),
            quads: Vec::new(),
            patches: Vec::new(),
            meshes: Vec::new(),
            models: Vec::new(),
            entities: vec![worldspawn],
            vised: true,
        };
        let caulk =
            surface_flags::NODRAW | surface_flags::NOMARKS | surface_flags::NOLIGHTMAP | surface_flags::POINTLIGHT;
        map.shader("textures/common/caulk", caulk, content_flags::SOLID);
        map
    }

    /// The shader of a name, made at its first use; later flags are ignored.
    pub fn shader(&mut self, name: &str, surface_flags: i32, content_flags: i32) -> ShaderId {
        let next = self.shaders.len() as i32;
        let id = *self.shader_ids.entry(name.to_owned()).or_insert(next);
        if id == next {
            self.shaders.push(Shader {
                name: Name::new(name),
                surface_flags,
                content_flags,
            });
        }
        ShaderId(id)
    }

    /// Paint with an ordinary solid shader, repeating every `units`.
    pub fn paint(&mut self, name: &str, units: f32) -> Paint {
        Paint {
            shader: self.shader(name, 0, content_flags::SOLID),
            mapping: Mapping::World(units),
        }
    }

    /// A convex open space: room, corridor or doorway.
    pub fn cell(&mut self, name: &str, bounds: Bounds, faces: Paints) -> CellId {
        self.cells.push(Cell {
            name: name.to_owned(),
            bounds,
            faces,
        });
        CellId(self.cells.len() - 1)
    }

    /// Opens the whole rectangle in which two cells touch.
    pub fn connect(&mut self, a: CellId, b: CellId) {
        self.portals.push((a.0, b.0));
    }

    /// A cell that fills the wall between two others (doorway, window) and is open to both.
    pub fn passage(&mut self, name: &str, a: CellId, b: CellId, bounds: Bounds, faces: Paints) -> CellId {
        let cell = self.cell(name, bounds, faces);
        self.connect(a, cell);
        self.connect(cell, b);
        cell
    }

    /// A solid box painted alike on all sides.
    pub fn pillar(&mut self, bounds: Bounds, paint: Paint) {
        self.solid(bounds, [Some(paint); 6]);
    }

    /// A solid box; it may stick in walls, only what can be seen from a cell is drawn.
    pub fn solid(&mut self, bounds: Bounds, faces: Paints) {
        self.solids.push(Solid {
            bounds,
            faces,
            contents: Self::CAULK,
            carves: true,
        });
    }

    /// An invisible box that stops players but neither light nor sight.
    pub fn clip(&mut self, bounds: Bounds) {
        let flags = surface_flags::NODRAW | surface_flags::NOIMPACT | surface_flags::NONSOLID;
        let contents = self.shader(
            "textures/common/clip",
            flags | surface_flags::NOLIGHTMAP,
            content_flags::PLAYERCLIP | content_flags::DETAIL | content_flags::TRANSLUCENT,
        );
        self.solids.push(Solid {
            bounds,
            faces: [None; 6],
            contents,
            carves: false,
        });
    }

    /// A rectangle of a cell's face with its own paint (lamps), flush with the wall, which is cut out behind it.
    pub fn panel(&mut self, cell: CellId, face: Face, rect: Bounds, paint: Paint) {
        self.panels.push(Panel {
            cell: cell.0,
            face,
            rect,
            paint,
        });
    }

    /// A free planar quadrilateral; corners counter-clockwise as seen from its front.
    pub fn quad(&mut self, corners: [Vec3; 4], paint: Paint) {
        self.quads.push(Quad { corners, paint });
    }

    /// A curved surface.
    pub fn patch(&mut self, patch: Patch, shader: ShaderId) {
        self.patches.push((patch, shader));
    }

    /// A triangle soup.
    pub fn mesh(&mut self, mesh: Mesh, shader: ShaderId) {
        self.meshes.push((mesh, shader));
    }

    /// A brush model made of solids in world coordinates, and its entity (which gets the "model" key).
    /// Returns the model's number.
    pub fn brush_model(&mut self, solids: Vec<Solid>, entity: Entity) -> usize {
        self.models.push(BrushModel {
            solids,
            class: entity.class().to_owned(),
        });
        let number = self.models.len();
        self.entities.push(entity.with("model", &format!("*{number}")));
        number
    }

    /// An entity.
    pub fn entity(&mut self, entity: Entity) {
        self.entities.push(entity);
    }

    /// Leaves the visibility lump out, as in a map that was never vised: everything sees everything.
    pub fn unvised(&mut self) {
        self.vised = false;
    }

    /// Compiles the map.
    ///
    /// # Errors
    /// [`BuildError`] naming the part of the description at fault.
    pub fn build(&self) -> Result<Bsp, BuildError> {
        super::assemble::assemble(self)
    }
}
