//! One sample of one light as seen from a receiver. Counterpart of `shaders/include/light_sample.glsl`.
//!
//! Values are contributions to irradiance/π in luxel units, without visibility, already divided by the pdf of the
//! position on the light (solid angle for spheres, suns and near triangles, area for other triangles).

use super::surface::{SurfaceHit, emitted, offset_point};
use super::texture::uv_at;
use crate::scene::Scene;
use crate::scene::records::{
    LIGHT_DOME, LIGHT_EVEN, LIGHT_LINEAR, LIGHT_NO_COSINE, LIGHT_SPHERE, LIGHT_SPOT, LIGHT_SUN, LIGHT_TRIANGLE,
    LIGHT_TWO_SIDED, Light,
};
use crate::scene::sampling::{disc, tangents, triangle};
use glam::Vec3;
use std::f32::consts::{PI, TAU};

/// Where the shadow ray goes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Target {
    /// A point; nothing may lie before it.
    Point(Vec3),
    /// A direction to infinity; the ray must leave through a sky surface.
    Sky(Vec3),
}

/// A light sample.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LightSample {
    /// Contribution to irradiance/π if nothing is in the way.
    pub value: Vec3,
    /// Its part that is not the radiance which leaves the light: cosines, distance and the pdf of the position.
    pub geometry: f32,
    pub target: Target,
}

/// How the point of a light is sampled.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PointSampling {
    /// Its middle: hard shadows.
    Centre,
    /// Triangles uniformly in area.
    Area,
    /// Near triangles uniformly in solid angle.
    SolidAngle,
}

/// Samples a light; `None` where the sample contributes nothing.
pub fn sample_light(
    scene: &Scene,
    light: &Light,
    at: &SurfaceHit,
    u: [f32; 2],
    points: PointSampling,
) -> Option<LightSample> {
    let soft = points != PointSampling::Centre;
    let sample = match light.kind {
        LIGHT_TRIANGLE => sample_triangle(scene, light, at, u, points),
        LIGHT_SPHERE => sample_sphere(light, at, u, soft),
        LIGHT_SUN => sample_sun(light, at, u, soft),
        LIGHT_DOME => sample_dome(light, at, u, points),
        _ => None,
    }?;
    (sample.value.max_element() > 0.0 && sample.value.is_finite()).then_some(sample)
}

/// Cosine at the receiver; 0 where the direction leaves through the surface itself.
fn receiver_cosine(at: &SurfaceHit, direction: Vec3) -> f32 {
    if at.geometric_normal.dot(direction) <= 0.0 {
        0.0
    } else {
        at.shading_normal.dot(direction).max(0.0)
    }
}

/// A point on an emitting triangle.
struct TrianglePoint {
    barycentrics: [f32; 2],
    position: Vec3,
    /// Unit direction from the receiver.
    direction: Vec3,
    /// Unit normal on the side of the receiver.
    normal: Vec3,
    /// Cosines at both ends over π and over the pdf of the direction: contribution per radiance.
    factor: f32,
}

/// Triangles whose longer edge is seen under less than about this (squared, radians) are sampled by area: their
/// directions hardly differ.
const SMALL_EDGE_2: f32 = 0.04;
/// Least solid angle that is sampled as such; rounding grows with its inverse.
const SMALL_SOLID_ANGLE: f32 = 2e-3;
/// Least sine of the angle at the corner where sampling starts, likewise.
const SMALL_SINE: f32 = 0.03;
/// Solid angle beyond which a triangle without such a corner is large.
const LARGE_SOLID_ANGLE: f32 = 0.3;

