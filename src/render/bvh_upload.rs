//! Trees in the shaders' layouts: see `shaders/include/trace_cwbvh.glsl` and `trace_bvh2.glsl`.

use crate::scene::bvh::{BvhQuality, mesh_triangles};
use crate::scene::polygons::Shape;
use crate::scene::records::{DynamicTriangle, Instance, MATERIAL_ALPHA_TESTED, MATERIAL_LAYER};
use crate::scene::static_geometry::{Geometry, Mesh};
use crate::scene::{Scene, bvh};
use bytemuck::{Pod, Zeroable};
use glam::Vec3;
use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::builder::{build_bvh2, build_bvh2_from_tris};
use obvhs::cwbvh::{
    CwBvh,
    builder::{build_cwbvh, build_cwbvh_from_tris},
};
use rayon::prelude::*;
use std::time::Duration;
use thiserror::Error;

/// Entries of the shaders' traversal stacks.
const CWBVH_STACK: usize = 24;
const BVH2_STACK: usize = 64;
const INSTANCE_STACK: usize = 24;
/// A leaf reference of the binary tree: 27 bits of triangle number.
const BVH2_LEAF: u32 = 1 << 31;
const BVH2_MOST_TRIANGLES: usize = 1 << 27;
/// Most triangles in a leaf of the binary tree.
const BVH2_LEAF_SIZE: u32 = 8;
const NOT_OPAQUE_BIT: u32 = 1 << 31;

/// A tree that the shaders' fixed stacks or references cannot hold.
#[derive(Debug, Error, PartialEq)]
pub enum TreeError {
    #[error("map \"{map}\": the {tree} tree of mesh {mesh} is {depth} levels deep; the tracer's stack holds {most}")]
    Depth {
        map: String,
        tree: &'static str,
        mesh: usize,
        depth: usize,
        most: usize,
    },
    #[error("map \"{map}\" has {count} triangles; the tracer can address {most}")]
    Triangles { map: String, count: usize, most: usize },
}

/// `struct MeshTree`
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct MeshTree {
    pub cwbvh_node: u32,
    pub cwbvh_triangle: u32,
    pub bvh2_node: u32,
    pub bvh2_triangle: u32,
    pub bvh2_root: u32,
    pub first_triangle: u32,
    pub opaque_count: u32,
    pub padding: u32,
}

/// All trees of a scene's meshes.
#[derive(Default)]
pub struct MeshTrees {
    pub records: Vec<MeshTree>,
    /// Five 16-byte words a node.
    pub cwbvh_nodes: Vec<[u32; 20]>,
    /// (v0, id) (e1, 0) (e2, 0) in leaf order.
    pub cwbvh_triangles: Vec<[f32; 12]>,
    /// (min, reference) (max, 0) of both children.
    pub bvh2_nodes: Vec<[f32; 16]>,
    pub bvh2_triangles: Vec<[f32; 12]>,
    /// Where the triangles of the dynamic meshes are in both.
    pub dynamic: Vec<DynamicTriangle>,
    /// Record of the mesh of polygons, where there is one; its tree is empty.
    pub polygons: MeshTree,
}

struct BuiltMesh {
    cwbvh: CwBvh,
    cwbvh_depth: usize,
    nodes2: Vec<[f32; 16]>,
    root2: u32,
    depth2: usize,
    order2: Vec<u32>,
}

fn cwbvh_depth(tree: &CwBvh) -> usize {
    let mut deepest = 0;
    let mut stack = vec![(0usize, 1usize)];
    while let Some((at, depth)) = stack.pop() {
        deepest = deepest.max(depth);
        let Some(node) = tree.nodes.get(at) else { continue };
        for i in 0..node.imask.count_ones() as usize {
            stack.push((node.child_base_idx as usize + i, depth + 1));
        }
    }
    deepest
}

