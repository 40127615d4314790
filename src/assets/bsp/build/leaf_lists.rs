//! Which surfaces and brushes each leaf lists.

use super::tree::Tree;
use crate::assets::bsp::file::Bsp;
use crate::assets::bsp::lumps::{SURFACE_PATCH, Surface, Vertex};
use glam::Vec3;

/// Open leaves that a surface enters or lies against, ascending.
///
/// Polygons are followed through the tree exactly. A patch is taken as the boxes around its 3x3 parts, which hold the
/// curve: a few leaves too many rather than one too few.
pub fn leafs_of_surface(tree: &Tree, bsp: &Bsp, surface: &Surface) -> Vec<usize> {
    let mut leafs = Vec::new();
    let mut visit = |leaf: usize| {
        if tree.leafs[leaf].cell.is_some() {
            leafs.push(leaf);
        }
    };
    let vertices = &bsp.vertices[surface.first_vertex as usize..][..surface.vertex_count as usize];
    if surface.kind == SURFACE_PATCH {
        let (width, height) = (surface.patch_width as usize, surface.patch_height as usize);
        for y in (0..height - 1).step_by(2) {
            for x in (0..width - 1).step_by(2) {
                let points = (0..9).map(|i| &vertices[(y + i / 3) * width + x + i % 3]);
                let (mins, maxs) = around(points);
                tree.leafs_in_box(mins, maxs, &mut visit);
            }
        }
    } else {
        let indices = &bsp.indices[surface.first_index as usize..][..surface.index_count as usize];
        for triangle in indices.chunks_exact(3) {
            let corner = |i: usize| Vec3::from(vertices[triangle[i] as usize].position);
            tree.leafs_of_polygon(&[corner(0), corner(1), corner(2)], &mut visit);
        }
    }
    leafs.sort_unstable();
    leafs.dedup();
    leafs
}

fn around<'a>(points: impl Iterator<Item = &'a Vertex>) -> (Vec3, Vec3) {
    points.fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(mins, maxs), v| {
        let p = Vec3::from(v.position);
        (mins.min(p), maxs.max(p))
    })
}

/// Lists per leaf, flattened: the numbers of all leaves in turn, and each leaf's first place and count.
pub struct LeafLists {
    pub numbers: Vec<i32>,
    pub ranges: Vec<(i32, i32)>,
}

/// Turns (item → leaves) around into (leaf → items, ascending), in linear time.
pub fn invert(leaf_count: usize, leafs_of_items: &[Vec<usize>]) -> LeafLists {
    let mut counts = vec![0; leaf_count];
    for &leaf in leafs_of_items.iter().flatten() {
        counts[leaf] += 1;
    }
    let mut ranges = Vec::with_capacity(leaf_count);
    let mut next = Vec::with_capacity(leaf_count);
    let mut total = 0;
    for &count in &counts {
        ranges.push((total, count));
        next.push(total as usize);
        total += count;
    }
    let mut numbers = vec![0; total as usize];
    for (item, leafs) in leafs_of_items.iter().enumerate() {
        for &leaf in leafs {
            numbers[next[leaf]] = item as i32;
            next[leaf] += 1;
        }
    }
    LeafLists { numbers, ranges }
}
