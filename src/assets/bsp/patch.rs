//! Tessellation of quadratic Bézier patches by a curvature bound, without cracks between neighbours.
//!
//! A patch surface is a grid of 3x3 sub-patches. Each boundary edge of a sub-patch is cut into a number of segments that
//! depends on that edge's own three control points only, so that two patches which share the control points share the
//! vertices too, bit for bit, whichever way round they run: curves are summed in an order that does not change when they
//! are reversed. Inside, the sub-patch has a finer regular grid; boundary vertices which the coarser edge lacks collapse
//! onto their neighbour on the edge, which leaves no T-junction.

use super::lumps::Vertex;
use glam::{Vec2, Vec3, Vec4};

/// Largest distance in units between curve and chord.
pub const CURVATURE_BOUND: f32 = 0.1;
/// Most segments along one edge of a 3x3 sub-patch, a power of two.
const MAX_SEGMENTS: usize = 64;

/// A point of a surface: position and normal in world units, texture and lightmap coordinates, encoded vertex colour 0..1.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct MeshVertex {
    pub position: Vec3,
    pub normal: Vec3,
    pub uv: Vec2,
    pub lightmap_uv: Vec2,
    pub color: Vec4,
}

impl From<&Vertex> for MeshVertex {
    fn from(v: &Vertex) -> Self {
        Self {
            position: v.position.into(),
            normal: Vec3::from(v.normal).normalize_or_zero(),
            uv: v.uv.into(),
            lightmap_uv: v.lightmap_uv.into(),
            color: Vec4::from_array(v.color.map(|c| f32::from(c) / 255.0)),
        }
    }
}

/// Triangles of a tessellated patch, wound like the map's planar surfaces (clockwise seen from the front).
#[derive(Clone, Debug, Default)]
pub struct PatchMesh {
    pub vertices: Vec<MeshVertex>,
    pub indices: Vec<u32>,
}

/// Number of segments of a quadratic curve: the chord error of n equal steps is |p0 − 2 p1 + p2| / (4 n²).
fn segments(p0: Vec3, p1: Vec3, p2: Vec3, bound: f32) -> usize {
    let deviation = ((p0 + p2) - 2.0 * p1).length() * 0.25;
    let wanted = (deviation / bound).sqrt();
    let mut n = 1;
    while (n as f32) < wanted && n < MAX_SEGMENTS {
        n *= 2;
    }
    n
}

/// Quadratic Bézier, summed so that reversing points and parameter gives the same bits.
macro_rules! bezier {
    ($p0:expr, $p1:expr, $p2:expr, $t:expr) => {{
        let t: f32 = $t;
        let s = 1.0 - t;
        ($p0 * (s * s) + $p2 * (t * t)) + $p1 * (2.0 * (s * t))
    }};
}

fn mix(p: &[MeshVertex; 3], t: f32) -> MeshVertex {
    MeshVertex {
        position: bezier!(p[0].position, p[1].position, p[2].position, t),
        normal: bezier!(p[0].normal, p[1].normal, p[2].normal, t),
        uv: bezier!(p[0].uv, p[1].uv, p[2].uv, t),
        lightmap_uv: bezier!(p[0].lightmap_uv, p[1].lightmap_uv, p[2].lightmap_uv, t),
        color: bezier!(p[0].color, p[1].color, p[2].color, t),
    }
}

fn slope(p: [Vec3; 3], t: f32) -> Vec3 {
    (p[1] - p[0]) * (1.0 - t) + (p[2] - p[1]) * t
}

/// One 3x3 sub-patch; `c[row][column]`.
struct SubPatch {
    c: [[MeshVertex; 3]; 3],
}

impl SubPatch {
    fn column(&self, u: usize) -> [MeshVertex; 3] {
        [self.c[0][u], self.c[1][u], self.c[2][u]]
    }

    /// Point at (u along rows, v along columns) with the true normal of the surface there.
    fn at(&self, u: f32, v: f32) -> MeshVertex {
        let columns: [MeshVertex; 3] = std::array::from_fn(|i| mix(&self.column(i), v));
        let mut point = mix(&columns, u);
        let along_u = slope(columns.map(|p| p.position), u);
        let rows: [Vec3; 3] = std::array::from_fn(|j| mix(&self.c[j], u).position);
        let along_v = slope(rows, v);
        let authored = point.normal.normalize_or_zero();
        let cross = along_u.cross(along_v);
        // A collapsed edge has no tangent plane of its own: the authored normal stands in.
        let flat = cross.length_squared() <= 1e-8 * along_u.length_squared() * along_v.length_squared();
        point.normal = if flat || !cross.is_finite() || cross == Vec3::ZERO {
            authored
        } else {
            let n = cross.normalize();
            if n.dot(authored) < 0.0 { -n } else { n }
        };
        point
    }

