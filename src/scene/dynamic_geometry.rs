//! Surfaces whose vertices move (`deformVertexes`), of the world (the thesis's dynamic world with dynamic data), of brush models and
//! of MD3 models.
//!
//! Deformations are bounded. The tree over such triangles is built once over boxes that hold them at all times, so that it
//! never has to be refitted and never gets worse; only the triangles in it are written anew, on the GPU, from the clock. The
//! driver's structures, which take no boxes of ours, are refitted.

use super::Scene;
use super::clock::{Clock, rate};
use super::entity_geometry::Placement;
use super::program::wave_at;
use super::program::wave_record;
use super::records::*;
use super::static_geometry::Geometry;
use crate::assets::shader_script::Deform as Script;
use glam::{Vec2, Vec3};
use rayon::prelude::*;
use std::f32::consts::TAU;
use std::ops::Range;

/// How fast the noise of `deformVertexes normal` changes over space, steps a unit.
const NOISE_DENSITY: f32 = 0.98;
/// Noise of the three axes is this many steps apart.
const NOISE_AXES: f32 = 100.0;

/// The record of a deformation; `None` for those that are left out (shadows and texts).
pub fn record(deform: &Script) -> Option<Deform> {
    let none = Deform::default();
    Some(match deform {
        Script::Wave { spread, wave } => Deform {
            kind: DEFORM_WAVE,
            a: *spread,
            wave: wave_record(wave),
            ..none
        },
        Script::Normal { amplitude, frequency } => Deform {
            kind: DEFORM_NORMAL,
            a: *amplitude,
            rate: rate(frequency / super::clock::NOISE_STEPS),
            ..none
        },
        Script::Bulge { width, height, speed } => Deform {
            kind: DEFORM_BULGE,
            a: width / TAU,
            b: *height,
            rate: rate(speed / TAU),
            ..none
        },
        Script::Move { direction, wave } => Deform {
            kind: DEFORM_MOVE,
            direction: (*direction).into(),
            wave: wave_record(wave),
            ..none
        },
        Script::Autosprite => Deform {
            kind: DEFORM_AUTOSPRITE,
            ..none
        },
        Script::Autosprite2 => Deform {
            kind: DEFORM_AUTOSPRITE2,
            ..none
        },
        Script::ProjectionShadow | Script::Text(_) => return None,
    })
}

/// Farthest that deformations move a vertex, units; autosprites apart.
pub fn reach(deforms: &[Deform]) -> f32 {
    let swing = |w: &Wave| w.base.abs() + w.amplitude.abs();
    deforms
        .iter()
        .map(|d| match d.kind {
            DEFORM_WAVE => swing(&d.wave),
            DEFORM_BULGE => d.b.abs(),
            DEFORM_MOVE => Vec3::from(d.direction).length() * swing(&d.wave),
            _ => 0.0,
        })
        .sum()
}

/// The dynamic part of a scene's geometry.
#[derive(Clone, Debug, Default)]
pub struct Dynamic {
    pub parts: Vec<DynamicPart>,
    /// Global vertices of all parts.
    pub vertices: Range<u32>,
    /// As modelled, one for each of `vertices`.
    pub rest: Vec<RestVertex>,
}

/// The deforming triangles of one mesh.
#[derive(Clone, Debug)]
pub struct DynamicPart {
    /// Mesh that holds them, and nothing else.
    pub mesh: u32,
    /// Mesh that they are a part of: they stand wherever it stands. 0: the world.
    pub carrier: u32,
    /// Global vertices.
    pub vertices: Range<u32>,
    /// Boxes that hold the mesh's triangles at all times.
    pub boxes: Vec<[Vec3; 2]>,
}

impl Dynamic {
    /// The part that is mesh number `mesh`.
    pub fn part(&self, mesh: usize) -> Option<&DynamicPart> {
        self.parts.iter().find(|p| p.mesh as usize == mesh)
    }

