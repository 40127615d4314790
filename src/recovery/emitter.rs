//! Pieces of emissive surfaces, and what they give a luxel when nothing is in the way. E/π in luxel units.

use super::luxels::Luxel;
use crate::scene::Scene;
use crate::scene::records::{LIGHT_TWO_SIDED, Light};
use glam::Vec3;
use std::f32::consts::PI;

/// No point light is nearer than this, units.
pub const NEAREST: f32 = 16.0;
/// Beyond this many times its size an emitter counts as a point.
const FAR: f32 = 5.0;
/// Backsplash: v = L·area·cos/(60·d²) for the usual 5 percent.
const BACKSPLASH: f32 = 1.0 / 60.0 / 5.0;
/// Least extent that emitters are cut to, units, and most pieces of one triangle.
const LEAST_PIECE: f32 = 8.0;
const MOST_PIECES: usize = 256;

/// One piece of an emissive surface.
pub struct Emitter {
    pub term: u32,
    pub corners: [Vec3; 3],
    pub centre: Vec3,
    pub normal: Vec3,
    area: f32,
    /// Square of the greatest distance of a corner from the centre.
    size2: f32,
    two_sided: bool,
    /// Where the backsplash is, and its strength relative to the radiance.
    pub splash: (Vec3, f32),
    /// Squares of the distances at which light and backsplash are a byte at most and `-fast` drops them.
    reach2: [f32; 2],
}

/// The pieces that the compiler makes of an emissive triangle: halved along its longest edge while it is too large.
pub fn emitters(scene: &Scene, light: &Light, term: u32, fast: bool) -> Vec<Emitter> {
    let p0 = Vec3::from(light.p0);
    let (e1, e2) = (Vec3::from(light.p1), Vec3::from(light.p2));
    let normal = e1.cross(e2).normalize_or(Vec3::Z);
    let source = &scene.material_sources[light.material as usize];
    let [percent, distance] = source.backsplash;
    let strongest = source.emission().map_or(0.0, |e| e.radiance.max_element()) * 255.0;
    let most = source.light_subdivide.max(LEAST_PIECE);
    let mut waiting = vec![[p0, p0 + e1, p0 + e2]];
    let mut out = Vec::new();
    while let Some([a, b, c]) = waiting.pop() {
        let (least, greatest) = (a.min(b).min(c), a.max(b).max(c));
        if (greatest - least).max_element() > most && out.len() + waiting.len() < MOST_PIECES {
            // The longest edge first.
            let [a, b, c] = [[a, b, c], [b, c, a], [c, a, b]]
                .into_iter()
                .max_by(|x, y| x[0].distance(x[1]).total_cmp(&y[0].distance(y[1])))
                .unwrap_or([a, b, c]);
            let middle = (a + b) * 0.5;
            waiting.push([a, middle, c]);
            waiting.push([middle, b, c]);
            continue;
        }
        let centre = (a + b + c) / 3.0;
        let area = (b - a).cross(c - a).length() * 0.5;
        out.push(Emitter {
            term,
            corners: [a, b, c],
            centre,
            normal,
            area,
            size2: [a, b, c]
                .map(|p| p.distance_squared(centre))
                .into_iter()
                .fold(0.0, f32::max),
            two_sided: light.flags & LIGHT_TWO_SIDED != 0,
            reach2: if fast {
                [strongest * area / PI, strongest * area * percent.max(0.0) * BACKSPLASH]
            } else {
                [f32::INFINITY; 2]
            },
            splash: (centre + normal * (distance + 1.0), percent.max(0.0) * BACKSPLASH * area),
        });
    }
    out
}

/// Lambert's form factor of a triangle as seen from a receiver, clipped at its horizon: E/π for radiance 1.
pub fn form_factor(position: Vec3, normal: Vec3, corners: [Vec3; 3]) -> f32 {
    let relative = corners.map(|c| c - position);
    let heights = relative.map(|r| normal.dot(r));
    let mut polygon = [Vec3::ZERO; 4];
    let mut n = 0;
    for i in 0..3 {
        let j = (i + 1) % 3;
        if heights[i] > 0.0 {
            polygon[n] = relative[i];
            n += 1;
        }
        if (heights[i] > 0.0) != (heights[j] > 0.0) && n < 4 {
            polygon[n] = relative[i] + (relative[j] - relative[i]) * (heights[i] / (heights[i] - heights[j]));
            n += 1;
        }
    }
    if n < 3 {
        return 0.0;
    }
    let mut sum = 0.0;
    for i in 0..n {
        let (a, b) = (polygon[i], polygon[(i + 1) % n]);
        let cross = a.cross(b);
        let sine = cross.length();
        if sine > 0.0 {
            sum += sine.atan2(a.dot(b)) * normal.dot(cross) / sine;
        }
    }
    sum.abs() / (2.0 * PI)
}

/// Unshadowed E/π of an emitter of radiance 1.
pub fn direct(e: &Emitter, luxel: &Luxel) -> f32 {
    let to = e.centre - luxel.position;
    let facing = -e.normal.dot(e.corners[0] - luxel.position);
    if facing <= 0.0 && !e.two_sided {
        return 0.0;
    }
    let d2 = to.length_squared();
    if d2 > e.reach2[0] {
        return 0.0;
    }
    if d2 > FAR * FAR * e.size2 {
        let cos = luxel.cosine(to);
        return cos * (e.normal.dot(to)).abs() * e.area / (PI * d2 * d2);
    }
    let front = form_factor(luxel.position, luxel.normal, e.corners);
    if luxel.two_sided {
        front + form_factor(luxel.position, -luxel.normal, e.corners)
    } else {
        front
    }
}

/// Unshadowed E/π of an emitter's backsplash at radiance 1.
pub fn splash(e: &Emitter, luxel: &Luxel) -> f32 {
    let to = e.splash.0 - luxel.position;
    let d = to.length();
    if d <= 0.0 || d * d > e.reach2[1] {
        return 0.0;
    }
    e.splash.1 * luxel.cosine(to / d) / (d * d).max(NEAREST * NEAREST)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn form_factors_meet_closed_forms() {
        // A very large ceiling fills the hemisphere: E/π = L.
        let far = 1e5;
        let ceiling = [
            Vec3::new(-far, -far, 1.0),
            Vec3::new(3.0 * far, -far, 1.0),
            Vec3::new(-far, 3.0 * far, 1.0),
        ];
        assert!((form_factor(Vec3::ZERO, Vec3::Z, ceiling) - 1.0).abs() < 1e-3);
        // A wall that begins at the receiver's floor and goes on for ever covers half of it.
        let wall = [
            Vec3::new(1.0, -far, -far),
            Vec3::new(1.0, far, -far),
            Vec3::new(1.0, 0.0, far),
        ];
        assert!((form_factor(Vec3::ZERO, Vec3::Z, wall) - 0.5).abs() < 2e-2);
        // Behind the horizon there is nothing.
        let below = ceiling.map(|p| Vec3::new(p.x, p.y, -1.0));
        assert_eq!(form_factor(Vec3::ZERO, Vec3::Z, below), 0.0);
        // A small distant triangle: A·cos·cos'/(π d²).
        let small = [
            Vec3::new(30.0, 0.0, 40.0),
            Vec3::new(30.5, 0.0, 40.0),
            Vec3::new(30.0, 0.5, 40.0),
        ];
        let expected = 0.125 * 0.8 * 0.8 / (PI * 2500.0);
        assert!((form_factor(Vec3::ZERO, Vec3::Z, small) / expected - 1.0).abs() < 0.03);
    }
}
