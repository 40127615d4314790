//! Why a pixel differs between backends: each of its samples is looked at alone, and the CPU's answer is asked for again
//! with rays and receivers moved by as much as single precision may move them.

use glam::Vec3;
use q3rays::reference::CpuRenderer;
use q3rays::reference::branches::Path;
use q3rays::reference::direct::{RayCounts, SampleAddress, Taken, direct_light, point_sampling, taken_sample};
use q3rays::reference::layers::{self, Branches, see};
use q3rays::reference::light_sample::{Target, sample_light};
use q3rays::reference::surface::{SurfaceHit, classify, offset_point};
use q3rays::render::settings::Settings;
use q3rays::scene::camera::Camera;
use q3rays::scene::records::NONE;
use std::collections::BTreeMap;

/// What a sample that differs was.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Class {
    /// The rays met different triangles at the same distance: coincident surfaces, such as decals.
    Coplanar,
    /// The rays met different triangles, and a ray beside the CPU's meets the other one: an edge.
    Silhouette,
    /// The same surface, and a receiver beside the CPU's belongs to another row of lights.
    ClusterBoundary,
    /// The same surface, and a receiver beside the CPU's is shadowed otherwise: the edge of a shadow, or contact.
    ShadowEdge,
    /// The same surface, and a shadow ray that ends beside the light's sample is blocked otherwise: the light touches
    /// what blocks it.
    LightContact,
    /// A random number beside the one that chose a light chooses another.
    LightChoice,
    /// A point beside the light's sample emits otherwise: the edge of a texel of a lamp's or lava's picture.
    LightTexel,
    /// None of these: a bug.
    Unexplained,
}

/// One sample of a pixel as a device saw it.
#[derive(Clone, Copy, Debug)]
pub struct Seen {
    pub triangle: u32,
    pub radiance: Vec3,
}

/// What is compared: the scene's CPU tracer and a view.
pub struct Context<'a> {
    pub cpu: &'a CpuRenderer<'a>,
    pub camera: Camera,
    pub size: (u32, u32),
    pub settings: Settings,
    /// Mean of the image, the scale of what counts as equal.
    pub mean: f32,
}

/// How far single precision may move a receiver, in units of its largest coordinate.
const RECEIVER: f32 = 4e-6;
/// How far it may turn a ray, radians.
const RAY: f32 = 2e-6;

/// How far it may move a point on a light, as a share of the light.
const LIGHT_POINT: f32 = 5e-5;

fn around() -> impl Iterator<Item = Vec3> {
    (0..27).map(|i| Vec3::new((i % 3) as f32, (i / 3 % 3) as f32, (i / 9) as f32) - 1.0)
}

