//! The lights that a map's files describe: emissive surfaces, light entities, suns and skies, in luxel units.

use super::clusters::{ClusterMap, ClusterSet, LightReach};
use super::entity_geometry::Standing;
use super::light_power::{strength_of_one, weight_sums};
use super::light_tree::LightTree;
use super::material::{MaterialSource, Visibility};
use super::records::{
    LIGHT_DOME, LIGHT_EVEN, LIGHT_LINEAR, LIGHT_NO_COSINE, LIGHT_SPHERE, LIGHT_SPOT, LIGHT_SUN, LIGHT_TRIANGLE,
    LIGHT_TWO_SIDED, Light, MATERIAL_TWO_SIDED_EMISSION, Material, NONE,
};
use super::static_geometry::{Geometry, Mesh};
use crate::assets::bsp::{Bounds, Bsp};
use crate::assets::entities::Entity;
use crate::assets::shader_script::Sun;
use glam::{Affine3A, Vec3};
use std::f32::consts::PI;
use std::ops::Range;

/// A point light of N has luxel value 7500·N·cosθ/d².
const POINT_SCALE: f32 = 7500.0;
/// Luxel value at distance 0 of a linear light of 1.
const LINEAR_SCALE: f32 = 7500.0 / 8000.0;
/// Radius of the sphere that stands for a point light, units: small beside rooms, large enough for soft shadows.
pub const POINT_RADIUS: f32 = 4.0;
/// Angular radius of a sun whose script gives none: the real one's, in radians.
pub const SUN_RADIUS: f32 = 0.2665 * PI / 180.0;
/// Brightness of a light entity without `light`.
const DEFAULT_LIGHT: f32 = 300.0;

/// Where a light came from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum LightSource {
    EmissiveTriangle,
    SkyTriangle,
    PointEntity,
    SpotEntity,
    EmissiveSprite,
    Sun,
    SkyDome,
    /// Sky that no script explains, of the same radiance everywhere.
    RecoveredSky,
    /// Found in the lightmaps, or in a lights file.
    Recovered,
}

/// All lights of a scene: the records, where each came from, and where it can act.
#[derive(Clone, Debug, Default)]
pub struct LightTable {
    pub lights: Vec<Light>,
    pub sources: Vec<LightSource>,
    pub reach: Vec<LightReach>,
    /// Tree over the lights, whose order the lights are in.
    pub tree: LightTree,
    /// Prefix sums of the lights' weights by power; one more than there are lights.
    pub weights: Vec<u32>,
    /// Strength ([`super::light_power::strength`]) that a weight of 1 stands for.
    pub strength_of_one: f32,
}

const BLANK: Light = Light {
    kind: LIGHT_TRIANGLE,
    flags: 0,
    triangle: NONE,
    material: NONE,
    p0: [0.0; 3],
    size: 0.0,
    p1: [0.0; 3],
    instance: NONE,
    p2: [0.0; 3],
    padding: 0,
    radiance: [0.0; 3],
    scale: 1.0,
};

/// The sphere that stands for a point light of a map.
pub fn point_light(centre: Vec3, photons: f32, colour: Vec3) -> Light {
    // Irradiance/π of a sphere of radiance L at distance d is L·r²/d²; it is 7500·N/(255·d²).
    let radiance = colour * (POINT_SCALE * photons / 255.0 / (POINT_RADIUS * POINT_RADIUS));
    Light {
        kind: LIGHT_SPHERE,
        p0: centre.into(),
        size: POINT_RADIUS,
        p2: [0.0, 0.0, photons / 255.0],
        radiance: radiance.into(),
        ..BLANK
    }
}

/// Everything that the collection of lights looks at.
pub struct LightInputs<'a> {
    pub bsp: &'a Bsp,
    pub entities: &'a [Entity],
    pub geometry: &'a Geometry,
    /// Where each mesh stands, `None` where no entity places it.
    pub standings: &'a [Option<Standing>],
    pub sources: &'a [MaterialSource],
    pub materials: &'a [Material],
    pub clusters: &'a ClusterMap,
}

