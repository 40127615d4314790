//! Ray queries against the scene on the CPU. Counterpart of `shaders/include/trace.glsl`.

use super::program::tested_alpha;
use super::surface::point_at;
use crate::render::settings::Settings;
use crate::scene::Scene;
use crate::scene::bvh::build_cwbvhs;
use crate::scene::camera::Camera;
use crate::scene::clock::Clock;
use crate::scene::dynamic_geometry::{self, Moved};
use crate::scene::entity_geometry::{EntityState, Placement, apply};
use crate::scene::guests::{GUEST_LIGHT, guests};
use crate::scene::motion::Moment;
use crate::scene::records::{
    Instance, Light, MATERIAL_ALPHA_TESTED, MATERIAL_FILTER, MATERIAL_LAYER, MATERIAL_SKY, Material, NONE,
    SEEN_BY_SHADOWS,
};
use glam::{Affine3A, DVec3, Mat3, Vec3, Vec3A};
use obvhs::cwbvh::CwBvh;
use obvhs::ray::{Ray, RayHit};
use std::cell::Cell;
use std::sync::Arc;

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

impl Hit {
    /// Order along a ray: by distance, and among coincident triangles by number.
    fn before(&self, t: f64, triangle: u32) -> bool {
        self.t < t || (self.t == t && self.triangle < triangle)
    }
}

/// Trees and placed meshes at a moment.
pub struct Tracer {
    trees: Arc<Vec<CwBvh>>,
    pub instances: Vec<Instance>,
    /// Of each instance, world space.
    bounds: Vec<Bounds>,
    pub clock: Clock,
    /// Glossy stages reflect.
    pub glossy: bool,
    /// Lights beside the map's: [`crate::scene::guests`].
    pub guests: Vec<Light>,
    /// Entities that are not as the map has them.
    pub states: Vec<EntityState>,
    /// Light of each triangle, or [`NONE`].
    lights: Arc<Vec<u32>>,
    /// Dynamic vertices at the moment.
    moved: Vec<Moved>,
}

/// A box in world space that holds an instance, larger than it by more than rounding can be off.
#[derive(Clone, Copy)]
struct Bounds {
    least: Vec3A,
    most: Vec3A,
}

impl Bounds {
    /// Slack, units, and relative to the largest coordinate.
    const SLACK: f32 = 0.1;
    const RELATIVE_SLACK: f32 = 4e-6;

    fn of(tree: &CwBvh, instance: &Instance) -> Self {
        let (min, max) = (tree.total_aabb.min, tree.total_aabb.max);
        let (middle, half) = (Vec3::from(0.5 * (min + max)), Vec3::from(0.5 * (max - min)));
        let extent = instance
            .object_to_world
            .map(|[x, y, z, _]| Vec3::new(x, y, z).abs().dot(half));
        let (middle, extent) = (Vec3A::from(point_to_world(instance, middle)), Vec3A::from(extent));
        let largest = (middle.abs() + extent).max_element();
        let extent = extent + Self::SLACK + Self::RELATIVE_SLACK * largest;
        Self {
            least: middle - extent,
            most: middle + extent,
        }
    }

    /// Whether a ray may meet what is in the box at 0 < t < `t_max`: slabs (Kay and Kajiya 1986) with room for rounding (Ize
    /// 2013). No component of `inverse` is infinite.
    fn met(&self, origin: Vec3A, inverse: Vec3A, t_max: f32) -> bool {
        let (a, b) = ((self.least - origin) * inverse, (self.most - origin) * inverse);
        let (near, far) = (a.min(b).max_element(), a.max(b).min_element());
        far >= 0.0 && near <= far * 1.000_001 && near <= t_max
    }
}

/// 1 over a direction, finite where it has none in a component.
fn finite_inverse(direction: Vec3A) -> Vec3A {
    const LEAST: f32 = 1e-30;
    Vec3A::select(
        direction.abs().cmplt(Vec3A::splat(LEAST)),
        Vec3A::splat(LEAST),
        direction,
    )
    .recip()
}

