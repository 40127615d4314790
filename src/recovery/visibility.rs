//! Visibility as the map compiler saw it: solid leafs and opaque drawn surfaces of the world, no brush models.

use super::luxels::Luxel;
use super::random::Random;
use crate::reference::trace::{Hit, Tracer};
use crate::scene::Scene;
use crate::scene::clusters::cluster_at;
use crate::scene::records::BspNode;
use glam::Vec3;

/// Part of a ray that is traced towards a point: what carries the light does not shade it.
const REACH: f64 = 0.999;

/// The occluders of a scene's world model.
pub struct Occluders<'a> {
    pub scene: &'a Scene,
    /// The compiler blurred each light over neighbouring luxels (`-filter`).
    pub filtered: bool,
    tracer: Tracer,
}

impl<'a> Occluders<'a> {
    /// Builds the trees.
    pub fn new(scene: &'a Scene) -> Self {
        let mut tracer = Tracer::new(scene);
        let of_world = |mesh: u32| scene.geometry.dynamic.carrier(mesh as usize) == 0;
        tracer.instances.retain(|i| of_world(i.mesh));
        Self {
            scene,
            filtered: compiled_with(scene, "-filter"),
            tracer,
        }
    }

    /// Places around a luxel that stand for it, as many as `rays` tells at most: `-filter` blurs each light with 1 2 1 over
    /// rows and columns, which four places have the same second moments as.
    pub fn places(&self, luxel: &Luxel) -> impl Iterator<Item = Luxel> {
        const SPREAD: f32 = std::f32::consts::FRAC_1_SQRT_2;
        let spread = if self.filtered { SPREAD } else { 0.0 };
        let around = [
            (-spread, -spread),
            (spread, -spread),
            (-spread, spread),
            (spread, spread),
        ];
        let luxel = *luxel;
        around
            .into_iter()
            .take(if self.filtered { 4 } else { 1 })
            .map(move |(u, v)| luxel.moved(u, v))
    }

    /// A luxel's place for one ray: at random as `-filter` spreads light (1 2 1 is a triangle of half width 1), if it does.
    pub fn spread(&self, luxel: &Luxel, random: &mut Random) -> Luxel {
        if !self.filtered {
            return *luxel;
        }
        let mut triangle = || random.unit() - random.unit();
        let place = luxel.moved(triangle(), triangle());
        if self.open(&place) { place } else { *luxel }
    }

    /// Whether a luxel's sample there would lie in the open.
    pub fn open(&self, luxel: &Luxel) -> bool {
        cluster_at(&self.scene.bsp_nodes, luxel.origin(luxel.normal)).is_some()
    }

    /// Mean over a luxel's places of the light from a point, `value` being the unshadowed one; 0 where all are in solid.
    pub fn lit(&self, luxel: &Luxel, point: Vec3, value: impl Fn(&Luxel) -> f32) -> f32 {
        let (mut sum, mut count) = (0.0, 0);
        for place in self.places(luxel) {
            if self.filtered && !self.open(&place) {
                continue;
            }
            count += 1;
            let v = value(&place);
            if v > 0.0 && self.sees(place.origin(point - place.position), point) {
                sum += v;
            }
        }
        sum / count.max(1) as f32
    }

    /// Whether a point is seen from another; both should lie in the open.
    pub fn sees(&self, from: Vec3, to: Vec3) -> bool {
        !crosses_solid(&self.scene.bsp_nodes, from, to) && !self.tracer.occluded(self.scene, from, to - from, REACH)
    }

    /// Whether a ray leaves through a sky surface.
    pub fn sees_sky(&self, from: Vec3, direction: Vec3) -> bool {
        self.tracer.sees_sky(self.scene, from, direction)
    }

    /// The first surface along a ray.
    pub fn closest(&self, from: Vec3, direction: Vec3) -> Option<Hit> {
        self.tracer.closest(self.scene, from, direction, f64::from(f32::MAX))
    }
}

/// Deepest tree that is walked without giving up on the exact answer.
const STACK: usize = 256;

/// Whether a segment passes through a solid leaf.
fn crosses_solid(nodes: &[BspNode], from: Vec3, to: Vec3) -> bool {
    let mut stack = [(0i32, Vec3::ZERO, Vec3::ZERO); STACK];
    stack[0] = (0, from, to);
    let mut size = 1;
    while size > 0 {
        size -= 1;
        let (mut at, a, mut b) = stack[size];
        while at >= 0 {
            let node = &nodes[at as usize];
            let normal = Vec3::from(node.normal);
            let (da, db) = (normal.dot(a) - node.dist, normal.dot(b) - node.dist);
            if da >= 0.0 && db >= 0.0 {
                at = node.children[0];
            } else if da < 0.0 && db < 0.0 {
                at = node.children[1];
            } else {
                let middle = a + (b - a) * (da / (da - db));
                let side = usize::from(da < 0.0);
                if size < STACK {
                    stack[size] = (node.children[1 - side], middle, b);
                    size += 1;
                }
                at = node.children[side];
                b = middle;
            }
        }
        if at == -1 {
            return true;
        }
    }
    false
}

/// Whether a switch stands in the compiler's command line that worldspawn records.
pub fn compiled_with(scene: &Scene, switch: &str) -> bool {
    let worldspawn = scene.entities.iter().find(|e| e.class() == "worldspawn");
    let command = worldspawn.and_then(|w| w.get("_q3map2_cmdline")).unwrap_or("");
    command.split([' ', ';', '\t']).any(|w| w.eq_ignore_ascii_case(switch))
}
