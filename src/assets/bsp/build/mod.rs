//! Writes IBSP v46 maps from convex cells and portals: the map we ship, and fixtures for tests.
//!
//! A map is described with [`MapBuilder`] as axis-aligned *cells* (rooms, corridors, doorways) that touch through
//! whole-contact portals, plus box solids, panels, quads, patches, meshes, brush models and entities. [`MapBuilder::build`]
//! makes every lump: planes in pairs, a BSP tree whose open leaves carry their cell's number as cluster, brushes,
//! surfaces with Quake III's winding, leaf lists, and the potentially visible set found through the portals.
//!
//! **No light is baked.** The lightmap and light-grid lumps stay empty, surfaces have lightmap −3 ("lit at the vertices")
//! and neutral grey vertex colours, because q3rays lights maps itself. The original game shows such a map evenly grey.
//!
//! All coordinates are Quake units, z up.

mod assemble;
mod brushes;
mod curves;
mod drawn;
mod entity;
mod error;
mod faces;
pub mod fixtures;
mod leaf_lists;
mod map;
mod planes;
mod shape;
mod stress;
mod surfaces;
mod tree;
mod vis;
mod winding;

pub use curves::{arch, column, spandrels, sweep};
pub use drawn::{Mesh, MeshVertex, Patch, PatchPoint};
pub use entity::Entity;
pub use error::BuildError;
pub use map::{CellId, MapBuilder, Mapping, Paint, Paints, ShaderId, Solid};
pub use shape::{Bounds, Face};
pub use stress::stress;