fn triangle_point(light: &Light, at: &SurfaceHit, u: [f32; 2], points: PointSampling) -> Option<TrianglePoint> {
    let (p0, e1, e2) = (Vec3::from(light.p0), Vec3::from(light.p1), Vec3::from(light.p2));
    let mut normal = e1.cross(e2);
    // Of the parallelepiped between the receiver and the triangle's edges.
    let volume = normal.dot(at.position - p0);
    normal = normal.normalize();
    if volume <= 0.0 {
        if light.flags & LIGHT_TWO_SIDED == 0 {
            return None;
        }
        normal = -normal;
    }
    let to_middle = p0 + (e1 + e2) * (1.0 / 3.0) - at.position;
    let near = e1.length_squared().max(e2.length_squared()) > SMALL_EDGE_2 * to_middle.length_squared();
    if points == PointSampling::SolidAngle && near {
        let corners = [p0 - at.position, p0 + e1 - at.position, p0 + e2 - at.position];
        match spherical_triangle(corners, volume, u) {
            SphericalSample::Uniform { direction, solid_angle } => {
                let [b1, b2] = meet(light, at.position, direction)?;
                let (b1, b2) = (b1.clamp(0.0, 1.0), b2.clamp(0.0, 1.0 - b1.clamp(0.0, 1.0)));
                return Some(TrianglePoint {
                    barycentrics: [b1, b2],
                    position: p0 + e1 * b1 + e2 * b2,
                    direction,
                    normal,
                    factor: receiver_cosine(at, direction) * solid_angle / PI,
                });
            }
            SphericalSample::Around => {
                // Directions in proportion to the cosine, of which those count that meet the triangle.
                let [x, y] = disc(u);
                let (t1, t2) = tangents(at.shading_normal);
                let up = (1.0 - x * x - y * y).max(0.0).sqrt();
                let direction = t1 * x + t2 * y + at.shading_normal * up;
                let [b1, b2] = meet(light, at.position, direction)?;
                let met = b1 >= 0.0 && b2 >= 0.0 && b1 + b2 <= 1.0 && direction.dot(normal) < 0.0;
                return (met && receiver_cosine(at, direction) > 0.0).then(|| TrianglePoint {
                    barycentrics: [b1, b2],
                    position: p0 + e1 * b1 + e2 * b2,
                    direction,
                    normal,
                    factor: 1.0,
                });
            }
            SphericalSample::Small => {}
        }
    }
    let [b1, b2] = if points == PointSampling::Centre {
        [1.0 / 3.0; 2]
    } else {
        triangle(u)
    };
    let position = p0 + e1 * b1 + e2 * b2;
    let to_light = position - at.position;
    let d2 = to_light.length_squared();
    if d2 <= 0.0 {
        return None;
    }
    let direction = to_light / d2.sqrt();
    let cosines = receiver_cosine(at, direction) * (-normal.dot(direction)).max(0.0);
    Some(TrianglePoint {
        barycentrics: [b1, b2],
        position,
        direction,
        normal,
        factor: cosines * light.size / (PI * d2),
    })
}

/// Barycentrics of the second and third corner where a line meets the plane of a light.
fn meet(light: &Light, from: Vec3, direction: Vec3) -> Option<[f32; 2]> {
    let (e1, e2) = (Vec3::from(light.p1), Vec3::from(light.p2));
    let across = direction.cross(e2);
    let determinant = e1.dot(across);
    let to = from - Vec3::from(light.p0);
    (determinant != 0.0).then(|| [to.dot(across) / determinant, direction.dot(to.cross(e1)) / determinant])
}

/// How to sample a triangle by solid angle.
enum SphericalSample {
    /// A direction towards it, uniform in solid angle.
    Uniform { direction: Vec3, solid_angle: f32 },
    /// It lies around the receiver, or the receiver almost in its plane: one corner is almost on the great circle
    /// through the others, and single precision cannot say where.
    Around,
    /// By area: its directions hardly differ.
    Small,
}

/// Samples the solid angle of a triangle given by vectors to its corners (Arvo 1995, "Stratified Sampling of Spherical
/// Triangles"). `volume`: their triple product, which is known better than unit vectors close to each other would tell it.
fn spherical_triangle(corners: [Vec3; 3], volume: f32, u: [f32; 2]) -> SphericalSample {
    let lengths = corners.map(Vec3::length);
    let [a, b, c] = std::array::from_fn(|i| corners[i] / lengths[i]);
    let (ab, bc, ca) = (a.dot(b), b.dot(c), c.dot(a));
    let triple = volume.abs() / (lengths[0] * lengths[1] * lengths[2]);
    // Van Oosterom and Strackee 1983.
    let solid_angle = 2.0 * triple.atan2(1.0 + ab + bc + ca);
    // The longest edge is put opposite to a, whose own edges are then far from half a turn.
    let [pa, pb, pc] = corners;
    let (far, a, b, ab) = if ca < bc && ca < ab {
        ([pb, pc, pa], b, c, bc)
    } else if ab < bc {
        ([pc, pa, pb], c, a, ca)
    } else {
        ([pa, pb, pc], a, b, ab)
    };
    // Normals of the great circles through a and b, a and c, from the triangle's edges: differences of the unit vectors
    // would lose the digits that small triangles need.
    let (nb, nc) = (far[0].cross(far[1] - far[0]), far[0].cross(far[2] - far[0]));
    let (length_b, length_c) = (nb.length(), nc.length());
    let (lb, lc) = (
        length_b / (far[0].length() * far[1].length()),
        length_c / (far[0].length() * far[2].length()),
    );
    // The angle at corner a.
    let cos_alpha = (nb.dot(nc) / (length_b * length_c)).clamp(-1.0, 1.0);
    let sin_alpha = triple / (lb * lc);
    let usable = sin_alpha > SMALL_SINE;
    if solid_angle <= if usable { SMALL_SOLID_ANGLE } else { LARGE_SOLID_ANGLE } {
        return SphericalSample::Small;
    }
    if !usable {
        return SphericalSample::Around;
    }
    // The edge from a to the point up to which the triangle has the wanted share of the area, by the half-angle
    // formula for the area, which keeps its precision for small triangles.
    let (sin_half, cos_half) = (0.5 * solid_angle * u[0]).sin_cos();
    let tan_ab = lb / (1.0 + ab);
    let x = sin_half / (tan_ab * (sin_alpha * cos_half - cos_alpha * sin_half));
    let on_edge = (a * (1.0 - x * x) + nc.cross(a) * (2.0 * x / length_c)) / (1.0 + x * x);
    // On the arc from there to b: 1 − cosine is uniform.
    let chord = on_edge - b;
    let versine = 0.5 * chord.length_squared();
    let drop = u[1] * versine;
    let across = chord + b * versine;
    let length = across.length();
    let direction = if length > 0.0 {
        b * (1.0 - drop) + across * ((drop * (2.0 - drop)).max(0.0).sqrt() / length)
    } else {
        b
    };
    SphericalSample::Uniform {
        direction: direction.normalize(),
        solid_angle,
    }
}

