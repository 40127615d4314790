//! Reflection and refraction: Fresnel's equations and a GGX lobe. Counterpart of `shaders/include/optics.glsl`.

use super::sampling::tangents;
use glam::{Vec2, Vec3};
use std::f32::consts::{PI, TAU};

/// Index of refraction of water and slime.
pub const WATER: f32 = 1.333;
/// Index of refraction of glass.
pub const GLASS: f32 = 1.5;
/// Roughness of environment-mapped stages whose script gives none.
pub const ROUGHNESS: f32 = 0.2;
/// Least width of a lobe: narrower ones are too peaked for single precision.
pub const LEAST_ALPHA: f32 = 1e-3;

/// Share of unpolarised light that a smooth interface reflects. `cosine`: of the angle to the normal on the side where the
/// light comes from; `eta`: index of refraction of that side over the other's. 1 where nothing gets through.
pub fn fresnel(cosine: f32, eta: f32) -> f32 {
    let c = cosine.clamp(0.0, 1.0);
    let sin2 = eta * eta * (1.0 - c * c);
    if sin2 >= 1.0 {
        return 1.0;
    }
    let t = (1.0 - sin2).sqrt();
    let s = (eta * c - t) / (eta * c + t);
    let p = (c - eta * t) / (c + eta * t);
    0.5 * (s * s + p * p)
}

/// What both sides of a thin pane reflect together, light that goes to and fro between them included.
pub fn fresnel_pane(cosine: f32, ior: f32) -> f32 {
    let f = fresnel(cosine, 1.0 / ior);
    2.0 * f / (1.0 + f)
}

/// Direction behind an interface; `None` where nothing gets through. `normal` is on the side of the ray's origin.
pub fn refracted(direction: Vec3, normal: Vec3, eta: f32) -> Option<Vec3> {
    let c = -normal.dot(direction);
    let k = 1.0 - eta * eta * (1.0 - c * c);
    (k > 0.0).then(|| (direction * eta + normal * (eta * c - k.sqrt())).normalize())
}

/// Mirrored at a plane.
pub fn reflected(direction: Vec3, normal: Vec3) -> Vec3 {
    direction - normal * (2.0 * normal.dot(direction))
}

/// Fresnel's factor after Schlick (1994), from the one at normal incidence.
pub fn schlick(at_normal: Vec3, cosine: f32) -> Vec3 {
    let x = 1.0 - cosine.clamp(0.0, 1.0);
    let x2 = x * x;
    at_normal + (Vec3::ONE - at_normal) * (x2 * x2 * x)
}

/// Microfacets of GGX distribution (Walter et al. 2007), seen from `view`.
#[derive(Clone, Copy, Debug)]
pub struct Lobe {
    pub normal: Vec3,
    /// Unit vector to where the light goes.
    pub view: Vec3,
    /// Width: the square of the roughness.
    pub alpha: f32,
}

impl Lobe {
    fn cosine(&self) -> f32 {
        self.normal.dot(self.view).max(1e-4)
    }

    /// Smith's Λ of a direction.
    fn lambda(&self, cosine: f32) -> f32 {
        let c2 = cosine * cosine;
        let a2 = self.alpha * self.alpha;
        0.5 * ((1.0 + a2 * ((1.0 - c2) / c2)).sqrt() - 1.0)
    }

    /// Density of microfacets with a normal.
    fn density(&self, half: Vec3) -> f32 {
        let c = self.normal.dot(half);
        let a2 = self.alpha * self.alpha;
        // 1 − c² of a unit vector, without the cancellation at its peak.
        let s2 = (half - self.normal * c).length_squared();
        let d = c * c * a2 + s2;
        if c > 0.0 { a2 / (PI * d * d) } else { 0.0 }
    }

    /// A direction of light, by normals visible from `view` (Heitz 2018), and what reaches `view` over the pdf, Fresnel's
    /// factor left out; `None` below the surface.
    pub fn sample(&self, u: Vec2) -> Option<(Vec3, f32)> {
        let (t1, t2) = tangents(self.normal);
        let v = Vec3::new(self.view.dot(t1), self.view.dot(t2), self.cosine());
        let stretched = Vec3::new(self.alpha * v.x, self.alpha * v.y, v.z).normalize();
        let across = stretched.x * stretched.x + stretched.y * stretched.y;
        let a = if across > 0.0 {
            Vec3::new(-stretched.y, stretched.x, 0.0) / across.sqrt()
        } else {
            Vec3::X
        };
        let b = stretched.cross(a);
        let r = u.x.sqrt();
        let (sin, cos) = (TAU * u.y).sin_cos();
        let s = 0.5 * (1.0 + stretched.z);
        let x = r * cos;
        let y = (1.0 - s) * (1.0 - x * x).max(0.0).sqrt() + s * r * sin;
        let h = a * x + b * y + stretched * (1.0 - x * x - y * y).max(0.0).sqrt();
        let h = Vec3::new(self.alpha * h.x, self.alpha * h.y, h.z.max(0.0)).normalize();
        let half = t1 * h.x + t2 * h.y + self.normal * h.z;
        let direction = reflected(-self.view, half).normalize();
        let out = self.normal.dot(direction);
        if out <= 0.0 {
            return None;
        }
        let (l, w) = (self.lambda(self.cosine()), self.lambda(out));
        Some((direction, (1.0 + l) / (1.0 + l + w)))
    }