    fn edge(&self, a: (usize, usize), b: (usize, usize), c: (usize, usize), bound: f32) -> usize {
        let p = |(row, column): (usize, usize)| self.c[row][column].position;
        segments(p(a), p(b), p(c), bound)
    }

    fn tessellate(&self, bound: f32, mesh: &mut PatchMesh) {
        let (top, bottom) = (
            self.edge((0, 0), (0, 1), (0, 2), bound),
            self.edge((2, 0), (2, 1), (2, 2), bound),
        );
        let (left, right) = (
            self.edge((0, 0), (1, 0), (2, 0), bound),
            self.edge((0, 2), (1, 2), (2, 2), bound),
        );
        let nu = top.max(bottom).max(self.edge((1, 0), (1, 1), (1, 2), bound));
        let nv = left.max(right).max(self.edge((0, 1), (1, 1), (2, 1), bound));
        let base = mesh.vertices.len() as u32;
        for j in 0..=nv {
            for i in 0..=nu {
                mesh.vertices.push(self.at(i as f32 / nu as f32, j as f32 / nv as f32));
            }
        }
        // Which vertex stands for grid point (i, j): itself, or its neighbour on a coarser edge.
        let snap = |i: usize, n: usize, coarse: usize| {
            let step = n / coarse;
            (i + step / 2) / step * step
        };
        let index = |i: usize, j: usize| {
            let (mut si, mut sj) = (i, j);
            if j == 0 {
                si = snap(i, nu, top);
            } else if j == nv {
                si = snap(i, nu, bottom);
            }
            if i == 0 {
                sj = snap(j, nv, left);
            } else if i == nu {
                sj = snap(j, nv, right);
            }
            base + (sj * (nu + 1) + si) as u32
        };
        for j in 0..nv {
            for i in 0..nu {
                let (a, b, c, d) = (index(i, j), index(i + 1, j), index(i + 1, j + 1), index(i, j + 1));
                for triangle in [[a, b, c], [a, c, d]] {
                    mesh.push_triangle(triangle);
                }
            }
        }
    }
}

impl PatchMesh {
    /// Adds a triangle unless it has collapsed, wound to agree with its vertices' normals.
    fn push_triangle(&mut self, [a, b, c]: [u32; 3]) {
        let (va, vb, vc) = (
            self.vertices[a as usize],
            self.vertices[b as usize],
            self.vertices[c as usize],
        );
        let cross = (vb.position - va.position).cross(vc.position - va.position);
        if cross == Vec3::ZERO || !cross.is_finite() {
            return;
        }
        // Clockwise from the front: the cross product points away from the normal.
        if cross.dot(va.normal + vb.normal + vc.normal) > 0.0 {
            self.indices.extend([a, c, b]);
        } else {
            self.indices.extend([a, b, c]);
        }
    }
}