/// Re-packs a binary tree so that every node holds both children's boxes. `leaf` makes a leaf's reference.
fn pack_pairs(tree: &Bvh2, leaf: impl Fn(u32, u32) -> u32) -> (Vec<[f32; 16]>, u32, usize) {
    let Some(root) = tree.nodes.first() else {
        return (Vec::new(), leaf(0, 1), 0);
    };
    if root.is_leaf() {
        return (Vec::new(), leaf(root.first_index, root.prim_count), 1);
    }
    let mut out = vec![[0f32; 16]];
    let mut deepest = 1;
    let mut stack = vec![(root.first_index as usize, 0usize, 1usize)];
    while let Some((children, target, depth)) = stack.pop() {
        deepest = deepest.max(depth + 1);
        for side in 0..2 {
            let child = &tree.nodes[children + side];
            let reference = if child.is_leaf() {
                leaf(child.first_index, child.prim_count)
            } else {
                out.push([0.0; 16]);
                let at = out.len() - 1;
                stack.push((child.first_index as usize, at, depth + 1));
                at as u32
            };
            let b = child.aabb();
            let words = [
                b.min.x,
                b.min.y,
                b.min.z,
                f32::from_bits(reference),
                b.max.x,
                b.max.y,
                b.max.z,
                0.0,
            ];
            out[target][side * 8..side * 8 + 8].copy_from_slice(&words);
        }
    }
    (out, 0, deepest)
}

fn build_mesh(geometry: &Geometry, index: usize, mesh: &Mesh, quality: BvhQuality) -> BuiltMesh {
    let triangles = mesh_triangles(geometry, mesh);
    let params = bvh::build_params(mesh.triangle_count, quality);
    let mut time = Duration::default();
    let boxes = bvh::swept_boxes(geometry, index);
    let cwbvh = match &boxes {
        Some(boxes) => build_cwbvh(boxes, params, &mut time),
        None => build_cwbvh_from_tris(&triangles, params, &mut time),
    };
    let mut params2 = params;
    params2.max_prims_per_leaf = params2.max_prims_per_leaf.min(BVH2_LEAF_SIZE);
    let bvh2 = match &boxes {
        Some(boxes) => build_bvh2(boxes, params2, &mut time),
        None => build_bvh2_from_tris(&triangles, params2, &mut time),
    };
    let (nodes2, root2, depth2) = if triangles.is_empty() {
        (Vec::new(), BVH2_LEAF, 0)
    } else {
        pack_pairs(&bvh2, |first, count| BVH2_LEAF | (count - 1) << 27 | first)
    };
    BuiltMesh {
        cwbvh_depth: cwbvh_depth(&cwbvh),
        cwbvh,
        nodes2,
        root2,
        depth2,
        order2: bvh2.primitive_indices,
    }
}