impl Context<'_> {
    /// Whether two values are the same by the rule for images.
    pub fn same(&self, a: Vec3, b: Vec3) -> bool {
        (0..3).all(|c| (a[c] - b[c]).abs() <= 1e-3 * b[c].abs() + 1e-4 * self.mean)
    }

    fn radiance(&self, at: &SurfaceHit, seen: &layers::Seen, address: SampleAddress) -> Vec3 {
        let cpu = self.cpu;
        let light = direct_light(
            cpu.scene,
            &cpu.tracer,
            &self.settings,
            at,
            address,
            &mut RayCounts::default(),
        );
        seen.share * (at.albedo * light + seen.emission) + seen.layers
    }

    /// Class of one sample of a pixel; `None` where both are the same.
    pub fn class(&self, pixel: usize, index: u32, seen: Seen) -> Option<Class> {
        let (cpu, scene) = (self.cpu, self.cpu.scene);
        let (x, y) = (pixel as u32 % self.size.0, pixel as u32 / self.size.0);
        let address = SampleAddress {
            pixel: x + (y << 16),
            index,
        };
        let view = cpu.view(&self.camera, self.size, &self.settings);
        let ray = view.sample(&self.settings, x, y, address);
        let path = Path::from_eye(ray, address);
        let nothing_branches = &mut Branches::default();
        let own_seen = see(
            scene,
            &cpu.tracer,
            &self.settings,
            &path,
            view.pixel_width,
            nothing_branches,
        );
        let hit = own_seen.surface.map(|(_, hit)| hit);
        let triangle = hit.map_or(NONE, |h| h.triangle);
        let surface = own_seen.surface.map(|(surface, _)| surface);
        let own = surface.map_or(own_seen.layers, |s| self.radiance(&s, &own_seen, address));
        if self.same(seen.radiance, own) {
            return None;
        }
        let Some(surface) = surface.filter(|_| triangle == seen.triangle) else {
            return Some(self.tie(seen.triangle, ray.origin, ray.direction, hit.map(|h| h.t)));
        };
        let fallback = scene.geometry.triangles[triangle as usize].fallback_row;
        let step = RECEIVER * surface.position.abs().max_element().max(256.0);
        for offset in around() {
            let position = surface.position + offset * step;
            let (cluster, row) = classify(scene, position, surface.geometric_normal, fallback);
            let moved = SurfaceHit {
                position,
                cluster,
                row,
                ..surface
            };
            if self.same(seen.radiance, self.radiance(&moved, &own_seen, address)) {
                return Some(if row == surface.row {
                    Class::ShadowEdge
                } else {
                    Class::ClusterBoundary
                });
            }
        }
        Some(if self.contact(&surface, address) {
            Class::LightContact
        } else if self.choice_tie(&surface, address) {
            Class::LightChoice
        } else if self.texel(&surface, address, seen.radiance / own) {
            Class::LightTexel
        } else {
            Class::Unexplained
        })
    }

    /// The i-th light sample that is taken for a receiver, with the numbers that choose moved by as many steps of a float.
    fn taken(&self, at: &SurfaceHit, address: SampleAddress, i: u32, steps: i32) -> Option<Taken> {
        taken_sample(self.cpu.scene, &self.cpu.tracer, &self.settings, at, address, i, steps)
    }

    fn choice_tie(&self, at: &SurfaceHit, address: SampleAddress) -> bool {
        (0..self.settings.random_lights).any(|i| {
            let chosen = |steps| self.taken(at, address, i, steps).map(|t| (t.light, t.u));
            (-8..=8).any(|steps| chosen(steps) != chosen(0))
        })
    }

    /// Whether moving the end of one of the random lights' shadow rays changes what it meets.
    fn contact(&self, at: &SurfaceHit, address: SampleAddress) -> bool {
        let (scene, settings) = (self.cpu.scene, &self.settings);
        let origin = offset_point(at.position, at.geometric_normal);
        (0..settings.random_lights).any(|i| {
            let sample = self.taken(at, address, i, 0).and_then(|t| t.sample);
            let Some(Target::Point(end)) = sample.map(|s| s.target) else {
                return false;
            };
            let blocked = |end: Vec3| self.cpu.tracer.occluded(scene, origin, end - origin, 1.0);
            let step = RECEIVER * end.abs().max_element().max(256.0);
            around().any(|offset| blocked(end + offset * step) != blocked(end))
        })
    }

    /// Whether points on the light as near to its sample as single precision tells them apart emit in such ratios to it.
    fn texel(&self, at: &SurfaceHit, address: SampleAddress, ratio: Vec3) -> bool {
        let (scene, settings) = (self.cpu.scene, &self.settings);
        (0..settings.random_lights).any(|i| {
            let Some(Taken { light, u, .. }) = self.taken(at, address, i, 0) else {
                return false;
            };
            let light = &scene.lights.lights[light as usize];
            let value = |offset: Vec3| {
                let u = [u[0] + offset.x * LIGHT_POINT, u[1] + offset.y * LIGHT_POINT].map(|u| u.clamp(0.0, 1.0));
                sample_light(scene, light, at, u, point_sampling(settings)).map_or(Vec3::ZERO, |s| s.value)
            };
            let (low, high) = around()
                .map(value)
                .fold((Vec3::INFINITY, Vec3::ZERO), |(l, h), v| (l.min(v), h.max(v)));
            let own = value(Vec3::ZERO);
            (0..3).all(|c| {
                let seen = if ratio[c].is_finite() {
                    ratio[c] * own[c]
                } else {
                    own[c]
                };
                seen >= low[c] * 0.9998 && seen <= high[c] * 1.0002
            })
        })
    }

    /// Class of rays that met different triangles.
    fn tie(&self, other: u32, origin: Vec3, direction: Vec3, t: Option<f64>) -> Class {
        let scene = self.cpu.scene;
        if let Some(t) = t.filter(|_| other != NONE) {
            let [a, b, c] = scene.geometry.corners(other).map(Vec3::as_dvec3);
            let normal = (b - a).cross(c - a).normalize();
            let at = origin.as_dvec3() + direction.as_dvec3() * t;
            if normal.dot(at - a).abs() < 1e-5 * at.abs().max_element().max(256.0) {
                return Class::Coplanar;
            }
        }
        let beside = around().any(|offset| {
            let hit = self
                .cpu
                .tracer
                .closest(scene, origin, direction + offset * RAY, f64::from(f32::MAX));
            hit.map_or(NONE, |h| h.triangle) == other
        });
        if beside { Class::Silhouette } else { Class::Unexplained }
    }
}

/// Samples by class.
pub type Tally = BTreeMap<Class, usize>;
