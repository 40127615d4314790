//! Which parts of cells' and solids' faces are drawn.

use super::map::{MapBuilder, Paint};
use super::shape::{Bounds, Face, plane_axes};

/// Coplanar rectangles with one paint, seen from the side that `facing` (the direction of its normal) names.
pub struct DrawnFace {
    pub pieces: Vec<Bounds>,
    pub facing: Face,
    pub paint: Paint,
    /// The rectangle as described, over which a fitted texture is stretched.
    pub whole: Bounds,
}

/// What lies around each cell.
pub struct Surroundings {
    /// Portal rectangles of each cell.
    pub portals: Vec<Vec<Bounds>>,
    /// Carving solids that meet each cell's interior.
    pub solids: Vec<Vec<usize>>,
    /// Cells whose interior each solid meets.
    pub cells_of_solid: Vec<Vec<usize>>,
    /// Panels of each cell.
    pub panels: Vec<Vec<usize>>,
}

/// The painted faces of a cell, cut where portals, panels and solids are, then its panels.
pub fn cell_faces(map: &MapBuilder, around: &Surroundings, cell: usize, out: &mut Vec<DrawnFace>) {
    let bounds = map.cells[cell].bounds;
    for face in Face::ALL {
        let whole = bounds.face(face);
        let panels = around.panels[cell].iter().map(|&p| &map.panels[p]);
        let holes: Vec<Bounds> = panels.clone().filter(|p| p.face == face).map(|p| p.rect).collect();
        let level = bounds.level(face);
        let portals = around.portals[cell]
            .iter()
            .filter(|r| r.mins[face.axis()] == level && r.maxs[face.axis()] == level);
        let axes = plane_axes(face.axis());
        if let Some(paint) = map.cells[cell].faces[face as usize] {
            let pieces = whole.cut_all(portals.chain(&holes), &axes);
            out.extend(uncovered(
                map,
                &around.solids[cell],
                pieces,
                face.opposite(),
                paint,
                whole,
            ));
        }
        for panel in panels.filter(|p| p.face == face) {
            let pieces = vec![panel.rect];
            out.extend(uncovered(
                map,
                &around.solids[cell],
                pieces,
                face.opposite(),
                panel.paint,
                panel.rect,
            ));
        }
    }
}

/// The painted faces of a solid, as far as they border on open space.
pub fn solid_faces(map: &MapBuilder, around: &Surroundings, number: usize, out: &mut Vec<DrawnFace>) {
    let solid = &map.solids[number];
    for face in Face::ALL {
        let Some(paint) = solid.faces[face as usize] else {
            continue;
        };
        let whole = solid.bounds.face(face);
        let (axis, level) = (face.axis(), solid.bounds.level(face));
        for &cell in &around.cells_of_solid[number] {
            let bounds = map.cells[cell].bounds;
            let mut seen = whole.intersection(&bounds);
            seen.mins[axis] = level;
            seen.maxs[axis] = level;
            let flat = plane_axes(axis).iter().any(|&a| seen.maxs[a] <= seen.mins[a]);
            if flat || !bounds.fills_side(axis, level, face.is_max()) {
                continue;
            }
            out.extend(uncovered(map, &around.solids[cell], vec![seen], face, paint, whole));
        }
    }
}

/// The faces of a brush model's box, whole: it moves, so nothing is cut.
pub fn model_faces(bounds: &Bounds, faces: &super::map::Paints, out: &mut Vec<DrawnFace>) {
    for face in Face::ALL {
        if let Some(paint) = faces[face as usize] {
            let whole = bounds.face(face);
            out.push(DrawnFace {
                pieces: vec![whole],
                facing: face,
                paint,
                whole,
            });
        }
    }
}

/// What no solid stands in front of.
fn uncovered(
    map: &MapBuilder,
    solids: &[usize],
    pieces: Vec<Bounds>,
    facing: Face,
    paint: Paint,
    whole: Bounds,
) -> Option<DrawnFace> {
    let (axis, level) = (facing.axis(), whole.mins[facing.axis()]);
    let covers: Vec<Bounds> = solids
        .iter()
        .map(|&s| map.solids[s].bounds)
        .filter(|b| b.fills_side(axis, level, facing.is_max()))
        .collect();
    let axes = plane_axes(axis);
    let pieces: Vec<Bounds> = pieces.iter().flat_map(|piece| piece.cut_all(&covers, &axes)).collect();
    (!pieces.is_empty()).then_some(DrawnFace {
        pieces,
        facing,
        paint,
        whole,
    })
}