impl MeshTrees {
    /// Builds the trees of all meshes.
    ///
    /// # Errors
    /// [`TreeError`] where a tree is beyond what the shaders can walk.
    pub fn build(scene: &Scene, quality: BvhQuality) -> Result<Self, TreeError> {
        let geometry = &scene.geometry;
        let built: Vec<BuiltMesh> = geometry
            .meshes
            .par_iter()
            .enumerate()
            .map(|(index, mesh)| build_mesh(geometry, index, mesh, quality))
            .collect();
        let mut out = Self::default();
        for (index, (mesh, b)) in geometry.meshes.iter().zip(built).enumerate() {
            for (tree, depth, most) in [("8-wide", b.cwbvh_depth, CWBVH_STACK), ("binary", b.depth2, BVH2_STACK)] {
                if depth > most {
                    return Err(TreeError::Depth {
                        map: scene.name.clone(),
                        tree,
                        mesh: index,
                        depth,
                        most,
                    });
                }
            }
            let record = MeshTree {
                cwbvh_node: out.cwbvh_nodes.len() as u32,
                cwbvh_triangle: out.cwbvh_triangles.len() as u32,
                bvh2_node: out.bvh2_nodes.len() as u32,
                bvh2_triangle: out.bvh2_triangles.len() as u32,
                bvh2_root: b.root2,
                first_triangle: mesh.first_triangle,
                opaque_count: mesh.opaque_count,
                padding: 0,
            };
            out.records.push(record);
            if let Some(room) = geometry.polygons.filter(|r| r.mesh as usize == index) {
                out.polygons = record;
                let most = room.triangles.max(1) as usize;
                out.cwbvh_nodes.extend(std::iter::repeat_n([0; 20], most));
                out.cwbvh_triangles.extend(std::iter::repeat_n([0.0; 12], most));
                out.bvh2_nodes.extend(std::iter::repeat_n([0.0; 16], most));
                out.bvh2_triangles.extend(std::iter::repeat_n([0.0; 12], most));
                continue;
            }
            out.cwbvh_nodes
                .extend(b.cwbvh.nodes.iter().map(|n| bytemuck::cast::<_, [u32; 20]>(*n)));
            if mesh.triangle_count == 0 {
                // A node without children, and one triangle that nothing hits, keep the walks free of special cases.
                out.cwbvh_nodes.push([0; 20]);
                out.bvh2_triangles.push([0.0; 12]);
            }
            if geometry.dynamic.part(index).is_some() {
                let mut places = vec![[0u32; 2]; mesh.triangle_count as usize];
                for (at, i) in b.cwbvh.primitive_indices.iter().enumerate() {
                    places[*i as usize][0] = (out.cwbvh_triangles.len() + at) as u32;
                }
                for (at, i) in b.order2.iter().enumerate() {
                    places[*i as usize][1] = (out.bvh2_triangles.len() + at) as u32;
                }
                let place = |(i, [cwbvh, bvh2]): (u32, [u32; 2])| DynamicTriangle {
                    triangle: mesh.first_triangle + i,
                    cwbvh,
                    bvh2,
                };
                out.dynamic.extend((0u32..).zip(places).map(place));
            }
            let pack = |i: &u32| {
                let t = mesh.first_triangle + i;
                let material = geometry.triangles[t as usize].material;
                packed_triangle(t, geometry.corners(t), scene.materials[material as usize].flags)
            };
            out.cwbvh_triangles.extend(b.cwbvh.primitive_indices.iter().map(pack));
            out.bvh2_triangles.extend(b.order2.iter().map(pack));
            out.bvh2_nodes.extend(b.nodes2);
        }
        let count = out.bvh2_triangles.len();
        if count > BVH2_MOST_TRIANGLES {
            return Err(TreeError::Triangles {
                map: scene.name.clone(),
                count,
                most: BVH2_MOST_TRIANGLES,
            });
        }
        Ok(out)
    }
}

/// Tree of a frame's polygons.
#[derive(Clone, Debug, Default)]
pub struct PolygonTree {
    pub cwbvh_nodes: Vec<[u32; 20]>,
    pub cwbvh_triangles: Vec<[f32; 12]>,
    pub bvh2_nodes: Vec<[f32; 16]>,
    pub bvh2_triangles: Vec<[f32; 12]>,
    /// Reference of the binary tree's root.
    pub root: u32,
}

/// Builds the trees over polygons. `flags`: of the scene's materials.
///
/// # Errors
/// [`TreeError`] where a tree is beyond what the shaders can walk.
pub fn polygon_tree(shape: &Shape, flags: &[u32], map: &str) -> Result<PolygonTree, TreeError> {
    let corners = |i: u32| std::array::from_fn(|k| Vec3::from(shape.positions[3 * i as usize + k]));
    let count = shape.triangles.len() as u32;
    if count == 0 {
        return Ok(PolygonTree {
            cwbvh_nodes: vec![[0; 20]],
            bvh2_triangles: vec![[0.0; 12]],
            root: BVH2_LEAF,
            ..PolygonTree::default()
        });
    }
    let boxes: Vec<Aabb> = (0..count)
        .map(|i| {
            let [a, b, c]: [Vec3; 3] = corners(i);
            Aabb::new(a.min(b).min(c).into(), a.max(b).max(c).into())
        })
        .collect();
    let mut params = obvhs::BvhBuildParams::fast_build();
    params.max_prims_per_leaf = params.max_prims_per_leaf.min(BVH2_LEAF_SIZE);
    let mut time = Duration::default();
    let wide = build_cwbvh(&boxes, params, &mut time);
    let binary = build_bvh2(&boxes, params, &mut time);
    let (bvh2_nodes, root, depth) = pack_pairs(&binary, |first, count| BVH2_LEAF | (count - 1) << 27 | first);
    for (tree, depth, most) in [
        ("8-wide", cwbvh_depth(&wide), CWBVH_STACK),
        ("binary", depth, BVH2_STACK),
    ] {
        if depth > most {
            return Err(TreeError::Depth {
                map: map.to_owned(),
                tree,
                mesh: shape.mesh.first_triangle as usize,
                depth,
                most,
            });
        }
    }
    let pack = |i: &u32| {
        let material = shape.triangles[*i as usize].material;
        packed_triangle(shape.mesh.first_triangle + i, corners(*i), flags[material as usize])
    };
    Ok(PolygonTree {
        cwbvh_nodes: wide.nodes.iter().map(|n| bytemuck::cast(*n)).collect(),
        cwbvh_triangles: wide.primitive_indices.iter().map(pack).collect(),
        bvh2_nodes,
        bvh2_triangles: binary.primitive_indices.iter().map(pack).collect(),
        root,
    })
}

