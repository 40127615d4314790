//! What stops a moving box: the brushes and curved surfaces of a map, and brush models where they stand.

pub mod brush;
pub mod facet;

use crate::assets::bsp::lumps::{SURFACE_PATCH, content_flags};
use crate::assets::bsp::patch::tessellate;
use crate::assets::bsp::{Bounds, Bsp};
use brush::{Brush, Meeting, Side, Sweep};
use facet::Facet;
use glam::{Affine3A, DVec3, Vec3};

/// Contents that stop a player.
pub const PLAYER_SOLID: i32 = content_flags::SOLID | content_flags::PLAYERCLIP | content_flags::BODY;
/// How far curved surfaces may be from the triangles that stand for them, units.
const CURVATURE: f32 = 1.0;

/// Where a sweep meets something.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Impact {
    /// Share of the way.
    pub fraction: f64,
    /// Unit length, away from what was met.
    pub normal: DVec3,
    pub surface_flags: i32,
    pub contents: i32,
}

/// What became of a sweep.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Trace {
    /// Share of the way that is free.
    pub fraction: f32,
    /// Where the box's origin ends.
    pub end: Vec3,
    /// Normal of what stopped it; zero where nothing did.
    pub normal: Vec3,
    pub surface_flags: i32,
    pub contents: i32,
    /// Brush model that stopped it; 0: the world.
    pub model: Option<usize>,
    /// It began in something solid.
    pub start_solid: bool,
    /// It never left it.
    pub all_solid: bool,
}

/// A box around an origin.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Extent {
    pub mins: Vec3,
    pub maxs: Vec3,
}

impl Extent {
    /// A point.
    pub const POINT: Self = Self {
        mins: Vec3::ZERO,
        maxs: Vec3::ZERO,
    };
}

/// A brush model somewhere.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Placed {
    pub model: usize,
    /// Model to world, rigid.
    pub pose: Affine3A,
}

/// Brushes and facets of one model.
#[derive(Clone, Debug, Default)]
struct Model {
    brushes: std::ops::Range<usize>,
    facets: std::ops::Range<usize>,
    bounds: Option<Bounds>,
}

/// Everything of a map that stops things.
pub struct CollisionWorld {
    brushes: Vec<Brush>,
    facets: Vec<Facet>,
    models: Vec<Model>,
    /// Brushes and facets of each leaf.
    leafs: Vec<(Vec<u32>, Vec<u32>)>,
    bsp: Tree,
}

/// The map's tree, to find leafs in.
struct Tree(Bsp);

impl CollisionWorld {
    /// Takes what stops things from a map.
    pub fn new(bsp: &Bsp) -> Self {
        let flags = |shader: i32| {
            let shader = bsp.shaders.get(shader as usize);
            shader.map_or((0, 0), |s| (s.content_flags, s.surface_flags))
        };
        let brushes = bsp
            .brushes
            .iter()
            .map(|b| {
                let sides = b.first_side.max(0) as usize..(b.first_side.max(0) + b.side_count.max(0)) as usize;
                let side = |s: &crate::assets::bsp::lumps::BrushSide| {
                    let plane = &bsp.planes[s.plane as usize];
                    Side {
                        normal: Vec3::from(plane.normal).as_dvec3(),
                        dist: f64::from(plane.dist),
                        surface_flags: flags(s.shader).1,
                    }
                };
                Brush {
                    contents: flags(b.shader).0,
                    sides: bsp
                        .brush_sides
                        .get(sides)
                        .unwrap_or_default()
                        .iter()
                        .map(side)
                        .collect(),
                }
            })
            .collect();
        let mut facets = Vec::new();
        let mut facets_of_surface = Vec::with_capacity(bsp.surfaces.len());
        for s in &bsp.surfaces {
            let first = facets.len();
            let (contents, surface_flags) = flags(s.shader);
            if s.kind == SURFACE_PATCH && contents & PLAYER_SOLID != 0 {
                let own = &bsp.vertices[s.first_vertex as usize..(s.first_vertex + s.vertex_count) as usize];
                let mesh = tessellate(own, s.patch_width as usize, s.patch_height as usize, CURVATURE);
                for t in mesh.indices.chunks_exact(3) {
                    let corners = [t[0], t[1], t[2]].map(|i| mesh.vertices[i as usize].position.as_dvec3());
                    let cross = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
                    if cross.length_squared() > 1e-6 {
                        facets.push(Facet {
                            corners,
                            contents,
                            surface_flags,
                        });
                    }
                }
            }
            facets_of_surface.push(first as u32..facets.len() as u32);
        }
        let models = bsp.models.iter().map(|m| {
            let surfaces = m.first_surface.max(0) as usize..(m.first_surface.max(0) + m.surface_count.max(0)) as usize;
            let own = facets_of_surface.get(surfaces).unwrap_or_default();
            let bounds = Bounds {
                min: m.mins.into(),
                max: m.maxs.into(),
            };
            Model {
                brushes: m.first_brush.max(0) as usize..(m.first_brush.max(0) + m.brush_count.max(0)) as usize,
                facets: own.first().map_or(0, |r| r.start as usize)..own.last().map_or(0, |r| r.end as usize),
                bounds: (bounds.min.cmple(bounds.max).all()).then_some(bounds),
            }
        });
        let leafs = bsp.leafs.iter().map(|l| {
            let range = |first: i32, count: i32| first.max(0) as usize..(first.max(0) + count.max(0)) as usize;
            let own = bsp.leaf_brushes.get(range(l.first_leaf_brush, l.leaf_brush_count));
            let brushes = own.unwrap_or_default().iter();
            (brushes.map(|b| *b as u32).collect(), Vec::new())
        });
        let models: Vec<Model> = models.collect();
        let mut leafs: Vec<(Vec<u32>, Vec<u32>)> = leafs.collect();
        // The file's leafs do not list every surface that reaches into them.
        for f in models.first().map_or(0..0, |m| m.facets.clone()) {
            let (min, max) = facets[f].bounds();
            let around = Bounds {
                min: min.as_vec3(),
                max: max.as_vec3(),
            };
            bsp.leafs_in_box(around, |leaf| leafs[leaf].1.push(f as u32));
        }
        Self {
            models,
            leafs,
            brushes,
            facets,
            bsp: Tree(Bsp {
                nodes: bsp.nodes.clone(),
                planes: bsp.planes.clone(),
                leafs: bsp.leafs.clone(),
                ..Bsp::default()
            }),
        }
    }