fn sample_triangle(
    scene: &Scene,
    light: &Light,
    at: &SurfaceHit,
    u: [f32; 2],
    points: PointSampling,
) -> Option<LightSample> {
    let p = triangle_point(light, at, u, points).filter(|p| p.factor > 0.0)?;
    let uv = uv_at(scene, light.triangle, p.barycentrics);
    let radiance = emitted(
        scene,
        &scene.materials[light.material as usize],
        uv,
        p.position,
        p.direction,
        at.clock,
    );
    Some(LightSample {
        value: radiance * (p.factor * light.scale),
        geometry: p.factor,
        target: Target::Point(offset_point(p.position, p.normal)),
    })
}

/// The compiler spreads its suns evenly in azimuth and elevation: the dome's radiance is V/(255·π·cos elevation).
fn sample_dome(light: &Light, at: &SurfaceHit, u: [f32; 2], points: PointSampling) -> Option<LightSample> {
    let even = light.flags & LIGHT_EVEN != 0;
    let p = triangle_point(light, at, u, points).filter(|p| p.factor > 0.0 && (even || p.direction.z > 0.0))?;
    if even {
        return Some(LightSample {
            value: Vec3::from(light.radiance) * p.factor,
            geometry: p.factor,
            target: Target::Point(offset_point(p.position, p.normal)),
        });
    }
    let cos_elevation = (1.0 - p.direction.z * p.direction.z).max(1e-8).sqrt();
    let geometry = p.factor / (PI * cos_elevation);
    Some(LightSample {
        value: Vec3::from(light.radiance) * geometry,
        geometry,
        target: Target::Point(offset_point(p.position, p.normal)),
    })
}

fn sample_sphere(light: &Light, at: &SurfaceHit, u: [f32; 2], soft: bool) -> Option<LightSample> {
    let centre = Vec3::from(light.p0);
    let to_centre = centre - at.position;
    let d2 = to_centre.length_squared();
    let r2 = light.size * light.size;
    if d2 <= r2 {
        return None;
    }
    let d = d2.sqrt();
    let axis = to_centre / d;
    // 1 − cos of the cone, without cancellation.
    let sin2 = r2 / d2;
    let cone = sin2 / (1.0 + (1.0 - sin2).max(0.0).sqrt());
    let (direction, reach) = if soft {
        let drop = u[0] * cone;
        let cos = 1.0 - drop;
        let sin_2 = drop * (2.0 - drop);
        let phi = TAU * u[1];
        let (t1, t2) = tangents(axis);
        let sin = sin_2.max(0.0).sqrt();
        let direction = axis * cos + t1 * (sin * phi.cos()) + t2 * (sin * phi.sin());
        (direction, d * cos - (r2 - d2 * sin_2).max(0.0).sqrt())
    } else {
        (axis, d - light.size)
    };
    let mut cosine = receiver_cosine(at, direction);
    if cosine <= 0.0 {
        return None;
    }
    if light.flags & LIGHT_NO_COSINE != 0 {
        cosine = 1.0;
    }
    let mut geometry = if light.flags & LIGHT_LINEAR != 0 {
        (light.p2[2] - d * light.p2[1]).max(0.0) * cosine
    } else {
        // Solid angle 2π·cone; irradiance/π is radiance · cos · solid angle / π.
        2.0 * cone * cosine
    };
    if light.flags & LIGHT_SPOT != 0 {
        let spot = Vec3::from(light.p1);
        let along = -to_centre.dot(spot);
        let off = (-to_centre - spot * along).length();
        let edge = if along > 0.0 {
            (light.p2[0] * along - off) / 32.0
        } else {
            0.0
        };
        geometry *= edge.clamp(0.0, 1.0);
    }
    Some(LightSample {
        value: Vec3::from(light.radiance) * geometry,
        geometry,
        target: Target::Point(at.position + direction * reach),
    })
}