    /// Mesh that a mesh is a part of, or itself.
    pub fn carrier(&self, mesh: usize) -> usize {
        self.part(mesh).map_or(mesh, |p| p.carrier as usize)
    }

    /// Area of the boxes that hold the triangles at all times over that of the boxes of the triangles at rest; `None` where
    /// nothing deforms.
    pub fn box_growth(&self, geometry: &Geometry) -> Option<f64> {
        let area = |size: Vec3| f64::from(size.x * size.y + size.y * size.z + size.z * size.x);
        let (mut swept, mut rest) = (0.0, 0.0);
        for part in &self.parts {
            let first = geometry.meshes[part.mesh as usize].first_triangle;
            for (t, [min, max]) in (first..).zip(&part.boxes) {
                let [a, b, c] = geometry.corners(t);
                swept += area(*max - *min);
                // A unit of thickness keeps flat ones from having no area.
                rest += area(a.max(b).max(c) - a.min(b).min(c) + Vec3::ONE);
            }
        }
        (rest > 0.0).then(|| swept / rest)
    }

    /// Places parts wherever their carriers are. Sprites of a carrier that stands in several places look at the eye as its first
    /// one sees it.
    pub fn place(&mut self, placements: &mut Vec<Placement>) {
        for part in &self.parts {
            let first = placements.len() as u32;
            let carried: Vec<Placement> = placements
                .iter()
                .filter(|p| p.mesh == part.carrier && p.steps == 1)
                .map(|p| Placement {
                    mesh: part.mesh,
                    // Beside a carrier with less detail it keeps its own.
                    less_detailed: Vec::new(),
                    ..p.clone()
                })
                .collect();
            if carried.is_empty() {
                continue;
            }
            placements.extend(carried);
            for v in part.vertices.clone() {
                self.rest[(v - self.vertices.start) as usize].instance = first;
            }
        }
    }
}

/// The box that holds a triangle at all times and seen from everywhere.
pub fn swept(corners: [Vec3; 3], quad: Option<[Vec3; 4]>, reach: f32) -> [Vec3; 2] {
    let (mut min, mut max) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
    match quad {
        Some(quad) => {
            let middle = quad.iter().sum::<Vec3>() * 0.25;
            let radius = quad.map(|p| p.distance(middle)).into_iter().fold(0.0, f32::max);
            (min, max) = (middle - radius, middle + radius);
        }
        None => {
            for p in corners {
                (min, max) = (min.min(p), max.max(p));
            }
        }
    }
    // Rounding must not push a triangle out of its box.
    let slack = reach * 1.001 + 1e-3 + 1e-5 * min.abs().max(max.abs()).max_element();
    [min - slack, max + slack]
}

/// A vertex where it is now.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Moved {
    pub position: Vec3,
    pub normal: Vec3,
}

/// A vertex at a moment, seen from `eye` (which only sprites look at). `quad`: the four of a sprite. Counterpart of
/// `shaders/include/deform.glsl`.
pub fn deformed(deforms: &[Deform], rest: &RestVertex, uv: Vec2, quad: [Vec3; 4], clock: Clock, eye: Vec3) -> Moved {
    let mut out = Moved {
        position: rest.position.into(),
        normal: rest.normal.into(),
    };
    for d in deforms {
        match d.kind {
            DEFORM_WAVE => {
                let off = out.position.element_sum() * d.a;
                let phase = d.wave.phase + clock.fraction(d.wave.rate) + off;
                out.position += out.normal * wave_at(&d.wave, phase);
            }
            DEFORM_NORMAL => {
                let noise = Wave {
                    function: WAVE_NOISE,
                    amplitude: d.a,
                    ..Wave::default()
                };
                let p = out.position * NOISE_DENSITY;
                let at = |axis: f32| {
                    (p.element_sum() + axis * NOISE_AXES) / super::clock::NOISE_STEPS + clock.fraction(d.rate)
                };
                let shift = Vec3::new(
                    wave_at(&noise, at(0.0)),
                    wave_at(&noise, at(1.0)),
                    wave_at(&noise, at(2.0)),
                );
                out.normal = (out.normal + shift).normalize_or(out.normal);
            }
            DEFORM_BULGE => {
                let turn = uv.x * d.a + clock.fraction(d.rate);
                out.position += out.normal * (((turn - turn.floor()) * TAU).sin() * d.b);
            }
            DEFORM_MOVE => {
                let phase = d.wave.phase + clock.fraction(d.wave.rate);
                out.position += Vec3::from(d.direction) * wave_at(&d.wave, phase);
            }
            DEFORM_AUTOSPRITE => out = sprite(&out, quad, eye),
            _ => out = pivoted(&out, quad, eye),
        }
    }
    out
}

