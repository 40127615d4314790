//! Brushes: walls behind cells' faces, solids, clip brushes and brush models.

use super::faces::Surroundings;
use super::map::{MapBuilder, Paint, Paints, ShaderId, Solid};
use super::planes::Planes;
use super::shape::{Bounds, Face, plane_axes};
use super::tree::Tree;
use crate::assets::bsp::file::Bsp;
use crate::assets::bsp::lumps::{Brush, BrushSide};

/// Thickness of the walls behind faces, units.
pub const WALL: i32 = 16;

/// Appends a box brush.
pub fn push_box(bsp: &mut Bsp, planes: &mut Planes, bounds: &Bounds, contents: ShaderId, sides: [ShaderId; 6]) {
    let first_side = bsp.brush_sides.len() as i32;
    for face in Face::ALL {
        bsp.brush_sides.push(BrushSide {
            plane: planes.outward(face, bounds.level(face)),
            shader: sides[face as usize].0,
        });
    }
    bsp.brushes.push(Brush {
        first_side,
        side_count: 6,
        shader: contents.0,
    });
}

/// Appends a solid's brush.
pub fn push_solid(bsp: &mut Bsp, planes: &mut Planes, solid: &Solid) {
    let sides = solid.faces.map(|paint| paint.map_or(solid.contents, |p| p.shader));
    push_box(bsp, planes, &solid.bounds, solid.contents, sides);
}

/// The world's brushes with their boxes: behind every face of a cell a slab with the openings cut, then the solids.
pub fn world(map: &MapBuilder, around: &Surroundings, tree: &Tree, bsp: &mut Bsp, planes: &mut Planes) -> Vec<Bounds> {
    let mut boxes = Vec::new();
    for (number, cell) in map.cells.iter().enumerate() {
        for face in Face::ALL {
            let shader = face_shader(&cell.faces, face);
            let mut sides = [MapBuilder::CAULK; 6];
            sides[face.opposite() as usize] = shader;
            for slab in slabs(map, around, tree, number, face) {
                push_box(bsp, planes, &slab, shader, sides);
                boxes.push(slab);
            }
        }
    }
    for solid in &map.solids {
        push_solid(bsp, planes, solid);
        boxes.push(solid.bounds);
    }
    boxes
}

fn face_shader(faces: &Paints, face: Face) -> ShaderId {
    faces[face as usize].map_or(MapBuilder::CAULK, |paint: Paint| paint.shader)
}

/// The wall behind a face, in boxes that enter no cell.
fn slabs(map: &MapBuilder, around: &Surroundings, tree: &Tree, cell: usize, face: Face) -> Vec<Bounds> {
    let bounds = map.cells[cell].bounds;
    let (axis, level) = (face.axis(), bounds.level(face));
    let openings = around.portals[cell]
        .iter()
        .filter(|r| r.mins[axis] == level && r.maxs[axis] == level);
    let mut slabs = Vec::new();
    for piece in bounds.face(face).cut_all(openings, &plane_axes(axis)) {
        let mut slab = piece;
        if face.is_max() {
            slab.maxs[axis] += WALL;
        } else {
            slab.mins[axis] -= WALL;
        }
        let mut cells = Vec::new();
        tree.leafs_in_box(slab.mins.as_vec3(), slab.maxs.as_vec3(), &mut |leaf| {
            cells.extend(tree.leafs[leaf].cell)
        });
        cells.sort_unstable();
        cells.dedup();
        slabs.extend(slab.cut_all(cells.iter().map(|&c| &map.cells[c].bounds), &[0, 1, 2]));
    }
    slabs
}