impl LightInputs<'_> {
    /// The map's own meshes, with their numbers: models of items light nothing.
    fn map_meshes(&self) -> impl Iterator<Item = (usize, &Mesh)> {
        let own = self.bsp.models.len();
        let meshes = self.geometry.meshes.iter().enumerate();
        meshes.filter(move |(i, _)| self.geometry.dynamic.carrier(*i) < own)
    }
}

impl LightTable {
    /// Appends a light.
    pub fn push(&mut self, source: LightSource, light: Light, reach: LightReach) {
        self.lights.push(light);
        self.sources.push(source);
        self.reach.push(reach);
    }

    /// Light that each of `count` triangles is, or [`NONE`].
    pub fn of_triangles(&self, count: usize) -> Vec<u32> {
        let mut out = vec![NONE; count];
        for (i, light) in self.lights.iter().enumerate() {
            if light.kind == LIGHT_TRIANGLE && light.triangle != NONE {
                out[light.triangle as usize] = i as u32;
            }
        }
        out
    }

    /// Number of lights by source.
    pub fn count(&self, source: LightSource) -> usize {
        self.sources.iter().filter(|s| **s == source).count()
    }

    /// Collects the lights: surfaces, entities, suns and domes, in the order of the tree over them.
    pub fn collect(inputs: &LightInputs) -> Self {
        let mut table = Self::default();
        for (index, mesh) in inputs.map_meshes() {
            let Some(standing) = &inputs.standings[index] else {
                continue;
            };
            let range = mesh.first_triangle..mesh.first_triangle + mesh.triangle_count;
            table.add_triangles(inputs, range, standing, inputs.geometry.dynamic.carrier(index) != 0);
        }
        let rest = inputs.geometry.untraced.clone();
        let world = Standing {
            pose: Affine3A::IDENTITY,
            mover: None,
        };
        table.add_triangles(inputs, rest, &world, false);
        for entity in inputs.entities.iter().filter(|e| is_light(e)) {
            table.add_entity(inputs, entity);
        }
        table.add_skies(inputs);
        table.put_in_order();
        table
    }

    /// Adds the same radiance behind every sky surface.
    pub fn add_even_sky(&mut self, inputs: &LightInputs, radiance: Vec3) {
        for_sky_triangles(inputs, |corners, surface, moves| {
            let dome = Dome {
                source: LightSource::RecoveredSky,
                radiance,
                flags: LIGHT_TWO_SIDED | LIGHT_EVEN,
            };
            self.add_dome(inputs, &dome, corners, surface, moves);
        });
    }

    /// Leaves out the lights that are not wanted, and multiplies what the others give by a factor.
    pub fn scaled(&self, scale: impl Fn(usize) -> f32) -> Self {
        let mut out = Self::default();
        for i in 0..self.lights.len() {
            let s = scale(i);
            if s > 0.0 {
                let mut light = self.lights[i];
                light.radiance = light.radiance.map(|r| r * s);
                light.scale *= s;
                out.push(self.sources[i], light, self.reach[i].clone());
            }
        }
        out
    }

    /// Builds the tree and the weights, and brings the lights into the tree's order.
    pub fn put_in_order(&mut self) {
        let sweeps: Vec<_> = self.reach.iter().map(|r| r.sweep.as_deref()).collect();
        let (tree, order) = LightTree::build(&self.lights, &sweeps);
        self.lights = order.iter().map(|&i| self.lights[i as usize]).collect();
        self.sources = order.iter().map(|&i| self.sources[i as usize]).collect();
        self.reach = order.iter().map(|&i| self.reach[i as usize].clone()).collect();
        self.weights = weight_sums(&self.lights);
        self.strength_of_one = strength_of_one(&self.lights);
        self.tree = tree;
    }

