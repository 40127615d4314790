//! Recovered lights as lights of a scene.

use super::known::{in_lights_file, light_terms};
use super::lights_file::{FileLight, LightsFile, Scale, Spot};
use super::recover::Recovery;
use super::spot::Cone;
use crate::assets::bsp::Bounds;
use crate::scene::Scene;
use crate::scene::clusters::LightReach;
use crate::scene::lights::{LightSource, LightTable, POINT_RADIUS};
use crate::scene::records::{LIGHT_SPHERE, LIGHT_SPOT, Light, NONE};
use glam::Vec3;
use std::collections::HashMap;

/// A point light of N has luxel value 7500·N·cosθ/d², 255 of which are 1.
const POINT_SCALE: f32 = 7500.0 / 255.0;
/// The compiler's cone is this much wider at the target than the key says, units.
const CONE_MARGIN: f32 = 16.0;

/// The sphere that stands for a light of a lights file, as for a light entity: irradiance/π at distance d is
/// 7500·photons/(255·d²) in luxel units. The compiler's least distance of 16 units is not kept: what is nearer is brighter.
pub fn sphere(light: &FileLight) -> Light {
    let radius = light.radius.unwrap_or(POINT_RADIUS);
    let axis = light.spot.map(|s| s.target - light.origin).filter(|a| *a != Vec3::ZERO);
    let cone = match (axis, light.spot) {
        (Some(axis), Some(spot)) => (spot.cone + CONE_MARGIN) / axis.length(),
        _ => 0.0,
    };
    Light {
        kind: LIGHT_SPHERE,
        flags: if axis.is_some() { LIGHT_SPOT } else { 0 },
        triangle: NONE,
        material: NONE,
        p0: light.origin.into(),
        size: radius,
        p1: axis.unwrap_or(Vec3::ZERO).normalize_or_zero().into(),
        instance: NONE,
        p2: [cone, 0.0, light.photons / 255.0],
        padding: 0,
        radiance: (light.color * (POINT_SCALE * light.photons / (radius * radius))).into(),
        scale: 1.0,
    }
}

/// A cone as light entities say it.
fn spot(position: Vec3, cone: &Cone) -> Spot {
    // Any distance would do that leaves a radius after the compiler's margin is taken off.
    let distance = (2.0 * CONE_MARGIN / cone.slope).max(128.0);
    Spot {
        target: position + cone.axis * distance,
        cone: distance * cone.slope - CONE_MARGIN,
    }
}

/// Gives a scene the lights of a lights file: with `known` besides those that it has, scaled as the file says, else alone.
pub fn apply(scene: &mut Scene, file: &LightsFile, known: bool) {
    let mut table = if known {
        let scales: HashMap<&str, f32> = file.scales.iter().map(|s| (s.name.as_str(), s.scale)).collect();
        let terms = light_terms(scene);
        scene
            .lights
            .scaled(|i| terms[i].as_deref().and_then(|t| scales.get(t)).copied().unwrap_or(1.0))
    } else {
        LightTable::default()
    };
    for light in &file.lights {
        let record = sphere(light);
        let around = Bounds {
            min: light.origin - record.size,
            max: light.origin + record.size,
        };
        let clusters = scene.bsp.cluster_at(light.origin);
        let clusters = clusters.map(|_| scene.clusters.in_box(&scene.bsp, around));
        table.push(LightSource::Recovered, record, LightReach::still(clusters, None));
    }
    if file.sky != Vec3::ZERO {
        let standings = scene.standings();
        table.add_even_sky(&scene.light_inputs(&standings), file.sky);
    }
    scene.relight(table);
}

impl From<&Recovery> for LightsFile {
    fn from(r: &Recovery) -> Self {
        Self {
            map: r.map.clone(),
            encoding: Some(r.encoding),
            ambient: r.ambient,
            sky: r.sky,
            indirect: r.indirect,
            scales: r
                .scales
                .iter()
                .map(|s| Scale {
                    name: in_lights_file(&s.name),
                    scale: s.scale,
                    share: Some(s.share as f32),
                })
                .collect(),
            lights: r
                .lights
                .iter()
                .map(|l| FileLight {
                    origin: l.position,
                    photons: l.power.max_element(),
                    color: l.power / l.power.max_element(),
                    radius: None,
                    spot: l.cone.map(|c| spot(l.position, &c)),
                    share: Some(l.share as f32),
                })
                .collect(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sphere_gives_the_light_entitys_irradiance() {
        let light = FileLight {
            origin: Vec3::new(1.0, 2.0, 3.0),
            photons: 300.0,
            color: Vec3::new(1.0, 0.5, 0.25),
            radius: Some(6.0),
            spot: None,
            share: None,
        };
        let record = sphere(&light);
        let d2 = 200.0f32 * 200.0;
        // A distant sphere of radiance L gives L·r²/d².
        let at = Vec3::from(record.radiance) * (record.size * record.size / d2);
        assert!(at.abs_diff_eq(light.color * (7500.0 * 300.0 / 255.0 / d2), 1e-5));
    }
}
