//! What culling lights does to denoised frames: their error, and how much they flicker (the thesis's Fig. 7.4).

use super::stage::{Figures, Stage};
use crate::render::scene_gpu::RenderError;
use crate::render::settings::{LightSampling, Settings};
use crate::scene::camera::Camera;
use serde::Serialize;

/// Frames of a still view before it is looked at, and then from one to the next.
pub const FRAMES: u32 = 64;
const FLICKER_FRAMES: u32 = 8;

/// A way to choose lights, and which of them may be chosen.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Culled {
    /// `rt_lightSampling`.
    pub sampling: &'static str,
    /// `rt_cullLights`.
    pub cull_lights: u32,
    /// Of one raw frame, and of the denoised view after [`FRAMES`] frames.
    pub raw: Figures,
    pub denoised: Figures,
    /// Mean change of a pixel from frame to frame over the mean of the truth, without anti-aliasing.
    pub flicker: f64,
    /// Median time of the direct stage, milliseconds.
    pub direct_ms: Option<f64>,
}

/// The measurements of a view.
#[derive(Clone, Debug, Serialize)]
pub struct CullingReport {
    pub map: String,
    pub lights: usize,
    pub culled: Vec<Culled>,
}

/// Measures a view.
///
/// # Errors
/// [`RenderError`] of the device.
pub fn run(stage: &mut Stage, map: &str, lights: usize, camera: &Camera) -> Result<CullingReport, RenderError> {
    // One place per pixel: only light is left to chance.
    stage.base = Settings {
        taa: false,
        antialiasing: false,
        ..stage.base
    };
    let truth = stage.references(camera)?;
    let mut culled = Vec::new();
    let ways = [
        ("uniform", LightSampling::Uniform),
        ("power", LightSampling::Power),
        ("bvh", LightSampling::Bvh),
        ("reservoir", LightSampling::Reservoir),
    ];
    for (sampling, light_sampling) in ways {
        for cull_lights in 0..3 {
            let settings = Settings {
                light_sampling,
                cull_lights,
                ..stage.base
            };
            let raw = stage.accumulated(camera, &settings, 1)?;
            let raw = stage.figures(&raw, &truth);
            let mut ended = Vec::new();
            for index in 0..FRAMES {
                ended.extend(stage.frame(camera, &settings, index, 0)?);
            }
            let mut before = stage.shown()?;
            let denoised = stage.figures(&before, &truth);
            let mut change = 0.0;
            for index in FRAMES..FRAMES + FLICKER_FRAMES {
                ended.extend(stage.frame(camera, &settings, index, 0)?);
                let now = stage.shown()?;
                let pairs = now.iter().flatten().zip(before.iter().flatten());
                change += pairs.map(|(a, b)| f64::from((a - b).abs())).sum::<f64>() / (3 * now.len()) as f64;
                before = now;
            }
            let mut times: Vec<f64> = ended
                .iter()
                .filter_map(|f| f.passes.get("direct").and_then(serde_json::Value::as_f64))
                .collect();
            times.sort_by(f64::total_cmp);
            culled.push(Culled {
                sampling,
                cull_lights,
                raw,
                denoised,
                flicker: change / f64::from(FLICKER_FRAMES) / truth.mean,
                direct_ms: times.get(times.len() / 2).copied(),
            });
        }
    }
    Ok(CullingReport {
        map: map.to_owned(),
        lights,
        culled,
    })
}