/// Right and up of a quad as modelled, seen from its front.
pub fn sprite_axes(quad: [Vec3; 4]) -> [Vec3; 2] {
    let own = (quad[1] - quad[0]).cross(quad[2] - quad[0]).normalize_or(Vec3::X);
    let up = if own.z.abs() < 0.999 { Vec3::Z } else { Vec3::X };
    let right = up.cross(own).normalize_or(Vec3::Y);
    [right, own.cross(right)]
}

/// A corner of a quad that faces the eye, upright.
fn sprite(v: &Moved, quad: [Vec3; 4], eye: Vec3) -> Moved {
    let middle = (quad[0] + quad[1] + quad[2] + quad[3]) * 0.25;
    let normal = (eye - middle).normalize_or(Vec3::X);
    let up = if normal.z.abs() < 0.999 { Vec3::Z } else { Vec3::X };
    let right = up.cross(normal).normalize();
    let up = normal.cross(right);
    // Where the corner stands in the plane of the quad as modelled: its own axes.
    let [own_right, own_up] = sprite_axes(quad);
    let d = v.position - middle;
    Moved {
        position: middle + right * d.dot(own_right) + up * d.dot(own_up),
        normal,
    }
}

/// A corner of a quad that turns about its long axis to face the eye.
fn pivoted(v: &Moved, quad: [Vec3; 4], eye: Vec3) -> Moved {
    let middle = (quad[0] + quad[1] + quad[2] + quad[3]) * 0.25;
    let (a, b) = (quad[1] - quad[0], quad[2] - quad[0]);
    let own = a.cross(b).normalize_or(Vec3::X);
    // The sides of the quad are two of the three between its first corner and the others: not the diagonal, the longest.
    let sides = {
        let mut s = [a, b, quad[3] - quad[0]];
        s.sort_by(|x, y| x.length_squared().total_cmp(&y.length_squared()));
        s
    };
    let axis = sides[1].normalize_or(Vec3::Z);
    let across = axis.cross(own);
    let to_eye = eye - middle;
    let normal = (to_eye - axis * to_eye.dot(axis)).normalize_or(own);
    let turned = axis.cross(normal);
    let d = v.position - middle;
    Moved {
        position: middle + axis * d.dot(axis) + turned * d.dot(across),
        normal,
    }
}

/// A point of the world in the space of an instance that has been moved rigidly.
fn to_carrier(rows: &[[f32; 4]; 3], p: Vec3) -> Vec3 {
    let d = p - Vec3::new(rows[0][3], rows[1][3], rows[2][3]);
    let axis = |c: usize| Vec3::new(rows[0][c], rows[1][c], rows[2][c]).dot(d);
    Vec3::new(axis(0), axis(1), axis(2))
}

