//! A map as glTF 2.0, so that any renderer can check this one.
//!
//! Triangles stand where they are at a moment, in world units and z up below one node that turns and scales them to glTF's metres
//! and y up. What glTF has no words for is in `extras`, in luxel units: see `docs/benchmark.md`.

mod document;
mod lights;
mod materials;
mod surfaces;

use crate::reference::trace::Tracer;
use crate::render::settings::Settings;
use crate::scene::Scene;
use crate::scene::camera::Camera;
use document::Document;
use glam::{Mat3, Quat};
use serde_json::json;
use thiserror::Error;

/// Metres per unit: a unit is taken for an inch, at which players are 1.42 m tall and lamps and doors look right.
pub const METRES_PER_UNIT: f32 = 0.0254;

/// Why a map could not be exported.
#[derive(Debug, Error)]
pub enum ExportError {
    #[error("the exported map has {bytes} bytes, and a GLB file holds 4 GiB at most")]
    TooLarge { bytes: u64 },
    #[error("cannot encode the texture \"{name}\": {reason}")]
    Texture { name: String, reason: String },
    #[error("cannot write glTF: {0}")]
    Format(#[from] gltf::Error),
}

/// Writes a lit scene as it is at the settings' time, seen by `camera`, as GLB.
///
/// # Errors
/// [`ExportError`] where it does not fit into the format.
pub fn glb(scene: &Scene, settings: &Settings, camera: &Camera) -> Result<Vec<u8>, ExportError> {
    let tracer = Tracer::new(scene).at(scene, settings, camera);
    let mut document = Document::default();
    let mut nodes = surfaces::add(&mut document, scene, &tracer)?;
    nodes.extend(lights::add(&mut document, scene, &tracer));
    nodes.push(add_camera(&mut document, camera));
    let root = document.push(
        "nodes",
        json!({
            "name": scene.name,
            "children": nodes,
            // z up to y up.
            "rotation": Quat::from_rotation_x(-std::f32::consts::FRAC_PI_2).to_array(),
            "scale": [METRES_PER_UNIT, METRES_PER_UNIT, METRES_PER_UNIT],
        }),
    );
    document.set("scenes", json!([{ "name": scene.name, "nodes": [root] }]));
    document.set("scene", json!(0));
    document.set("asset", asset(scene, settings, camera));
    document.glb()
}

fn add_camera(document: &mut Document, camera: &Camera) -> usize {
    let axes = camera.axes();
    let half_width = (camera.fov * 0.5).to_radians().tan();
    // Vertical, for the widescreen that most viewers open; the horizontal angle is in the asset's extras.
    let vertical = 2.0 * (half_width * 9.0 / 16.0).atan();
    let number = document.push(
        "cameras",
        json!({
            "name": "view",
            "type": "perspective",
            "perspective": { "yfov": vertical, "aspectRatio": 16.0 / 9.0, "znear": 0.01, "zfar": 4000.0 },
        }),
    );
    document.push(
        "nodes",
        json!({
            "name": "view",
            "camera": number,
            "translation": camera.eye,
            // glTF's cameras look along −z with y up.
            "rotation": Quat::from_mat3(&Mat3::from_cols(axes.right, axes.up, -axes.forward)).to_array(),
        }),
    )
}

fn asset(scene: &Scene, settings: &Settings, camera: &Camera) -> serde_json::Value {
    json!({
        "version": "2.0",
        "generator": concat!("q3rays ", env!("CARGO_PKG_VERSION")),
        "extras": { "q3rays": {
            "map": scene.name,
            "time": settings.clock.seconds(),
            "units": "world units, z up; radiance in luxel units (1: a white surface under irradiance pi)",
            "metres_per_unit": METRES_PER_UNIT,
            "camera": {
                "eye": camera.eye, "pitch": camera.pitch, "yaw": camera.yaw, "roll": camera.roll,
                "fov": camera.fov,
            },
            "suns": lights::suns(scene),
            "domes": lights::domes(scene),
            "spheres": lights::spheres(scene),
        } },
    })
}
