//! Bounding volume hierarchies over the scene's meshes, built by the crate `obvhs`.

use super::static_geometry::{Geometry, Mesh};
use glam::Vec3;
use obvhs::BvhBuildParams;
use obvhs::aabb::Aabb;
use obvhs::cwbvh::CwBvh;
use obvhs::cwbvh::builder::{build_cwbvh, build_cwbvh_from_tris};
use obvhs::triangle::Triangle;
use rayon::prelude::*;
use std::time::Duration;

/// Boxes that hold the triangles of a dynamic mesh at all times; `None` for other meshes.
pub fn swept_boxes(geometry: &Geometry, mesh: usize) -> Option<Vec<Aabb>> {
    let aabb = |[min, max]: &[Vec3; 2]| Aabb::new((*min).into(), (*max).into());
    let part = geometry.dynamic.part(mesh)?;
    Some(part.boxes.iter().map(aabb).collect())
}

/// Triangles of a mesh in the form that `obvhs` takes.
pub fn mesh_triangles(geometry: &Geometry, mesh: &Mesh) -> Vec<Triangle> {
    (mesh.first_triangle..mesh.first_triangle + mesh.triangle_count)
        .map(|t| {
            let [v0, v1, v2] = geometry.corners(t).map(Into::into);
            Triangle { v0, v1, v2 }
        })
        .collect()
}

/// Above this many triangles a faster build is chosen, so that loading stays linear.
const THOROUGH_LIMIT: u32 = 400_000;

/// How much time a build may take for a better tree.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BvhQuality {
    /// For loading maps.
    Balanced,
    /// For the most rays per second; several times slower to build.
    Best,
}

/// Build parameters for a mesh of so many triangles.
pub fn build_params(triangles: u32, quality: BvhQuality) -> BvhBuildParams {
    match quality {
        BvhQuality::Best => BvhBuildParams::very_slow_build(),
        BvhQuality::Balanced if triangles > THOROUGH_LIMIT => BvhBuildParams::fast_build(),
        BvhQuality::Balanced => BvhBuildParams::medium_build(),
    }
}

/// One compressed 8-wide tree per mesh; primitive numbers count from the mesh's first triangle.
pub fn build_cwbvhs(geometry: &Geometry) -> Vec<CwBvh> {
    geometry
        .meshes
        .par_iter()
        .enumerate()
        .map(|(index, mesh)| {
            let params = build_params(mesh.triangle_count, BvhQuality::Balanced);
            let mut time = Duration::default();
            match swept_boxes(geometry, index) {
                Some(boxes) => build_cwbvh(&boxes, params, &mut time),
                None => build_cwbvh_from_tris(&mesh_triangles(geometry, mesh), params, &mut time),
            }
        })
        .collect()
}
