//! Ray queries against the scene on the CPU. Counterpart of `shaders/include/trace.glsl`.

use super::texture::alpha_at;
use crate::scene::Scene;
use crate::scene::bvh::build_cwbvhs;
use crate::scene::records::{Instance, MATERIAL_ALPHA_TESTED, MATERIAL_SKY};
use glam::{DVec3, Vec3};
use obvhs::cwbvh::CwBvh;
use obvhs::ray::{Ray, RayHit};

/// The nearest intersection along a ray.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// In units of the ray's direction vector.
    pub t: f64,
    /// Global triangle.
    pub triangle: u32,
    pub instance: u32,
    /// Weights of the second and third vertex.
    pub barycentrics: [f64; 2],
}

/// Trees and placed meshes.
pub struct Tracer {
    trees: Vec<CwBvh>,
    pub instances: Vec<Instance>,
}

/// Möller–Trumbore in double precision; both sides count. Returns t and the weights of the second and third vertex.
fn intersect(origin: DVec3, direction: DVec3, [a, b, c]: [Vec3; 3]) -> Option<(f64, [f64; 2])> {
    let a = a.as_dvec3();
    let (e1, e2) = (b.as_dvec3() - a, c.as_dvec3() - a);
    let p = direction.cross(e2);
    let det = e1.dot(p);
    if det == 0.0 {
        return None;
    }
    let inverse = det.recip();
    let s = origin - a;
    let u = s.dot(p) * inverse;
    let q = s.cross(e1);
    let v = direction.dot(q) * inverse;
    if !(u >= 0.0 && v >= 0.0 && u + v <= 1.0) {
        return None;
    }
    let t = e2.dot(q) * inverse;
    (t > 0.0).then_some((t, [u, v]))
}

fn transform(rows: &[[f32; 4]; 3], p: Vec3, w: f32) -> Vec3 {
    let row = |r: &[f32; 4]| r[0] * p.x + r[1] * p.y + r[2] * p.z + r[3] * w;
    Vec3::new(row(&rows[0]), row(&rows[1]), row(&rows[2]))
}

/// Object-space point to world space.
pub fn point_to_world(instance: &Instance, p: Vec3) -> Vec3 {
    if instance.identity == 1 {
        p
    } else {
        transform(&instance.object_to_world, p, 1.0)
    }
}

impl Tracer {
    /// Builds the trees of a scene.
    pub fn new(scene: &Scene) -> Self {
        Self {
            trees: build_cwbvhs(&scene.geometry),
            instances: scene.placements.iter().map(|p| p.record(&scene.geometry)).collect(),
        }
    }

    /// Visits accepted hits with 0 < t < `t_max`, nearer ones each time, until `stop` says so.
    fn visit(&self, scene: &Scene, origin: Vec3, direction: Vec3, t_max: f64, stop_at_first: bool) -> Option<Hit> {
        let mut best: Option<Hit> = None;
        let mut limit = t_max;
        for (index, instance) in self.instances.iter().enumerate() {
            let mesh = &scene.geometry.meshes[instance.mesh as usize];
            if mesh.triangle_count == 0 {
                continue;
            }
            let (o, d) = if instance.identity == 1 {
                (origin, direction)
            } else {
                (
                    transform(&instance.world_to_object, origin, 1.0),
                    transform(&instance.world_to_object, direction, 0.0),
                )
            };
            let (od, dd) = (o.as_dvec3(), d.as_dvec3());
            let tree = &self.trees[instance.mesh as usize];
            // The tree's own limit is single precision: rounding it up keeps every hit that double precision accepts.
            let ray = Ray::new(o.into(), d.into(), 0.0, next_up(limit));
            let mut state = tree.new_ray_traversal(ray);
            let mut node_hit = RayHit::none();
            let mut candidate = None;
            while tree.ray_traverse_dynamic(&mut state, &mut node_hit, |_, primitive| {
                let triangle = mesh.first_triangle + tree.primitive_indices[primitive];
                let corners = scene.geometry.corners(triangle);
                match intersect(od, dd, corners) {
                    Some((t, barycentrics)) if t < limit && passes(scene, triangle, barycentrics) => {
                        limit = t;
                        candidate = Some((t, triangle, barycentrics));
                        next_up(t)
                    }
                    _ => f32::INFINITY,
                }
            }) {
                if stop_at_first {
                    break;
                }
            }
            if let Some((t, triangle, barycentrics)) = candidate {
                best = Some(Hit {
                    t,
                    triangle,
                    instance: index as u32,
                    barycentrics,
                });
                if stop_at_first {
                    return best;
                }
            }
        }
        best
    }

    /// The nearest hit with 0 < t < `t_max`.
    pub fn closest(&self, scene: &Scene, origin: Vec3, direction: Vec3, t_max: f64) -> Option<Hit> {
        self.visit(scene, origin, direction, t_max, false)
    }

    /// Whether anything lies between: any hit with 0 < t < `t_max`.
    pub fn occluded(&self, scene: &Scene, origin: Vec3, direction: Vec3, t_max: f64) -> bool {
        self.visit(scene, origin, direction, t_max, true).is_some()
    }

    /// Whether a ray to infinity leaves through a sky surface.
    pub fn sees_sky(&self, scene: &Scene, origin: Vec3, direction: Vec3) -> bool {
        self.closest(scene, origin, direction, f64::from(f32::MAX))
            .is_some_and(|hit| {
                let material = scene.geometry.triangles[hit.triangle as usize].material;
                scene.materials[material as usize].flags & MATERIAL_SKY != 0
            })
    }
}

/// The next larger single-precision number, so that limits never cut off what lies exactly at them.
fn next_up(t: f64) -> f32 {
    (t as f32).next_up()
}

/// Alpha test of a candidate.
fn passes(scene: &Scene, triangle: u32, barycentrics: [f64; 2]) -> bool {
    let material = &scene.materials[scene.geometry.triangles[triangle as usize].material as usize];
    if material.flags & MATERIAL_ALPHA_TESTED == 0 {
        return true;
    }
    let alpha = alpha_at(scene, triangle, material, barycentrics.map(|b| b as f32));
    alpha * material.alpha_scale + material.alpha_offset > 0.0
}
