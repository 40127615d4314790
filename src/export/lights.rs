//! Suns and point lights as `KHR_lights_punctual`, and exactly in `extras`. Emissive surfaces are materials.

use super::METRES_PER_UNIT;
use super::document::Document;
use crate::reference::trace::Tracer;
use crate::scene::Scene;
use crate::scene::records::{
    LIGHT_DOME, LIGHT_EVEN, LIGHT_LINEAR, LIGHT_NO_COSINE, LIGHT_SPHERE, LIGHT_SPOT, LIGHT_SUN, Light,
};
use glam::{Quat, Vec3};
use serde_json::{Value, json};
use std::f32::consts::PI;

const EXTENSION: &str = "KHR_lights_punctual";

/// Adds a node for each light that is no surface; returns the nodes.
pub fn add(document: &mut Document, scene: &Scene, tracer: &Tracer) -> Vec<usize> {
    let mut lights = Vec::new();
    let mut nodes = Vec::new();
    for number in 0..scene.lights.lights.len() as u32 {
        let light = tracer.light(scene, number);
        let Some((value, place)) = punctual(&light) else {
            continue;
        };
        let mut node = json!({ "name": value["name"], "extensions": { EXTENSION: { "light": lights.len() } } });
        for (member, value) in place {
            node[member] = value;
        }
        lights.push(value);
        nodes.push(document.push("nodes", node));
    }
    if !lights.is_empty() {
        document.use_extension(EXTENSION, json!({ "lights": lights }));
    }
    nodes
}

/// Colour with a largest component of 1, and the factor.
fn parted(value: Vec3) -> (Vec3, f32) {
    let factor = value.max_element().max(f32::MIN_POSITIVE);
    ((value / factor).max(Vec3::ZERO), factor)
}

/// Rotation of a light, which shines along −z by itself.
fn shining_along(direction: Vec3) -> Value {
    json!(Quat::from_rotation_arc(Vec3::NEG_Z, direction).to_array())
}

/// The nearest that the extension has, and where its node stands. 1 luxel unit is taken for 1 cd/m².
fn punctual(light: &Light) -> Option<(Value, Vec<(&'static str, Value)>)> {
    let radiance = Vec3::from(light.radiance);
    match light.kind {
        LIGHT_SUN => {
            let (colour, factor) = parted(radiance);
            let to_sun = Vec3::from(light.p0);
            let value = json!({
                "name": "sun", "type": "directional", "color": colour.to_array(), "intensity": factor * PI,
            });
            Some((value, vec![("rotation", shining_along(-to_sun))]))
        }
        LIGHT_SPHERE => {
            let flux = if light.flags & LIGHT_LINEAR != 0 {
                // What it gives at a distance of 64 units, by the inverse square.
                radiance * ((light.p2[2] - 64.0 * light.p2[1]).max(0.0) * 64.0 * 64.0)
            } else {
                radiance * (light.size * light.size)
            };
            let (colour, factor) = parted(flux * (PI * METRES_PER_UNIT * METRES_PER_UNIT));
            let mut value = json!({
                "name": "light", "type": "point", "color": colour.to_array(), "intensity": factor,
            });
            let mut place = vec![("translation", json!(light.p0))];
            if light.flags & LIGHT_SPOT != 0 {
                let outer = light.p2[0].atan().clamp(1e-3, PI * 0.5 - 1e-3);
                value["type"] = json!("spot");
                value["spot"] = json!({ "innerConeAngle": outer * 0.75, "outerConeAngle": outer });
                let axis = Vec3::from(light.p1);
                place.push(("rotation", shining_along(axis)));
            }
            Some((value, place))
        }
        _ => None,
    }
}

/// Suns: they shine through sky faces alone. `direction`: to the middle of the disc, which is even in azimuth and elevation.
pub fn suns(scene: &Scene) -> Vec<Value> {
    let lights = scene.lights.lights.iter().filter(|l| l.kind == LIGHT_SUN);
    lights
        .map(|l| {
            json!({
                "direction": l.p0, "azimuth": l.p1[0], "elevation": l.p1[1], "angular_radius": l.p1[2],
                "irradiance_over_pi": l.radiance,
            })
        })
        .collect()
}

/// What is behind all sky faces alike: `even`, or V/(π·cos elevation) in the upper half.
pub fn domes(scene: &Scene) -> Vec<Value> {
    let mut found: Vec<Value> = Vec::new();
    for l in scene.lights.lights.iter().filter(|l| l.kind == LIGHT_DOME) {
        let value = json!({ "radiance": l.radiance, "even": l.flags & LIGHT_EVEN != 0 });
        if !found.contains(&value) {
            found.push(value);
        }
    }
    found
}

/// Small spheres that stand for point lights; they occlude nothing.
pub fn spheres(scene: &Scene) -> Vec<Value> {
    let lights = scene.lights.lights.iter().filter(|l| l.kind == LIGHT_SPHERE);
    lights
        .map(|l| {
            let has = |flag| l.flags & flag != 0;
            json!({
                "centre": l.p0, "radius": l.size, "radiance": l.radiance,
                "spot": has(LIGHT_SPOT).then(|| json!({ "axis": l.p1, "cone_radius_at_1": l.p2[0], "edge": 32.0 })),
                "linear": has(LIGHT_LINEAR).then(|| json!({ "at_0": l.p2[2], "fade": l.p2[1] })),
                "receiver_cosine": !has(LIGHT_NO_COSINE),
            })
        })
        .collect()
}