    fn add_triangles(&mut self, inputs: &LightInputs, range: Range<u32>, standing: &Standing, of_entity: bool) {
        let placement = standing.pose;
        let instance = standing.mover.as_ref().map_or(NONE, |(number, _)| *number);
        let sweep = standing.mover.as_ref().map(|(_, poses)| poses.clone());
        let mut sprite_done = u32::MAX;
        for index in range.clone() {
            let triangle = inputs.geometry.triangles[index as usize];
            let material = &inputs.materials[triangle.material as usize];
            let source = &inputs.sources[triangle.material as usize];
            let Some(_) = source.surface_light() else { continue };
            if source.autosprite {
                if sprite_done != triangle.surface {
                    sprite_done = triangle.surface;
                    self.add_sprite(inputs, triangle.surface, range.clone(), standing);
                }
                continue;
            }
            let [a, b, c] = inputs.geometry.corners(index).map(|p| placement.transform_point3(p));
            let cross = (b - a).cross(c - a);
            let area = cross.length() * 0.5;
            if !(area > 0.0 && area.is_finite()) {
                continue;
            }
            let sky = source.visibility == Visibility::Sky;
            let two_sided = material.flags & MATERIAL_TWO_SIDED_EMISSION != 0 && !sky;
            let normal = cross / (2.0 * area);
            let clusters = match &sweep {
                Some(poses) => inputs
                    .clusters
                    .in_box(inputs.bsp, swept_bounds(&[a, b, c], poses).grown(1.0)),
                None => clusters_of_triangle(inputs, [a, b, c], triangle.surface, of_entity),
            };
            let clusters = Some(clusters).filter(|set| !set.is_empty());
            let front = !two_sided && sweep.is_none();
            self.push(
                if sky {
                    LightSource::SkyTriangle
                } else {
                    LightSource::EmissiveTriangle
                },
                Light {
                    flags: if two_sided { LIGHT_TWO_SIDED } else { 0 },
                    triangle: index,
                    material: triangle.material,
                    p0: a.into(),
                    size: area,
                    p1: (b - a).into(),
                    instance,
                    p2: (c - a).into(),
                    radiance: material.emission,
                    ..BLANK
                },
                LightReach {
                    clusters,
                    front: front.then(|| (normal, normal.dot(a))),
                    sweep: sweep.clone(),
                },
            );
        }
    }

    /// An emissive sprite is a point light at the middle of its surface.
    fn add_sprite(&mut self, inputs: &LightInputs, surface: u32, range: Range<u32>, standing: &Standing) {
        let mut bounds = Bounds::EMPTY;
        let mut material = 0;
        for index in range {
            let triangle = inputs.geometry.triangles[index as usize];
            if triangle.surface == surface {
                material = triangle.material;
                inputs
                    .geometry
                    .corners(index)
                    .into_iter()
                    .for_each(|p| bounds.include(p));
            }
        }
        let source = &inputs.sources[material as usize];
        let Some(value) = source.surface_light() else { return };
        let centre = standing.pose.transform_point3(bounds.centre());
        let colour = source.emission_colour();
        let mover = standing.mover.as_ref();
        self.add_sphere(inputs, LightSource::EmissiveSprite, centre, value, colour, |light| {
            light.instance = mover.map_or(NONE, |(number, _)| *number);
        });
        if let (Some((_, poses)), Some(reach)) = (mover, self.reach.last_mut()) {
            let around = swept_bounds(&[centre], poses).grown(POINT_RADIUS);
            let clusters = inputs.clusters.in_box(inputs.bsp, around);
            reach.clusters = Some(clusters).filter(|set| !set.is_empty());
            reach.sweep = Some(poses.clone());
        }
    }

    fn add_sphere(
        &mut self,
        inputs: &LightInputs,
        source: LightSource,
        centre: Vec3,
        photons: f32,
        colour: Vec3,
        shape: impl FnOnce(&mut Light),
    ) {
        let mut light = point_light(centre, photons, colour);
        shape(&mut light);
        if light.flags & LIGHT_LINEAR != 0 {
            light.radiance = colour.into();
            light.p2[2] = photons * LINEAR_SCALE / 255.0;
        }
        let around = Bounds {
            min: centre - POINT_RADIUS,
            max: centre + POINT_RADIUS,
        };
        let clusters = inputs
            .bsp
            .cluster_at(centre)
            .map(|_| inputs.clusters.in_box(inputs.bsp, around));
        self.push(source, light, LightReach::still(clusters, None));
    }