/// Tessellates a `width` x `height` grid of control points (row by row, both odd) to within `bound` units.
pub fn tessellate(control: &[Vertex], width: usize, height: usize, bound: f32) -> PatchMesh {
    let mut mesh = PatchMesh::default();
    for row in (0..height.saturating_sub(2)).step_by(2) {
        for column in (0..width.saturating_sub(2)).step_by(2) {
            let at = |j: usize, i: usize| MeshVertex::from(&control[(row + j) * width + column + i]);
            let sub = SubPatch {
                c: std::array::from_fn(|j| std::array::from_fn(|i| at(j, i))),
            };
            sub.tessellate(bound, &mut mesh);
        }
    }
    mesh
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::HashMap;

    fn vertex(position: [f32; 3]) -> Vertex {
        Vertex {
            position,
            uv: [position[0], position[1]],
            lightmap_uv: [0.0; 2],
            normal: [0.0, 0.0, 1.0],
            color: [255; 4],
        }
    }

    fn grid(width: usize, height: usize, f: impl Fn(f32, f32) -> f32) -> Vec<Vertex> {
        (0..width * height)
            .map(|k| {
                let (x, y) = ((k % width) as f32 * 48.3, (k / width) as f32 * 51.7);
                vertex([x, y, f(x, y)])
            })
            .collect()
    }

    /// Edges used by one triangle only, as position pairs.
    fn open_edges(meshes: &[&PatchMesh]) -> Vec<[[u32; 3]; 2]> {
        let mut count: HashMap<[[u32; 3]; 2], usize> = HashMap::new();
        for mesh in meshes {
            for t in mesh.indices.chunks(3) {
                for k in 0..3 {
                    let mut edge =
                        [t[k], t[(k + 1) % 3]].map(|i| mesh.vertices[i as usize].position.to_array().map(f32::to_bits));
                    edge.sort_unstable();
                    *count.entry(edge).or_default() += 1;
                }
            }
        }
        count.into_iter().filter(|(_, n)| *n == 1).map(|(e, _)| e).collect()
    }

    #[test]
    fn a_flat_patch_is_two_triangles_a_sub_patch() {
        let mesh = tessellate(&grid(5, 3, |_, _| 0.0), 5, 3, CURVATURE_BOUND);
        assert_eq!(mesh.indices.len(), 2 * 2 * 3);
    }

    #[test]
    fn no_cracks_inside_a_patch_of_uneven_curvature() {
        let mesh = tessellate(
            &grid(7, 5, |x, y| (x * 0.031).sin() * 90.0 + (y * y) * 0.004),
            7,
            5,
            CURVATURE_BOUND,
        );
        let on_border = |p: [u32; 3]| {
            let (x, y) = (f32::from_bits(p[0]), f32::from_bits(p[1]));
            x == 0.0 || y == 0.0 || (x - 6.0 * 48.3).abs() < 1e-2 || (y - 4.0 * 51.7).abs() < 1e-2
        };
        for [a, b] in open_edges(&[&mesh]) {
            assert!(on_border(a) && on_border(b), "crack inside the patch");
        }
    }

    #[test]
    fn neighbours_that_run_the_other_way_share_their_edge_bit_for_bit() {
        let bend = |x: f32, y: f32| (x * 0.02).cos() * 70.0 + y * 0.3;
        let near = grid(3, 3, bend);
        // The neighbour continues beyond the row y = 2·51.7, mirrored in x, and is far more curved inside.
        let far: Vec<Vertex> = (0..9)
            .map(|k| {
                let (column, row) = (k % 3, k / 3);
                let mut v = near[6 + 2 - column];
                v.position[1] += row as f32 * 40.0;
                v.position[2] += if row == 1 { 300.0 } else { 0.0 };
                v
            })
            .collect();
        let (a, b) = (tessellate(&near, 3, 3, 0.1), tessellate(&far, 3, 3, 0.1));
        let seam = near[6].position[1];
        for [p, q] in open_edges(&[&a, &b]) {
            let y = [f32::from_bits(p[1]), f32::from_bits(q[1])];
            assert!(!(y[0] == seam && y[1] == seam), "open edge on the seam");
        }
    }

    #[test]
    fn the_chord_error_keeps_the_bound() {
        let (p0, p1, p2) = (Vec3::ZERO, Vec3::new(50.0, 0.0, 100.0), Vec3::new(100.0, 0.0, 0.0));
        let n = segments(p0, p1, p2, CURVATURE_BOUND);
        for i in 0..n {
            let t = |k: f32| (i as f32 + k) / n as f32;
            let chord = (bezier!(p0, p1, p2, t(0.0)) + bezier!(p0, p1, p2, t(1.0))) * 0.5;
            assert!(bezier!(p0, p1, p2, t(0.5)).distance(chord) <= CURVATURE_BOUND);
        }
    }

    #[test]
    fn collapsed_control_points_give_finite_normals_and_no_degenerate_triangle() {
        let mut control = grid(3, 3, |x, _| x * 0.5);
        for v in &mut control[..3] {
            v.position = [0.0, 0.0, 0.0];
        }
        let mesh = tessellate(&control, 3, 3, CURVATURE_BOUND);
        assert!(!mesh.indices.is_empty());
        assert!(mesh.vertices.iter().all(|v| v.normal.is_finite()));
    }
}