/// All dynamic vertices at a moment, seen from `eye`, in the spaces of their meshes.
pub fn all(scene: &Scene, instances: &[Instance], clock: Clock, eye: Vec3) -> Vec<Moved> {
    let (geometry, materials, deforms) = (&scene.geometry, &scene.materials, &scene.tables.deforms);
    let dynamic = &geometry.dynamic;
    let first = dynamic.vertices.start;
    (0..dynamic.rest.len())
        .into_par_iter()
        .map(|i| {
            let rest = &dynamic.rest[i];
            let own = materials.get(rest.material as usize).map_or(&[][..], |m| {
                &deforms[m.first_deform as usize..(m.first_deform + m.deform_count) as usize]
            });
            let uv = Vec2::from(geometry.attributes[first as usize + i].uv);
            let quad = match rest.quad {
                NONE => [Vec3::ZERO; 4],
                q => std::array::from_fn(|k| dynamic.rest[(q - first) as usize + k].position.into()),
            };
            let carrier = instances.get(rest.instance as usize);
            let eye = carrier.map_or(eye, |i| to_carrier(&i.object_to_world, eye));
            deformed(own, rest, uv, quad, clock, eye)
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const QUAD: [Vec3; 4] = [
        Vec3::new(0.0, -4.0, -8.0),
        Vec3::new(0.0, 4.0, -8.0),
        Vec3::new(0.0, 4.0, 8.0),
        Vec3::new(0.0, -4.0, 8.0),
    ];

    fn rest(position: Vec3) -> RestVertex {
        RestVertex {
            position: position.into(),
            normal: [1.0, 0.0, 0.0],
            quad: 0,
            material: 0,
            instance: NONE,
        }
    }

    fn corners(kind: u32, eye: Vec3) -> [Vec3; 4] {
        let deform = Deform {
            kind,
            ..Deform::default()
        };
        QUAD.map(|p| deformed(&[deform], &rest(p), Vec2::ZERO, QUAD, Clock::default(), eye).position)
    }

    #[test]
    fn sprites_face_the_eye_and_keep_their_shape() {
        let eye = Vec3::new(30.0, 50.0, 20.0);
        for kind in [DEFORM_AUTOSPRITE, DEFORM_AUTOSPRITE2] {
            let now = corners(kind, eye);
            for i in 0..4 {
                let side = |q: [Vec3; 4]| q[i].distance(q[(i + 1) % 4]);
                assert!((side(now) - side(QUAD)).abs() < 1e-4, "{kind} {now:?}");
            }
        }
        let facing = corners(DEFORM_AUTOSPRITE, eye);
        let normal = (facing[1] - facing[0]).cross(facing[2] - facing[0]).normalize();
        assert!(normal.dot(eye.normalize()).abs() > 0.9999);
        // The long axis stands.
        let turned = corners(DEFORM_AUTOSPRITE2, eye);
        assert!((turned[2] - turned[1] - Vec3::Z * 16.0).length() < 1e-4);
        assert!(turned.iter().all(|p| (p.truncate().dot(eye.truncate())).abs() < 1e-3));
    }

    #[test]
    fn nothing_leaves_its_box() {
        let wave = Wave {
            function: WAVE_SINE,
            base: 1.0,
            amplitude: 3.0,
            phase: 0.0,
            rate: rate(1.0),
        };
        let deforms = [
            Deform {
                kind: DEFORM_WAVE,
                a: 0.01,
                wave,
                ..Deform::default()
            },
            Deform {
                kind: DEFORM_MOVE,
                direction: [0.0, 0.0, 2.0],
                wave,
                ..Deform::default()
            },
            Deform {
                kind: DEFORM_BULGE,
                a: 1.0,
                b: 5.0,
                rate: rate(0.3),
                ..Deform::default()
            },
        ];
        let corners = [QUAD[0], QUAD[1], QUAD[2]];
        let [min, max] = swept(corners, None, reach(&deforms));
        for i in 0..500 {
            let clock = Clock::from_seconds(f64::from(i) * 0.037);
            for p in corners {
                let q = deformed(&deforms, &rest(p), Vec2::new(p.y, 0.0), QUAD, clock, Vec3::ZERO).position;
                assert!(q.cmpge(min).all() && q.cmple(max).all(), "{q}");
            }
        }
    }
}