fn sky_sample(at: &SurfaceHit, azimuth: f32, elevation: f32, value: Vec3) -> Option<LightSample> {
    let (se, ce) = elevation.sin_cos();
    let (sa, ca) = azimuth.sin_cos();
    let direction = Vec3::new(ca * ce, sa * ce, se);
    let cosine = receiver_cosine(at, direction);
    (cosine > 0.0).then(|| LightSample {
        value: value * cosine,
        geometry: cosine,
        target: Target::Sky(direction),
    })
}

fn sample_sun(light: &Light, at: &SurfaceHit, u: [f32; 2], soft: bool) -> Option<LightSample> {
    let [x, y] = if soft { disc(u) } else { [0.0; 2] };
    let [azimuth, elevation, radius] = light.p1;
    sky_sample(
        at,
        azimuth + x * radius,
        elevation + y * radius,
        Vec3::from(light.radiance),
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::sampling::{Sequence, sample2};

    /// Share of the samples within a cap of directions, against the cap's share of the triangle by a fine grid of area
    /// samples with their solid angles.
    #[test]
    fn directions_are_uniform_in_the_solid_angle() {
        let cases = [
            // An octant, a small far one, one beside the receiver, one that nearly surrounds it, a sliver.
            [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
            [[10.0, 0.0, 0.5], [10.0, 1.0, 0.0], [10.0, 0.0, -0.7]],
            [[100.0, 5.0, 0.0], [-100.0, 5.0, 0.0], [0.0, 5.0, 200.0]],
            [[3.0, 0.1, -2.0], [-3.0, 0.1, -2.0], [0.0, 0.1, 4.0]],
            [[5.0, 0.3, 0.0], [-2.0, 0.3, 0.1], [-2.0, 0.3, -0.1]],
        ];
        for corners in cases {
            let corners = corners.map(Vec3::from);
            let [a, b, c] = corners.map(|v| v.as_dvec3());
            let cross = (b - a).cross(c - a);
            let n = 1000;
            let (mut whole, mut moment) = (0.0, glam::DVec3::ZERO);
            for i in 0..n {
                for j in 0..n - i {
                    for up in [false, true] {
                        if up && j + 1 == n - i {
                            continue;
                        }
                        let third = if up { 2.0 / 3.0 } else { 1.0 / 3.0 };
                        let (x, y) = (
                            (f64::from(i) + third) / f64::from(n),
                            (f64::from(j) + third) / f64::from(n),
                        );
                        let p = a + (b - a) * x + (c - a) * y;
                        let solid = cross.dot(p).abs() / (2.0 * f64::from(n * n) * p.length().powi(3));
                        whole += solid;
                        moment += p.normalize() * solid;
                    }
                }
            }
            let volume = (corners[1] - corners[0])
                .cross(corners[2] - corners[0])
                .dot(-corners[0]);
            let samples = 1 << 14;
            let mut mean = glam::DVec3::ZERO;
            for i in 0..samples {
                let s = spherical_triangle(corners, volume, sample2(Sequence::Sobol, 77, i));
                let SphericalSample::Uniform { direction, solid_angle } = s else {
                    panic!("{corners:?} is not sampled uniformly");
                };
                assert!(
                    (f64::from(solid_angle) / whole - 1.0).abs() < 2e-3,
                    "{corners:?}: {solid_angle} {whole}"
                );
                mean += direction.as_dvec3() / f64::from(samples);
                // Inside, up to rounding.
                for (p, q, r) in [(a, b, c), (b, c, a), (c, a, b)] {
                    let side = p.cross(q);
                    let inside = side.dot(direction.as_dvec3()) * side.dot(r).signum() / side.length();
                    assert!(inside > -1e-4, "{corners:?}: {inside}");
                }
            }
            let error = (mean - moment / whole).length();
            assert!(error < 2e-3, "{corners:?}: mean direction off by {error}");
        }
    }
}