fn packed_triangle(triangle: u32, [a, b, c]: [Vec3; 3], flags: u32) -> [f32; 12] {
    let tested = flags & (MATERIAL_ALPHA_TESTED | MATERIAL_LAYER) != 0;
    let id = triangle | if tested { NOT_OPAQUE_BIT } else { 0 };
    let (e1, e2) = (b - a, c - a);
    [
        a.x,
        a.y,
        a.z,
        f32::from_bits(id),
        e1.x,
        e1.y,
        e1.z,
        0.0,
        e2.x,
        e2.y,
        e2.z,
        0.0,
    ]
}

/// A binary tree over placed meshes. References below zero are −1 − instance.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct InstanceTree {
    /// (min, reference) (max, 0) of both children; empty where the root is an instance itself.
    pub nodes: Vec<[f32; 16]>,
    /// Reference of the root.
    pub root: u32,
}

/// The tree over all instances that are drawn but the world; `None` where there are none.
///
/// # Errors
/// [`TreeError::Depth`] where the tree is deeper than the shaders' stack.
pub fn instance_tree(meshes: &[Mesh], instances: &[Instance], map: &str) -> Result<Option<InstanceTree>, TreeError> {
    // Models without triangles (triggers, often by the hundred) would make a long chain of equal boxes.
    let drawn: Vec<usize> = (1..instances.len())
        .filter(|&i| meshes[instances[i].mesh as usize].triangle_count > 0)
        .collect();
    let boxes: Vec<Aabb> = drawn
        .iter()
        .map(|&i| {
            let i = &instances[i];
            let mesh = &meshes[i.mesh as usize];
            let mut b = Aabb::empty();
            for corner in 0..8 {
                let pick = |axis: usize| {
                    if corner >> axis & 1 == 1 {
                        mesh.bounds.max[axis]
                    } else {
                        mesh.bounds.min[axis]
                    }
                };
                let p = crate::reference::trace::point_to_world(i, Vec3::new(pick(0), pick(1), pick(2)));
                b.extend(p.into());
            }
            // Rounding of the transform must not push geometry out of its box.
            let slack = (b.max.abs().max(b.min.abs()) * 1e-5).into();
            let grow: Vec3 = slack;
            Aabb::new(b.min - glam::Vec3A::from(grow), b.max + glam::Vec3A::from(grow))
        })
        .collect();
    if boxes.is_empty() {
        return Ok(None);
    }
    let mut params = obvhs::BvhBuildParams::fast_build();
    params.max_prims_per_leaf = 1;
    let tree = build_bvh2(&boxes, params, &mut Duration::default());
    let reference =
        |first: u32, _count: u32| (-1 - drawn[tree.primitive_indices[first as usize] as usize] as i32) as u32;
    let (nodes, root, depth) = pack_pairs(&tree, reference);
    if depth > INSTANCE_STACK {
        return Err(TreeError::Depth {
            map: map.to_owned(),
            tree: "instance",
            mesh: 0,
            depth,
            most: INSTANCE_STACK,
        });
    }
    Ok(Some(InstanceTree { nodes, root }))
}