    /// Moves a box from `start` to `end` through the world and `placed` brush models, until it meets something of `mask`.
    pub fn sweep(&self, extent: Extent, start: Vec3, end: Vec3, mask: i32, placed: &[Placed]) -> Trace {
        let middle = ((extent.mins + extent.maxs) * 0.5).as_dvec3();
        let half = ((extent.maxs - extent.mins) * 0.5).as_dvec3();
        let sweep = Sweep {
            start: start.as_dvec3() + middle,
            end: end.as_dvec3() + middle,
            half,
        };
        let mut found = Found::default();
        let (low, high) = sweep.bounds();
        let (mut brushes, mut facets) = (Vec::new(), Vec::new());
        let around = Bounds {
            min: low.as_vec3() - 1.0,
            max: high.as_vec3() + 1.0,
        };
        self.bsp.0.leafs_in_box(around, |leaf| {
            brushes.extend_from_slice(&self.leafs[leaf].0);
            facets.extend_from_slice(&self.leafs[leaf].1);
        });
        // Leafs share what they hold.
        brushes.sort_unstable();
        brushes.dedup();
        facets.sort_unstable();
        facets.dedup();
        for b in brushes {
            found.brush(&self.brushes[b as usize], &sweep, mask, 0);
        }
        for f in facets {
            found.facet(&self.facets[f as usize], &sweep, mask, 0);
        }
        for p in placed {
            let model = self.models.get(p.model).filter(|m| m.bounds.is_some());
            let Some(model) = model.filter(|_| p.pose.is_finite()) else {
                continue;
            };
            let back = p.pose.inverse();
            let local = |v: DVec3| back.transform_point3(v.as_vec3()).as_dvec3();
            let own = Sweep {
                start: local(sweep.start),
                end: local(sweep.end),
                half,
            };
            let mut of_model = Found::default();
            for b in self.brushes_of(model) {
                of_model.brush(b, &own, mask, p.model);
            }
            for f in &self.facets[model.facets.clone()] {
                of_model.facet(f, &own, mask, p.model);
            }
            if let Some((impact, _)) = &mut of_model.first {
                impact.normal = p.pose.transform_vector3(impact.normal.as_vec3()).as_dvec3();
            }
            found.join(of_model);
        }
        found.trace(start, end)
    }

    /// Contents at a point: of the world and of `placed` brush models.
    pub fn contents(&self, point: Vec3, placed: &[Placed]) -> i32 {
        let at = point.as_dvec3();
        let of = |brushes: &mut dyn Iterator<Item = &Brush>, at: DVec3| {
            brushes.filter(|b| b.holds(at)).fold(0, |all, b| all | b.contents)
        };
        let leaf = self.bsp.0.leaf_at(point);
        let own = leaf.map_or(&[][..], |l| &self.leafs[l].0[..]);
        let world = of(&mut own.iter().map(|b| &self.brushes[*b as usize]), at);
        placed.iter().fold(world, |all, p| {
            let Some(model) = self.models.get(p.model) else {
                return all;
            };
            let at = p.pose.inverse().transform_point3(point).as_dvec3();
            all | of(&mut self.brushes_of(model).iter(), at)
        })
    }

