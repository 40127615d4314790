//! Views and sizes as the command line names them.

use super::args::CliError;
use crate::scene::Scene;
use crate::scene::camera::Camera;
use crate::scene::spawns::{overview, view};

/// Arguments that name a view of a map.
#[derive(clap::Args)]
pub struct ViewArgs {
    /// Eye and angles to look from: X,Y,Z,PITCH,YAW[,ROLL] (units, degrees)
    #[arg(
        long,
        value_name = "X,Y,Z,PITCH,YAW[,ROLL]",
        allow_hyphen_values = true,
        conflicts_with = "spawn"
    )]
    pub camera: Option<String>,
    /// Spawn point to look from, counted from 0
    #[arg(long, value_name = "N")]
    pub spawn: Option<usize>,
}

impl ViewArgs {
    /// Whether a view is named.
    pub fn named(&self) -> bool {
        self.camera.is_some() || self.spawn.is_some()
    }

    /// The view that is named, or that of the first spawn point. `fov`: horizontal, degrees.
    ///
    /// # Errors
    /// [`CliError`] for numbers that name none.
    pub fn camera(&self, scene: &Scene, fov: f32) -> Result<Camera, CliError> {
        match &self.camera {
            Some(text) => parse_camera(text, fov),
            None => at_spawn(scene, self.spawn, fov),
        }
    }
}

/// Parses `X,Y,Z,PITCH,YAW[,ROLL]`.
///
/// # Errors
/// [`CliError::Usage`].
pub fn parse_camera(text: &str, fov: f32) -> Result<Camera, CliError> {
    let numbers: Vec<f32> = text
        .split(',')
        .map(|n| n.trim().parse::<f32>().ok().filter(|x| x.is_finite()))
        .collect::<Option<_>>()
        .unwrap_or_default();
    let ([x, y, z, pitch, yaw], roll) = match numbers[..] {
        [x, y, z, pitch, yaw] => ([x, y, z, pitch, yaw], 0.0),
        [x, y, z, pitch, yaw, roll] => ([x, y, z, pitch, yaw], roll),
        _ => {
            return Err(CliError::Usage(format!(
                "--camera takes five or six numbers X,Y,Z,PITCH,YAW[,ROLL], not \"{text}\""
            )));
        }
    };
    Ok(Camera {
        eye: [x, y, z],
        pitch,
        yaw,
        roll,
        fov,
    })
}

/// The view from a spawn point, or from the first.
///
/// # Errors
/// [`CliError::Failed`] where there is no such spawn point.
pub fn at_spawn(scene: &Scene, spawn: Option<usize>, fov: f32) -> Result<Camera, CliError> {
    match (scene.spawns.get(spawn.unwrap_or(0)), scene.spawns.len()) {
        (Some(s), _) => Ok(view(s, fov)),
        (None, 0) if spawn.is_none() => {
            eprintln!("warning: {} has no spawn point; looking from its middle", scene.name);
            Ok(overview(&scene.bsp, fov))
        }
        (None, n) => Err(CliError::Failed(format!(
            "{} has {n} spawn points, so there is no number {}",
            scene.name,
            spawn.unwrap_or(0)
        ))),
    }
}

/// Largest image edge, pixels: what random-number addresses and GPUs hold.
const MAX_EDGE: u32 = 16_384;

/// Parses `WxH`.
///
/// # Errors
/// What was expected.
pub fn parse_size(text: &str) -> Result<(u32, u32), String> {
    let parsed = text
        .split_once(['x', 'X'])
        .and_then(|(w, h)| Some((w.parse::<u32>().ok()?, h.parse::<u32>().ok()?)));
    match parsed {
        Some((w, h)) if (1..=MAX_EDGE).contains(&w) && (1..=MAX_EDGE).contains(&h) => Ok((w, h)),
        Some(_) => Err(format!("edges must be 1 to {MAX_EDGE} pixels")),
        None => Err("expected WIDTHxHEIGHT, such as 1280x720".to_owned()),
    }
}
