//! Writes drawn geometry into the vertex, index and surface lumps.
//!
//! Winding as in id's maps: a triangle's vertices run clockwise as seen from the side that its vertex normals point to.

use super::drawn::{Mesh, Patch};
use super::faces::DrawnFace;
use super::map::{Mapping, Paint, ShaderId};
use super::shape::{Bounds, Face, plane_axes};
use crate::assets::bsp::file::Bsp;
use crate::assets::bsp::lumps::{SURFACE_PATCH, SURFACE_PLANAR, SURFACE_TRIANGLES, Surface, Vertex};
use glam::{Vec2, Vec3};

/// `Surface::lightmap` of a surface that has none and is lit at its vertices.
const LIT_AT_VERTICES: i32 = -3;
/// Vertex colour in place of baked light.
const NEUTRAL: [u8; 4] = [128, 128, 128, 255];

fn vertex(position: Vec3, uv: Vec2, normal: Vec3) -> Vertex {
    // −0 and 0 are equal but not the same bytes: adding 0 leaves one of them.
    Vertex {
        position: (position + 0.0).to_array(),
        uv: (uv + 0.0).to_array(),
        lightmap_uv: [0.0; 2],
        normal: (normal + 0.0).to_array(),
        color: NEUTRAL,
    }
}

fn blank(bsp: &Bsp, shader: ShaderId, kind: i32) -> Surface {
    Surface {
        shader: shader.0,
        fog: -1,
        kind,
        first_vertex: bsp.vertices.len() as i32,
        vertex_count: 0,
        first_index: bsp.indices.len() as i32,
        index_count: 0,
        lightmap: LIT_AT_VERTICES,
        lightmap_x: 0,
        lightmap_y: 0,
        lightmap_width: 0,
        lightmap_height: 0,
        lightmap_origin: [0.0; 3],
        lightmap_vectors: [[0.0; 3]; 3],
        patch_width: 0,
        patch_height: 0,
    }
}

fn finish(bsp: &mut Bsp, mut surface: Surface) {
    surface.vertex_count = bsp.vertices.len() as i32 - surface.first_vertex;
    surface.index_count = bsp.indices.len() as i32 - surface.first_index;
    bsp.surfaces.push(surface);
}

/// Appends one planar surface of all pieces of a face.
pub fn push_face(bsp: &mut Bsp, face: &DrawnFace) {
    let normal = face.facing.normal();
    let mut surface = blank(bsp, face.paint.shader, SURFACE_PLANAR);
    for piece in &face.pieces {
        let corners = rectangle(piece, face.facing);
        let uvs = corners.map(|p| match face.paint.mapping {
            Mapping::World(units) => world_uv(p, normal, units),
            Mapping::Fit => fitted_uv(p, &face.whole, face.facing),
        });
        push_quad(bsp, &surface, corners, uvs, normal);
    }
    plane_of(&mut surface, face.whole.mins.as_vec3(), normal);
    finish(bsp, surface);
}

/// Appends a free quadrilateral, corners counter-clockwise as seen from its front.
pub fn push_free_quad(bsp: &mut Bsp, corners: [Vec3; 4], paint: Paint) {
    let normal = (corners[1] - corners[0])
        .cross(corners[3] - corners[0])
        .normalize_or(Vec3::Z);
    let mut surface = blank(bsp, paint.shader, SURFACE_PLANAR);
    let uvs = match paint.mapping {
        Mapping::World(units) => corners.map(|p| world_uv(p, normal, units)),
        Mapping::Fit => [Vec2::Y, Vec2::ONE, Vec2::X, Vec2::ZERO],
    };
    push_quad(bsp, &surface, corners, uvs, normal);
    plane_of(&mut surface, corners[0], normal);
    finish(bsp, surface);
}

/// Appends a patch.
pub fn push_patch(bsp: &mut Bsp, patch: &Patch, shader: ShaderId) {
    let mut surface = blank(bsp, shader, SURFACE_PATCH);
    surface.patch_width = patch.width as i32;
    surface.patch_height = patch.height as i32;
    let positions = || patch.points.iter().map(|p| p.position);
    // The game groups patches of equal bounds for level of detail.
    surface.lightmap_vectors[0] = positions().fold(Vec3::INFINITY, Vec3::min).to_array();
    surface.lightmap_vectors[1] = positions().fold(Vec3::NEG_INFINITY, Vec3::max).to_array();
    let normals = patch.normals();
    bsp.vertices.extend(
        patch
            .points
            .iter()
            .zip(normals)
            .map(|(p, n)| vertex(p.position, p.uv, n)),
    );
    finish(bsp, surface);
}

/// Appends a triangle soup.
pub fn push_mesh(bsp: &mut Bsp, mesh: &Mesh, shader: ShaderId) {
    let surface = blank(bsp, shader, SURFACE_TRIANGLES);
    bsp.vertices
        .extend(mesh.vertices.iter().map(|v| vertex(v.position, v.uv, v.normal)));
    bsp.indices.extend(
        mesh.triangles
            .iter()
            .flat_map(|&[a, b, c]| [a as i32, c as i32, b as i32]),
    );
    finish(bsp, surface);
}

fn push_quad(bsp: &mut Bsp, surface: &Surface, corners: [Vec3; 4], uvs: [Vec2; 4], normal: Vec3) {
    let first = bsp.vertices.len() as i32 - surface.first_vertex;
    for i in (0..4).rev() {
        bsp.vertices.push(vertex(corners[i], uvs[i], normal));
    }
    bsp.indices.extend([0, 1, 2, 0, 2, 3].map(|i| first + i));
}

fn plane_of(surface: &mut Surface, origin: Vec3, normal: Vec3) {
    surface.lightmap_origin = origin.to_array();
    surface.lightmap_vectors[2] = (normal + 0.0).to_array();
}

/// Corners of a rectangle, counter-clockwise as seen from the side `facing` points to.
fn rectangle(rect: &Bounds, facing: Face) -> [Vec3; 4] {
    let [u, v] = plane_axes(facing.axis());
    let (mins, maxs) = (rect.mins.as_vec3(), rect.maxs.as_vec3());
    let corner = |at_u: bool, at_v: bool| {
        let mut p = mins;
        p[u] = if at_u { maxs[u] } else { mins[u] };
        p[v] = if at_v { maxs[v] } else { mins[v] };
        p
    };
    let mut corners = [
        corner(false, false),
        corner(true, false),
        corner(true, true),
        corner(false, true),
    ];
    // u × v points up x and z but down y.
    if facing.is_max() == (facing.axis() == 1) {
        corners.reverse();
    }
    corners
}

/// Texture coordinates of the two axes across the normal's main one; images stand upright on walls.
fn projected(p: Vec3, normal: Vec3) -> Vec2 {
    let n = normal.abs();
    if n.z >= n.x && n.z >= n.y {
        Vec2::new(p.x, -p.y)
    } else if n.x >= n.y {
        Vec2::new(p.y, -p.z)
    } else {
        Vec2::new(p.x, -p.z)
    }
}

fn world_uv(p: Vec3, normal: Vec3, units: f32) -> Vec2 {
    projected(p, normal) / units
}

fn fitted_uv(p: Vec3, whole: &Bounds, facing: Face) -> Vec2 {
    let normal = facing.normal();
    let (a, b) = (
        projected(whole.mins.as_vec3(), normal),
        projected(whole.maxs.as_vec3(), normal),
    );
    let (least, size) = (a.min(b), (b - a).abs());
    (projected(p, normal) - least) / size
}