    fn brushes_of(&self, model: &Model) -> &[Brush] {
        self.brushes.get(model.brushes.clone()).unwrap_or_default()
    }

    /// Whether a box at `origin` touches a brush of a model whose contents are of `mask`.
    pub fn touches(&self, extent: Extent, origin: Vec3, mask: i32, placed: &Placed) -> bool {
        let Some(model) = self.models.get(placed.model) else {
            return false;
        };
        let back = placed.pose.inverse();
        let middle = back
            .transform_point3(origin + (extent.mins + extent.maxs) * 0.5)
            .as_dvec3();
        let half = ((extent.maxs - extent.mins) * 0.5).as_dvec3();
        let meets = |b: &Brush| {
            let reaches = |s: &Side| s.normal.dot(middle) <= s.dist + s.normal.abs().dot(half);
            b.contents & mask != 0 && !b.sides.is_empty() && b.sides.iter().all(reaches)
        };
        self.brushes_of(model).iter().any(meets)
    }

    /// Bounds of a brush model, in its own space.
    pub fn bounds(&self, model: usize) -> Option<Bounds> {
        self.models.get(model)?.bounds
    }

    /// The same as [`Self::sweep`] against everything, without the map's tree: what the tree is tested against.
    pub fn sweep_all(&self, extent: Extent, start: Vec3, end: Vec3, mask: i32) -> Trace {
        let middle = ((extent.mins + extent.maxs) * 0.5).as_dvec3();
        let sweep = Sweep {
            start: start.as_dvec3() + middle,
            end: end.as_dvec3() + middle,
            half: ((extent.maxs - extent.mins) * 0.5).as_dvec3(),
        };
        let mut found = Found::default();
        let Some(world) = self.models.first() else {
            return found.trace(start, end);
        };
        for b in self.brushes_of(world) {
            found.brush(b, &sweep, mask, 0);
        }
        for f in &self.facets[world.facets.clone()] {
            found.facet(f, &sweep, mask, 0);
        }
        found.trace(start, end)
    }
}

/// The first of all impacts, and whether the way began inside something.
#[derive(Clone, Copy, Debug, Default)]
struct Found {
    first: Option<(Impact, usize)>,
    start_solid: bool,
    all_solid: bool,
}

impl Found {
    fn brush(&mut self, brush: &Brush, sweep: &Sweep, mask: i32, model: usize) {
        if brush.contents & mask == 0 {
            return;
        }
        match brush.meet(sweep) {
            Meeting::Apart => {}
            Meeting::Inside { to_the_end } => {
                self.start_solid = true;
                self.all_solid |= to_the_end;
            }
            Meeting::At(impact) => self.impact(impact, model),
        }
    }

    fn facet(&mut self, facet: &Facet, sweep: &Sweep, mask: i32, model: usize) {
        if facet.contents & mask == 0 {
            return;
        }
        let (low, high) = sweep.bounds();
        let (min, max) = facet.bounds();
        let near = min.cmple(high + brush::GAP).all() && max.cmpge(low - brush::GAP).all();
        if let Some(impact) = near.then(|| facet.meet(sweep)).flatten() {
            self.impact(impact, model);
        }
    }

    fn impact(&mut self, impact: Impact, model: usize) {
        if self.first.is_none_or(|(f, _)| impact.fraction < f.fraction) {
            self.first = Some((impact, model));
        }
    }

    fn join(&mut self, other: Self) {
        self.start_solid |= other.start_solid;
        self.all_solid |= other.all_solid;
        if let Some((impact, model)) = other.first {
            self.impact(impact, model);
        }
    }

    fn trace(&self, start: Vec3, end: Vec3) -> Trace {
        let stopped = self.first.filter(|_| !self.all_solid);
        let fraction = match stopped {
            _ if self.all_solid => 0.0,
            Some((impact, _)) => impact.fraction.min(1.0),
            None => 1.0,
        };
        Trace {
            fraction: fraction as f32,
            end: if fraction >= 1.0 {
                end
            } else {
                start.as_dvec3().lerp(end.as_dvec3(), fraction).as_vec3()
            },
            normal: stopped.map_or(Vec3::ZERO, |(i, _)| i.normal.as_vec3()),
            surface_flags: stopped.map_or(0, |(i, _)| i.surface_flags),
            contents: stopped.map_or(0, |(i, _)| i.contents),
            model: stopped.map(|(_, m)| m),
            start_solid: self.start_solid,
            all_solid: self.all_solid,
        }
    }
}