    /// pdf of [`Self::sample`], solid angle.
    pub fn pdf(&self, direction: Vec3) -> f32 {
        let sum = self.view + direction;
        if self.normal.dot(direction) <= 0.0 || sum == Vec3::ZERO {
            return 0.0;
        }
        let c = self.cosine();
        self.density(sum.normalize()) / ((1.0 + self.lambda(c)) * 4.0 * c)
    }

    /// BRDF, Fresnel's factor left out, 1/sr.
    pub fn brdf(&self, direction: Vec3) -> f32 {
        let out = self.normal.dot(direction);
        let sum = self.view + direction;
        if out <= 0.0 || sum == Vec3::ZERO {
            return 0.0;
        }
        let c = self.cosine();
        let masking = 1.0 + self.lambda(c) + self.lambda(out);
        self.density(sum.normalize()) / (4.0 * c * out * masking)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::sampling::{key, unit};

    #[test]
    fn fresnel_has_its_textbook_values() {
        assert!((fresnel(1.0, 1.0 / 1.5) - 0.04).abs() < 1e-6);
        assert!((fresnel(1.0, 1.5) - 0.04).abs() < 1e-6);
        assert_eq!(fresnel(0.0, 1.0 / 1.5), 1.0);
        // Beyond the critical angle, 41.8° in glass.
        assert_eq!(fresnel(42f32.to_radians().cos(), 1.5), 1.0);
        assert!(fresnel(41f32.to_radians().cos(), 1.5) < 1.0);
        // At Brewster's angle only one polarisation is reflected: 0.0740 of all light.
        assert!((fresnel(1.5f32.atan().cos(), 1.0 / 1.5) - 0.0740).abs() < 1e-4);
        for i in 0..=1000 {
            let c = i as f32 / 1000.0;
            for eta in [1.0 / 1.5, 1.5, 1.0 / 1.333, 1.333] {
                let f = fresnel(c, eta);
                assert!((0.0..=1.0).contains(&f), "{c} {eta}: {f}");
                // The same from both sides of a ray's way.
                let d = Vec3::new((1.0 - c * c).sqrt(), 0.0, -c);
                match refracted(d, Vec3::Z, eta) {
                    Some(t) => assert!((fresnel(-t.z, 1.0 / eta) - f).abs() < 1e-3, "{c} {eta}"),
                    None => assert_eq!(f, 1.0),
                }
            }
        }
    }

    #[test]
    fn refraction_is_snells() {
        let d = Vec3::new(0.6, 0.0, -0.8);
        let t = refracted(d, Vec3::Z, 1.0 / 1.333).unwrap();
        assert!((t.x - 0.6 / 1.333).abs() < 1e-6 && t.z < 0.0);
        assert!(refracted(Vec3::new(0.8, 0.0, -0.6), Vec3::Z, 1.333).is_none());
        // In and out again through parallel sides: the same direction.
        let out = refracted(t, Vec3::Z, 1.333).unwrap();
        assert!((out - d).length() < 1e-6);
    }

    #[test]
    fn lobes_keep_energy_and_their_pdf_is_that_of_their_samples() {
        for (alpha, cosine) in [(0.04, 0.9f32), (0.04, 0.2), (0.3, 0.7), (1.0, 0.5)] {
            let lobe = Lobe {
                normal: Vec3::Z,
                view: Vec3::new((1.0 - cosine * cosine).sqrt(), 0.0, cosine),
                alpha,
            };
            let n = 20_000;
            let (mut sum, mut inverse) = (0.0f64, 0.0f64);
            for i in 0..n {
                let u = Vec2::new(unit(key(1, i, 0)), unit(key(1, i, 1)));
                let Some((d, weight)) = lobe.sample(u) else { continue };
                assert!((0.0..=1.0 + 1e-5).contains(&weight), "{weight}");
                // The weight is what the definition says: BRDF · cosine / pdf.
                let want = lobe.brdf(d) * d.z / lobe.pdf(d);
                assert!(
                    (weight - want).abs() < 2e-3 * want.max(1e-3),
                    "{alpha} {cosine}: {weight} {want}"
                );
                sum += f64::from(weight);
                if lobe.pdf(d) > 1e-3 {
                    inverse += f64::from(1.0 / lobe.pdf(d));
                }
            }
            let albedo = sum / f64::from(n);
            assert!(albedo <= 1.0 + 1e-5, "{albedo}");
            if alpha <= 0.04 {
                assert!(albedo > 0.95, "{alpha} {cosine}: {albedo}");
            }
            // The inverse of a pdf integrates to the solid angle it covers.
            if alpha == 1.0 {
                assert!((inverse / f64::from(n) / f64::from(TAU) - 1.0).abs() < 0.1, "{inverse}");
            }
        }
    }
}
