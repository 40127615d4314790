//! Why a described map cannot be built.

use super::shape::Bounds;
use thiserror::Error;

/// A mistake in the description of a map. Cells are named as the caller named them.
#[derive(Debug, Error, PartialEq)]
pub enum BuildError {
    #[error("the map has no cell")]
    NoCells,
    #[error("{what} \"{name}\" has no volume: {bounds}")]
    Empty {
        what: &'static str,
        name: String,
        bounds: Bounds,
    },
    #[error("{what} \"{name}\" reaches beyond ±{limit} units: {bounds}")]
    TooFar {
        what: &'static str,
        name: String,
        bounds: Bounds,
        limit: i32,
    },
    #[error("cells \"{a}\" and \"{b}\" overlap")]
    OverlappingCells { a: String, b: String },
    #[error("cells \"{a}\" and \"{b}\" touch without a portal: connect them or leave a wall between them")]
    TouchingCells { a: String, b: String },
    #[error("no portal can join cells \"{a}\" and \"{b}\": they share no face")]
    PortalNotShared { a: String, b: String },
    #[error("the panel {rect} does not lie on face {face} of cell \"{cell}\", free of its portals")]
    PanelNotOnFace {
        cell: String,
        face: &'static str,
        rect: Bounds,
    },
    #[error("patch {index} has {points} points for a {width}x{height} grid (sides must be odd, 3 or more)")]
    PatchGrid {
        index: usize,
        width: usize,
        height: usize,
        points: usize,
    },
    #[error("mesh {index} refers to vertex {vertex} of {count}")]
    MeshIndex { index: usize, vertex: u32, count: usize },
    #[error("the model of entity \"{class}\" has no brush")]
    EmptyModel { class: String },
}