/// What a ray looks for.
enum Wanted<'a> {
    /// The nearest that is no layer.
    Solid(&'a Cell<bool>),
    /// Any that is no layer.
    Blocker(&'a Cell<bool>),
    /// The nearest of all, layers too, that comes after a hit.
    Next(Option<Hit>, u32),
}

impl Wanted<'_> {
    /// Which instances the ray meets: `SEEN_BY_…`.
    fn kind(&self) -> u32 {
        match self {
            Self::Solid(_) | Self::Blocker(_) => SEEN_BY_SHADOWS,
            Self::Next(_, kind) => *kind,
        }
    }
}

fn instances(scene: &Scene, moment: &Moment, states: &[EntityState]) -> Vec<Instance> {
    let record = |p: &Placement| p.record(&scene.geometry.meshes, moment, moment);
    let mut records: Vec<Instance> = scene.placements.iter().map(record).collect();
    apply([states, states], &scene.placements, &mut records);
    records
}

fn bounds(trees: &[CwBvh], instances: &[Instance]) -> Vec<Bounds> {
    let of = |i: &Instance| Bounds::of(&trees[i.mesh as usize], i);
    instances.iter().map(of).collect()
}

/// What is between two points.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Between {
    Blocked,
    /// Nothing but layers that take something from light.
    Filtered,
    Free,
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

