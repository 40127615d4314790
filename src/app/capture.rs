//! Pictures of what is shown, with what is needed to make them again.

use super::headless::run_stats;
use super::level::Level;
use crate::console::Cvars;
use crate::engine::Engine;
use crate::output::{atomic, exr_file, png_file};
use crate::render::gpu_renderer::{film, shown_film};
use crate::render::view_state::ViewState;
use crate::scene::camera::Camera;
use crate::scene::clock::Clock;
use std::path::Path;

/// The display image as it is shown, row by row from the top. The GPU must be done with it.
///
/// # Errors
/// One sentence of the device's.
pub fn display_pixels(view: &ViewState) -> Result<Vec<[u8; 3]>, String> {
    let bytes = view.gbuffer.display().read_back(0).map_err(|e| e.to_string())?;
    Ok(bytes.chunks_exact(4).map(|p| [p[0], p[1], p[2]]).collect())
}

/// Where and how a picture was taken, as text chunks of a PNG or attributes of an EXR.
fn texts(
    level: &Level,
    (camera, clock): (&Camera, Clock),
    engine: &Engine,
    cvars: &Cvars,
) -> Vec<(&'static str, String)> {
    let size = level.realtime.view.gbuffer.size;
    let run = run_stats(engine, cvars, &level.map, size, Vec::new());
    let c = camera;
    vec![
        ("Software", concat!("q3rays ", env!("CARGO_PKG_VERSION")).to_owned()),
        ("map", run.map),
        (
            "camera",
            format!(
                "{},{},{},{},{},{}",
                c.eye[0], c.eye[1], c.eye[2], c.pitch, c.yaw, c.roll
            ),
        ),
        ("time", clock.seconds().to_string()),
        ("samples", level.accumulated.max(1).to_string()),
        ("device", format!("{} ({}), {}", run.device, run.driver, run.backend)),
        ("settings", serde_json::Value::Object(run.settings).to_string()),
    ]
}

/// Writes what was shown last: the display's picture as PNG, or with `radiance` linear radiance as EXR.
///
/// # Errors
/// One sentence of the device's or the file system's.
pub fn screenshot(
    level: &mut Level,
    view: (&Camera, Clock),
    engine: &Engine,
    cvars: &Cvars,
    path: &Path,
    radiance: bool,
) -> Result<(), String> {
    let failed = |e: &dyn std::fmt::Display| e.to_string();
    level.realtime.finish().map_err(|e| failed(&e))?;
    atomic::create_parent(path).map_err(|e| failed(&e))?;
    let texts = texts(level, view, engine, cvars);
    let view = &level.realtime.view;
    if radiance {
        let film = match level.accumulated {
            0 => shown_film(view),
            count => film(view, count),
        };
        let film = film.map_err(|e| failed(&e))?;
        exr_file::write_film(path, &film, &texts).map_err(|e| failed(&e))
    } else {
        let (width, height) = view.gbuffer.size;
        png_file::write(path, width, height, &display_pixels(view)?, &texts).map_err(|e| failed(&e))
    }
}