    fn add_entity(&mut self, inputs: &LightInputs, entity: &Entity) {
        let photons = entity
            .number("_light")
            .or(entity.number("light"))
            .filter(|&n| n != 0.0)
            .unwrap_or(DEFAULT_LIGHT)
            * entity.number("scale").filter(|&s| s != 0.0).unwrap_or(1.0);
        let raw = entity.vector("_color").unwrap_or(Vec3::ONE);
        let flags = entity.spawnflags();
        let colour = if flags & 32 != 0 {
            raw
        } else {
            super::emission::max_one(raw)
        };
        let target = entity
            .get("target")
            .and_then(|name| inputs.entities.iter().find(|e| e.get("targetname") == Some(name)));
        let origin = entity.origin();
        if let Some(target) = target
            && entity.number("_sun").is_some_and(|s| s != 0.0)
        {
            let samples = entity.number("_samples").unwrap_or(1.0).max(1.0);
            let sun = SunLight {
                direction: (origin - target.origin()).normalize_or(Vec3::Z),
                radius: entity.number("_deviance").unwrap_or(0.0).to_radians(),
                irradiance: colour * (photons / 255.0 / samples),
            };
            self.add_sun(&sun, sky_openings(inputs).as_ref());
            return;
        }
        let spot = target.map(|t| t.origin() - origin).filter(|d| *d != Vec3::ZERO);
        let source = if spot.is_some() {
            LightSource::SpotEntity
        } else {
            LightSource::PointEntity
        };
        self.add_sphere(inputs, source, origin, photons, colour, |light| {
            if let Some(axis) = spot {
                let radius = entity.number("radius").filter(|&r| r != 0.0).unwrap_or(64.0);
                light.flags |= LIGHT_SPOT;
                light.p1 = axis.normalize().into();
                light.p2[0] = (radius + 16.0) / axis.length();
            } else if flags & 1 != 0 {
                light.flags |= LIGHT_LINEAR | LIGHT_NO_COSINE;
                light.p2[1] = entity.number("fade").filter(|&f| f != 0.0).unwrap_or(1.0) / 255.0;
            }
            if flags & 2 != 0 {
                light.flags |= LIGHT_NO_COSINE;
            }
        });
    }

    /// `openings`: clusters of all sky surfaces, through which alone a sun shines.
    fn add_sun(&mut self, sun: &SunLight, openings: Option<&ClusterSet>) {
        let d = sun.direction;
        self.push(
            LightSource::Sun,
            Light {
                kind: LIGHT_SUN,
                p0: d.into(),
                p1: [d.y.atan2(d.x), d.z.clamp(-1.0, 1.0).asin(), sun.radius.max(SUN_RADIUS)],
                radiance: sun.irradiance.into(),
                ..BLANK
            },
            LightReach::still(openings.cloned(), None),
        );
    }

    /// Suns and domes of every sky material that some surface uses.
    fn add_skies(&mut self, inputs: &LightInputs) {
        let mut used = vec![false; inputs.sources.len()];
        for s in &inputs.bsp.surfaces {
            used[s.shader as usize] = true;
        }
        let worldspawn = inputs.entities.iter().find(|e| e.class() == "worldspawn");
        let no_shader_sun = worldspawn
            .and_then(|w| w.number("_noshadersun"))
            .is_some_and(|n| n != 0.0);
        let openings = sky_openings(inputs);
        let mut suns: Vec<Sun> = Vec::new();
        for (source, _) in inputs.sources.iter().zip(&used).filter(|(_, used)| **used) {
            for sun in source.suns.iter().filter(|_| !no_shader_sun) {
                // The same sky under two names (a cloned shader) is one sun.
                if suns.contains(sun) {
                    continue;
                }
                suns.push(*sun);
                let light = SunLight {
                    direction: sun.direction(),
                    radius: sun.deviance_degrees.to_radians(),
                    irradiance: sun.color.normalize_or_zero() * (sun.intensity / 255.0),
                };
                self.add_sun(&light, openings.as_ref());
            }
            if let Some(value) = source.sky_light {
                let radiance = source.emission_colour() * (value / 255.0);
                let dome = Dome {
                    source: LightSource::SkyDome,
                    radiance,
                    flags: LIGHT_TWO_SIDED,
                };
                for_sky_triangles(inputs, |corners, surface, moves| {
                    self.add_dome(inputs, &dome, corners, surface, moves);
                });
            }
        }
    }