fn affine(rows: &[[f32; 4]; 3]) -> Affine3A {
    let column = |c: usize| Vec3::new(rows[0][c], rows[1][c], rows[2][c]);
    Affine3A::from_mat3_translation(Mat3::from_cols(column(0), column(1), column(2)), column(3))
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
        let instances = instances(scene, &Clock::default().into(), &[]);
        let trees = Arc::new(build_cwbvhs(&scene.geometry));
        Self {
            bounds: bounds(&trees, &instances),
            trees,
            clock: Clock::default(),
            glossy: false,
            guests: Vec::new(),
            states: Vec::new(),
            lights: Arc::new(scene.lights.of_triangles(scene.geometry.triangles.len())),
            moved: dynamic_geometry::all(scene, &instances, Clock::default(), Vec3::ZERO),
            instances,
        }
    }

    /// The same scene at another moment, seen by `camera`.
    pub fn at(&self, scene: &Scene, settings: &Settings, camera: &Camera) -> Self {
        let (clock, eye) = (settings.clock, camera.eye.into());
        let instances = instances(scene, &settings.moment(camera), &self.states);
        Self {
            trees: self.trees.clone(),
            bounds: bounds(&self.trees, &instances),
            clock,
            glossy: settings.reflects(),
            guests: guests(&self.guests, camera, settings.flashlight),
            states: self.states.clone(),
            lights: self.lights.clone(),
            moved: dynamic_geometry::all(scene, &instances, clock, eye),
            instances,
        }
    }

    /// Number of the light that a triangle is.
    pub fn light_of(&self, triangle: u32) -> Option<u32> {
        Some(self.lights[triangle as usize]).filter(|l| *l != NONE)
    }

    /// A light where it is at the moment.
    pub fn light(&self, scene: &Scene, number: u32) -> Light {
        if let Some(guest) = number.checked_sub(GUEST_LIGHT) {
            return self.guests[guest as usize];
        }
        let light = scene.lights.lights[number as usize];
        match self.instances.get(light.instance as usize) {
            None => light,
            Some(now) => {
                let start = scene.placements[light.instance as usize].pose(Clock::default());
                light.moved(affine(&now.object_to_world) * start.inverse())
            }
        }
    }

    fn vertex(&self, scene: &Scene, vertex: u32) -> Option<&Moved> {
        let first = scene.geometry.dynamic.vertices.start;
        vertex.checked_sub(first).and_then(|i| self.moved.get(i as usize))
    }

    /// Corner positions of a triangle at the moment, object space.
    pub fn corners(&self, scene: &Scene, triangle: u32) -> [Vec3; 3] {
        let vertices = scene.geometry.triangles[triangle as usize].vertices;
        vertices.map(|v| {
            let still = || Vec3::from(scene.geometry.positions[v as usize]);
            self.vertex(scene, v).map_or_else(still, |m| m.position)
        })
    }

    /// Normals of a triangle's vertices at the moment, object space.
    pub fn normals(&self, scene: &Scene, triangle: u32) -> [Vec3; 3] {
        let vertices = scene.geometry.triangles[triangle as usize].vertices;
        vertices.map(|v| {
            let still = || Vec3::from(scene.geometry.attributes[v as usize].normal);
            self.vertex(scene, v).map_or_else(still, |m| m.normal)
        })
    }

    /// Looks for hits with 0 < t < `t_max`.
    fn visit(&self, scene: &Scene, origin: Vec3, direction: Vec3, t_max: f64, wanted: &Wanted<'_>) -> Option<Hit> {
        let mut best: Option<Hit> = None;
        let mut limit = t_max;
        let (from, inverse) = (Vec3A::from(origin), finite_inverse(direction.into()));
        for (index, (instance, bounds)) in self.instances.iter().zip(&self.bounds).enumerate() {
            if !bounds.met(from, inverse, next_up(limit)) {
                continue;
            }
            let mesh = &scene.geometry.meshes[instance.mesh as usize];
            if mesh.triangle_count == 0 || instance.seen_by & wanted.kind() == 0 {
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
            // The tree tells a ray's octant by `< 0`, which −0 is not, though its inverse is −∞: such rays would miss all.
            let d = d + Vec3::ZERO;
            let (od, dd) = (o.as_dvec3(), d.as_dvec3());
            let tree = &self.trees[instance.mesh as usize];
            // The tree's own limit is single precision: rounding it up keeps every hit that double precision accepts.
            let ray = Ray::new(o.into(), d.into(), 0.0, next_up(limit));
            let mut state = tree.new_ray_traversal(ray);
            let mut node_hit = RayHit::none();
            while tree.ray_traverse_dynamic(&mut state, &mut node_hit, |_, primitive| {
                let triangle = mesh.first_triangle + tree.primitive_indices[primitive];
                let Some((t, barycentrics)) = intersect(od, dd, self.corners(scene, triangle)) else {
                    return f32::INFINITY;
                };
                let nearer = t < limit || best.is_some_and(|b| t == limit && triangle < b.triangle);
                let hit = Hit {
                    t,
                    triangle,
                    instance: index as u32,
                    barycentrics,
                };
                if !nearer || !self.accepts(scene, &hit, direction, wanted) {
                    return f32::INFINITY;
                }
                limit = t;
                best = Some(hit);
                next_up(t)
            }) {
                if matches!(wanted, Wanted::Blocker(_)) {
                    break;
                }
            }
            if best.is_some() && matches!(wanted, Wanted::Blocker(_)) {
                return best;
            }
        }
        best
    }

    /// Whether a candidate is what a ray looks for.
    fn accepts(&self, scene: &Scene, hit: &Hit, direction: Vec3, wanted: &Wanted<'_>) -> bool {
        let material = &scene.materials[scene.geometry.triangles[hit.triangle as usize].material as usize];
        if material.flags & (MATERIAL_ALPHA_TESTED | MATERIAL_LAYER) == 0 {
            return match wanted {
                Wanted::Next(Some(after), _) => after.before(hit.t, hit.triangle),
                _ => true,
            };
        }
        match wanted {
            Wanted::Next(after, _) => {
                after.is_none_or(|a| a.before(hit.t, hit.triangle)) && self.passes(scene, material, hit, direction)
            }
            Wanted::Solid(filtered) | Wanted::Blocker(filtered) => {
                if material.flags & MATERIAL_LAYER != 0 {
                    filtered.set(filtered.get() || material.flags & MATERIAL_FILTER != 0);
                    return false;
                }
                self.passes(scene, material, hit, direction)
            }
        }
    }

    /// Alpha test of a candidate.
    fn passes(&self, scene: &Scene, material: &Material, hit: &Hit, direction: Vec3) -> bool {
        if material.flags & MATERIAL_ALPHA_TESTED == 0 {
            return true;
        }
        let point = point_at(scene, self, hit, direction);
        tested_alpha(scene, material, &point, self.clock) * material.alpha_scale + material.alpha_offset > 0.0
    }

    /// The nearest hit with 0 < t < `t_max` that is no layer.
    pub fn closest(&self, scene: &Scene, origin: Vec3, direction: Vec3, t_max: f64) -> Option<Hit> {
        self.visit(scene, origin, direction, t_max, &Wanted::Solid(&Cell::new(false)))
    }

    /// The nearest hit of a shadow ray after another one, layers included.
    pub fn next(&self, scene: &Scene, origin: Vec3, direction: Vec3, t_max: f64, after: Option<Hit>) -> Option<Hit> {
        self.visit(scene, origin, direction, t_max, &Wanted::Next(after, SEEN_BY_SHADOWS))
    }

    /// The nearest hit of a ray that looks after another one, layers included. `kind`: one of `SEEN_BY_…`.
    pub fn look(&self, scene: &Scene, origin: Vec3, direction: Vec3, after: Option<Hit>, kind: u32) -> Option<Hit> {
        self.visit(
            scene,
            origin,
            direction,
            f64::from(f32::MAX),
            &Wanted::Next(after, kind),
        )
    }

    /// What lies at 0 < t < `t_max`.
    pub fn between(&self, scene: &Scene, origin: Vec3, direction: Vec3, t_max: f64) -> Between {
        let filtered = Cell::new(false);
        match self.visit(scene, origin, direction, t_max, &Wanted::Blocker(&filtered)) {
            Some(_) => Between::Blocked,
            None if filtered.get() => Between::Filtered,
            None => Between::Free,
        }
    }

    /// Whether anything but layers lies between: any hit with 0 < t < `t_max`.
    pub fn occluded(&self, scene: &Scene, origin: Vec3, direction: Vec3, t_max: f64) -> bool {
        self.between(scene, origin, direction, t_max) == Between::Blocked
    }

    /// Distance to the sky surface through which a ray to infinity leaves, and whether layers may lie before it.
    pub fn sky(&self, scene: &Scene, origin: Vec3, direction: Vec3) -> Option<(f64, bool)> {
        let filtered = Cell::new(false);
        let wanted = Wanted::Solid(&filtered);
        let hit = self.visit(scene, origin, direction, f64::from(f32::MAX), &wanted)?;
        let material = scene.geometry.triangles[hit.triangle as usize].material;
        (scene.materials[material as usize].flags & MATERIAL_SKY != 0).then_some((hit.t, filtered.get()))
    }

    /// Whether a ray to infinity leaves through a sky surface.
    pub fn sees_sky(&self, scene: &Scene, origin: Vec3, direction: Vec3) -> bool {
        self.sky(scene, origin, direction).is_some()
    }
}

/// The next larger single-precision number, so that limits never cut off what lies exactly at them.
fn next_up(t: f64) -> f32 {
    (t as f32).next_up()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::assets::vfs::Vfs;
    use crate::content::embedded::EMBEDDED;

    /// A component of −0 is one of 0.
    #[test]
    fn rays_along_axes_hit_whatever_the_signs_of_their_zeros() {
        let scene = Scene::load(&Vfs::mount(&[], EMBEDDED), "showcase").expect("the shipped map");
        let tracer = Tracer::new(&scene);
        let eye = Vec3::from(crate::scene::spawns::view(&scene.spawns[0], 90.0).eye);
        let hit = |d: Vec3| tracer.closest(&scene, eye, d, f64::from(f32::MAX)).map(|h| h.t);
        for axis in [Vec3::X, Vec3::Y, Vec3::Z, -Vec3::X, -Vec3::Y, -Vec3::Z] {
            let zeros = |zero: f32| Vec3::from(axis.to_array().map(|c| if c == 0.0 { zero } else { c }));
            let found = hit(zeros(0.0));
            assert!(found.is_some() && hit(zeros(-0.0)) == found, "{axis}: {found:?}");
        }
    }
}
