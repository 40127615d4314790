//! Checks every reference inside a map once, so that later code may index without asking again.

use super::file::{Bsp, BspError};
use super::lumps::{Lump, SURFACE_PATCH};

/// Largest control-point grid edge of a patch that is accepted (the original's limit is 31).
const MAX_PATCH_EDGE: i32 = 129;

fn range(
    lump: Lump,
    index: usize,
    target: &'static str,
    first: i32,
    count: i32,
    available: usize,
) -> Result<(), BspError> {
    let end = i64::from(first) + i64::from(count);
    if count < 0 || (count > 0 && (first < 0 || end > available as i64)) {
        return Err(BspError::Reference {
            lump: lump.name(),
            index,
            target,
            value: if first < 0 { i64::from(first) } else { end - 1 },
            count: available,
        });
    }
    Ok(())
}

fn index(lump: Lump, at: usize, target: &'static str, value: i32, available: usize) -> Result<(), BspError> {
    if value < 0 || value as usize >= available {
        return Err(BspError::Reference {
            lump: lump.name(),
            index: at,
            target,
            value: i64::from(value),
            count: available,
        });
    }
    Ok(())
}

/// Verifies all cross references, finite coordinates and that the node graph is a tree.
///
/// # Errors
/// The first fault found, naming lump and record.
pub fn check(bsp: &Bsp) -> Result<(), BspError> {
    for (i, plane) in bsp.planes.iter().enumerate() {
        if !plane.normal.iter().chain([&plane.dist]).all(|x| x.is_finite()) {
            return Err(BspError::Record {
                lump: Lump::Planes.name(),
                index: i,
                problem: "is not finite",
            });
        }
    }
    check_tree(bsp)?;
    for (i, leaf) in bsp.leafs.iter().enumerate() {
        range(
            Lump::Leafs,
            i,
            "leaf surface",
            leaf.first_leaf_surface,
            leaf.leaf_surface_count,
            bsp.leaf_surfaces.len(),
        )?;
        range(
            Lump::Leafs,
            i,
            "leaf brush",
            leaf.first_leaf_brush,
            leaf.leaf_brush_count,
            bsp.leaf_brushes.len(),
        )?;
        if let Some(vis) = &bsp.visibility
            && leaf.cluster >= 0
        {
            index(Lump::Leafs, i, "cluster", leaf.cluster, vis.cluster_count as usize)?;
        }
    }
    for (i, &surface) in bsp.leaf_surfaces.iter().enumerate() {
        index(Lump::LeafSurfaces, i, "surface", surface, bsp.surfaces.len())?;
    }
    for (i, &brush) in bsp.leaf_brushes.iter().enumerate() {
        index(Lump::LeafBrushes, i, "brush", brush, bsp.brushes.len())?;
    }
    for (i, m) in bsp.models.iter().enumerate() {
        range(
            Lump::Models,
            i,
            "surface",
            m.first_surface,
            m.surface_count,
            bsp.surfaces.len(),
        )?;
        range(
            Lump::Models,
            i,
            "brush",
            m.first_brush,
            m.brush_count,
            bsp.brushes.len(),
        )?;
    }
    for (i, b) in bsp.brushes.iter().enumerate() {
        range(
            Lump::Brushes,
            i,
            "brush side",
            b.first_side,
            b.side_count,
            bsp.brush_sides.len(),
        )?;
        index(Lump::Brushes, i, "shader", b.shader, bsp.shaders.len())?;
    }
    for (i, side) in bsp.brush_sides.iter().enumerate() {
        index(Lump::BrushSides, i, "plane", side.plane, bsp.planes.len())?;
        index(Lump::BrushSides, i, "shader", side.shader, bsp.shaders.len())?;
    }
    check_surfaces(bsp)
}

/// The graph from node 0 must be a tree: a cycle would hang every walk, a shared child is damage too.
fn check_tree(bsp: &Bsp) -> Result<(), BspError> {
    let mut seen = vec![false; bsp.nodes.len()];
    let mut stack = if bsp.nodes.is_empty() { Vec::new() } else { vec![0usize] };
    while let Some(at) = stack.pop() {
        if std::mem::replace(&mut seen[at], true) {
            return Err(BspError::Record {
                lump: Lump::Nodes.name(),
                index: at,
                problem: "is reached twice: the nodes are no tree",
            });
        }
        let node = &bsp.nodes[at];
        index(Lump::Nodes, at, "plane", node.plane, bsp.planes.len())?;
        for child in node.children {
            if child >= 0 {
                index(Lump::Nodes, at, "node", child, bsp.nodes.len())?;
                stack.push(child as usize);
            } else {
                index(Lump::Nodes, at, "leaf", -1 - child, bsp.leafs.len())?;
            }
        }
    }
    Ok(())
}

fn check_surfaces(bsp: &Bsp) -> Result<(), BspError> {
    for (i, s) in bsp.surfaces.iter().enumerate() {
        index(Lump::Surfaces, i, "shader", s.shader, bsp.shaders.len())?;
        range(
            Lump::Surfaces,
            i,
            "vertex",
            s.first_vertex,
            s.vertex_count,
            bsp.vertices.len(),
        )?;
        range(
            Lump::Surfaces,
            i,
            "index",
            s.first_index,
            s.index_count,
            bsp.indices.len(),
        )?;
        if s.index_count > 0 {
            let first = s.first_index as usize;
            for &vertex in &bsp.indices[first..first + s.index_count as usize] {
                index(Lump::Surfaces, i, "own vertex", vertex, s.vertex_count as usize)?;
            }
        }
        if s.kind == SURFACE_PATCH {
            let (w, h) = (s.patch_width, s.patch_height);
            let edge = 3..=MAX_PATCH_EDGE;
            let whole = edge.contains(&w) && edge.contains(&h) && w % 2 == 1 && h % 2 == 1;
            if !whole || w * h > s.vertex_count {
                return Err(BspError::Record {
                    lump: Lump::Surfaces.name(),
                    index: i,
                    problem: "is a patch whose grid is not odd by odd, or has too few control points",
                });
            }
        }
    }
    for (i, v) in bsp.vertices.iter().enumerate() {
        if !v.position.iter().all(|x| x.is_finite() && x.abs() < 1e6) {
            return Err(BspError::Record {
                lump: Lump::Vertices.name(),
                index: i,
                problem: "has a position that is not a finite coordinate of a map",
            });
        }
    }
    Ok(())
}