    /// The part of a dome that is seen through a sky triangle, whose sides are both windows.
    fn add_dome(&mut self, inputs: &LightInputs, dome: &Dome, [a, b, c]: [Vec3; 3], surface: u32, moves: bool) {
        let area = (b - a).cross(c - a).length() * 0.5;
        if !(area > 0.0 && area.is_finite()) {
            return;
        }
        let clusters = clusters_of_triangle(inputs, [a, b, c], surface, moves);
        self.push(
            dome.source,
            Light {
                kind: LIGHT_DOME,
                flags: dome.flags,
                p0: a.into(),
                size: area,
                p1: (b - a).into(),
                p2: (c - a).into(),
                radiance: dome.radiance.into(),
                ..BLANK
            },
            LightReach::still(Some(clusters).filter(|set| !set.is_empty()), None),
        );
    }
}

/// What is behind sky surfaces.
struct Dome {
    source: LightSource,
    radiance: Vec3,
    flags: u32,
}

/// Bounds of points in all poses of a sweep, and of what lies between these.
fn swept_bounds(points: &[Vec3], poses: &[Affine3A]) -> Bounds {
    let mut bounds = Bounds::EMPTY;
    for pose in poses {
        points.iter().for_each(|p| bounds.include(pose.transform_point3(*p)));
    }
    bounds.grown((bounds.max - bounds.min).max_element() * 0.01)
}

/// Clusters that a placed triangle touches; of a mover, those around it.
fn clusters_of_triangle(inputs: &LightInputs, corners: [Vec3; 3], surface: u32, moves: bool) -> ClusterSet {
    if moves {
        let mut bounds = Bounds::EMPTY;
        corners.into_iter().for_each(|p| bounds.include(p));
        return inputs.clusters.in_box(inputs.bsp, bounds.grown(1.0));
    }
    // Leafs do not list every surface that lies in them (slimefac's teleporters are listed far from where they stand),
    // and list some for their neighbours' sake: both count.
    let mut set = inputs.clusters.at_triangle(inputs.bsp, corners);
    set.unite(&inputs.clusters.of_surface[surface as usize]);
    set
}

/// Calls with the corners, surface and whether it may move of every traced triangle of a sky.
fn for_sky_triangles(inputs: &LightInputs, mut found: impl FnMut([Vec3; 3], u32, bool)) {
    for (index, mesh) in inputs.map_meshes() {
        let Some(Standing { pose, .. }) = &inputs.standings[index] else {
            continue;
        };
        for t in mesh.first_triangle..mesh.first_triangle + mesh.triangle_count {
            let triangle = inputs.geometry.triangles[t as usize];
            if inputs.sources[triangle.material as usize].visibility == Visibility::Sky {
                let corners = inputs.geometry.corners(t).map(|p| pose.transform_point3(p));
                found(corners, triangle.surface, inputs.geometry.dynamic.carrier(index) != 0);
            }
        }
    }
}

/// Clusters of all sky surfaces; `None` where some sky surface lies in no cluster.
fn sky_openings(inputs: &LightInputs) -> Option<ClusterSet> {
    let mut all = Some(ClusterSet::new(inputs.clusters.count));
    for_sky_triangles(inputs, |corners, surface, moves| {
        let set = clusters_of_triangle(inputs, corners, surface, moves);
        match &mut all {
            Some(all) if !set.is_empty() => all.unite(&set),
            _ => all = None,
        }
    });
    all
}

struct SunLight {
    direction: Vec3,
    /// Angular radius, radians.
    radius: f32,
    /// Irradiance/π at normal incidence.
    irradiance: Vec3,
}

fn is_light(entity: &Entity) -> bool {
    // `lightJunior` lights the grid only; other classes that merely begin with "light" do not exist in the game.
    let class = entity.class();
    class.eq_ignore_ascii_case("light") || class.eq_ignore_ascii_case("_light")
}
