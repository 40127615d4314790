//! The experiments of the thesis by their names: figures 7.1 to 7.14 of its evaluation, and the worst case of its section 7.5,
//! on any map.

use super::stage::Stage;
use super::statistics::median;
use crate::bench::lights::Mode;
use crate::bench::sweep::Config;
use crate::output::stats::FrameStats;
use crate::render::scene_gpu::RenderError;
use crate::render::settings::{AmbientLight, LightTerm, Secondary, Settings};
use crate::scene::camera::Camera;
use serde::Serialize;

/// Sizes of displays: figures 7.7 to 7.9.
pub const SIZES: [(u32, u32); 3] = [(1280, 720), (1920, 1080), (2560, 1440)];
/// The experiment of the thesis that shows one light alone.
pub const SOLO: &str = "fig7.12";
/// The experiment of the thesis's section 7.5, which wants a view of glass.
pub const GLASS: &str = "sec7.5";
/// Samples whose mean is the ground truth, as in the thesis.
pub const TRUTH: u32 = 1500;
/// Numbers of samples of figures 7.10 and 7.11.
pub const SAMPLES: [u32; 5] = [1, 2, 4, 8, 16];
/// Frames until a picture with a history is taken, and frames whose time is.
const SETTLE: u32 = 40;
const TIMED: u32 = 16;

/// How a panel's picture comes about.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Show {
    /// As it is shown after some frames.
    Frame,
    /// The mean of many samples.
    Truth,
}

/// One picture of a figure.
#[derive(Clone, Copy, Debug)]
pub struct Panel {
    pub label: &'static str,
    pub show: Show,
    pub change: fn(Settings) -> Settings,
    /// Steps towards what is under the crosshair, as a share of the way there.
    pub closer: f32,
    /// Shows something else than the truth does.
    pub apart: bool,
}

/// What a figure is made of.
pub enum Figure {
    /// Pictures side by side, with their errors against the last one where that is a mean.
    Pictures(Vec<Panel>),
    /// Frame times at [`SIZES`].
    Sizes(Vec<Panel>),
    /// Time and likeness against the number of samples.
    Samples,
    /// Frame times along the tour at 1280x720.
    Walk(Panel),
}

const fn panel(label: &'static str, show: Show, change: fn(Settings) -> Settings) -> Panel {
    Panel {
        label,
        show,
        change,
        closer: 0.0,
        apart: false,
    }
}

fn lights(s: Settings, mode: Mode, lights: u32, denoiser: bool, taa: bool) -> Settings {
    Config {
        mode,
        lights,
        candidates: s.candidates,
        samples: 1,
        culling: s.cull_lights,
        denoiser,
        taa,
        scale: 1.0,
    }
    .settings(&s)
}

fn all(s: Settings) -> Settings {
    lights(s, Mode::Uniform, 0, false, false)
}

/// One light at random, as the thesis takes it.
fn one(s: Settings) -> Settings {
    lights(s, Mode::Uniform, 1, false, false)
}

fn one_denoised(s: Settings) -> Settings {
    lights(s, Mode::Uniform, 1, true, true)
}

fn unculled(s: Settings) -> Settings {
    Settings { cull_lights: 0, ..s }
}

const ALL: Panel = panel("all lights", Show::Frame, all);
const ONE: Panel = panel("one light", Show::Frame, one);
const DENOISED: Panel = panel("one light, denoiser", Show::Frame, one_denoised);
const ACCUMULATED: Panel = panel("truth, all lights", Show::Truth, all);

fn without_secondary(s: Settings) -> Settings {
    Settings {
        secondary: Secondary::Off,
        ..s
    }
}

/// One sample of light alone, of all lights or of one.
fn alone(s: Settings, light_term: LightTerm, solo_light: Option<u32>) -> Settings {
    Settings {
        solo_light,
        light_term,
        white: true,
        ambient: AmbientLight::Off,
        ..one(s)
    }
}

const fn term(label: &'static str, change: fn(Settings) -> Settings) -> Panel {
    Panel {
        apart: true,
        ..panel(label, Show::Frame, change)
    }
}

const fn nearer(label: &'static str, closer: f32) -> Panel {
    Panel {
        closer,
        apart: true,
        ..panel(label, Show::Frame, |s| s)
    }
}

/// The figure of a name; `None` for others.
pub fn figure(name: &str) -> Option<(&'static str, Figure)> {
    Some(match name {
        "fig7.1" => (
            "the original beside ours",
            Figure::Pictures(vec![panel("ours", Show::Frame, |s| s)]),
        ),
        "fig7.2" => (
            "all lights, all lights with TAA, and the truth",
            Figure::Pictures(vec![
                ALL,
                panel("all lights, TAA", Show::Frame, |s| {
                    lights(s, Mode::Uniform, 0, false, true)
                }),
                ACCUMULATED,
            ]),
        ),
        "fig7.3" => (
            "unlit, all lights, one light, one light denoised",
            Figure::Pictures(vec![
                panel("unlit", Show::Frame, |s| Settings {
                    illumination: false,
                    ..s
                }),
                ALL,
                ONE,
                DENOISED,
                ACCUMULATED,
            ]),
        ),
        "fig7.4" => (
            "culling off and on, raw and denoised",
            Figure::Pictures(vec![
                panel("one light, culling off", Show::Frame, |s| unculled(one(s))),
                panel("one light, culling off, denoiser", Show::Frame, |s| {
                    unculled(one_denoised(s))
                }),
                panel("one light, culling on", Show::Frame, one),
                panel("one light, culling on, denoiser", Show::Frame, one_denoised),
                ACCUMULATED,
            ]),
        ),
        "fig7.5" => (
            "what is seen through glass, without the secondary stage and with it",
            Figure::Pictures(vec![
                panel("secondary stage off", Show::Frame, without_secondary),
                panel("secondary stage on", Show::Frame, |s| s),
            ]),
        ),
        "fig7.6" => (
            "the scene of the performance analysis",
            Figure::Pictures(vec![panel("as it is shown", Show::Frame, |s| s)]),
        ),
        "fig7.7" => (
            "frame time at three sizes: all lights, one light, one light denoised",
            Figure::Sizes(vec![ALL, ONE, DENOISED]),
        ),
        "fig7.8" => ("time of the denoiser at three sizes", Figure::Sizes(vec![DENOISED])),
        "fig7.9" => (
            "frame time with all lights, culling off and on",
            Figure::Sizes(vec![
                panel("culling off", Show::Frame, |s| unculled(all(s))),
                panel("culling on", Show::Frame, all),
            ]),
        ),
        "fig7.10" => (
            "lights per pixel beside the truth",
            Figure::Pictures(vec![
                ONE,
                panel("2 lights", Show::Frame, |s| lights(s, Mode::Uniform, 2, false, false)),
                panel("4 lights", Show::Frame, |s| lights(s, Mode::Uniform, 4, false, false)),
                panel("8 lights", Show::Frame, |s| lights(s, Mode::Uniform, 8, false, false)),
                panel("16 lights", Show::Frame, |s| lights(s, Mode::Uniform, 16, false, false)),
                ALL,
                DENOISED,
                ACCUMULATED,
            ]),
        ),
        "fig7.11" => ("time and likeness against samples", Figure::Samples),
        // The stage's settings name the light.
        SOLO => (
            "where noise comes from: one light alone, and the terms of its light",
            Figure::Pictures(vec![
                Panel {
                    apart: true,
                    ..panel("one light of all", Show::Frame, |s| alone(s, LightTerm::All, None))
                },
                panel("the light alone", Show::Frame, |s| {
                    alone(s, LightTerm::All, s.solo_light)
                }),
                term("its visibility", |s| alone(s, LightTerm::Visibility, s.solo_light)),
                term("its geometry", |s| alone(s, LightTerm::Geometry, s.solo_light)),
                term("its emission", |s| alone(s, LightTerm::Emission, s.solo_light)),
                panel("truth, the light alone", Show::Truth, |s| {
                    alone(s, LightTerm::All, s.solo_light)
                }),
            ]),
        ),
        "fig7.13" => (
            "frame time on a walk with all lights",
            Figure::Walk(panel("all lights", Show::Frame, all)),
        ),
        "fig7.14" => (
            "contact shadows near and far",
            Figure::Pictures(vec![
                Panel {
                    closer: 0.6,
                    apart: true,
                    ..panel("near, denoiser", Show::Frame, one_denoised)
                },
                panel("far, denoiser", Show::Frame, one_denoised),
                panel("far, truth", Show::Truth, all),
            ]),
        ),
        // The thesis's section 7.5: frames take longest where glass fills the view.
        GLASS => (
            "up to the glass",
            Figure::Pictures(vec![
                nearer("from where all of it is seen", 0.0),
                nearer("half way", 0.5),
                nearer("at the glass", 0.95),
                Panel {
                    closer: 0.95,
                    apart: true,
                    ..panel("at the glass, secondary stage off", Show::Frame, without_secondary)
                },
            ]),
        ),
        _ => return None,
    })
}

/// A panel's picture and time.
#[derive(Clone, Debug)]
pub struct Shown {
    pub pixels: super::references::Pixels,
    /// Median frame, milliseconds.
    pub ms: f64,
    /// Medians of the denoiser's passes together.
    pub denoiser_ms: f64,
}

/// Time and likeness of one number of samples.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct SampleRow {
    pub samples: u32,
    /// So many lights in a frame: milliseconds and SSIM.
    pub lights: (f64, f64),
    /// So many frames averaged.
    pub traditional: (f64, f64),
}

/// Passes that denoise: figure 7.8.
fn denoises(pass: &str) -> bool {
    [
        "gradient",
        "temporal",
        "atrous",
        "taa",
        "secondary_temporal",
        "secondary_atrous",
    ]
    .iter()
    .any(|p| pass.starts_with(p))
}

/// Renders a panel; a truth is the mean of `truth` samples.
///
/// # Errors
/// [`RenderError`] of the device.
pub fn show(stage: &mut Stage, camera: &Camera, panel: &Panel, truth: u32) -> Result<Shown, RenderError> {
    let settings = (panel.change)(stage.base);
    stage.warm_up(camera, &settings)?;
    // Ends histories.
    stage.frame(camera, &settings, 0, 1)?;
    let frames = if settings.denoiser || settings.taa { SETTLE } else { 1 };
    let mut ended = Vec::new();
    for index in 0..frames + TIMED {
        ended.extend(stage.frame(camera, &settings, index, 0)?);
    }
    ended.extend(stage.realtime.finish()?);
    let timed = &ended[ended.len().saturating_sub(TIMED as usize)..];
    let ms = median(&timed.iter().map(FrameStats::ms).collect::<Vec<_>>()).unwrap_or(0.0);
    let of_denoiser = |s: &FrameStats| {
        let passes = s.passes.iter().filter(|(name, _)| denoises(name));
        passes.filter_map(|(_, t)| t.as_f64()).sum::<f64>()
    };
    let denoiser_ms = median(&timed.iter().map(of_denoiser).collect::<Vec<_>>()).unwrap_or(0.0);
    let pixels = match panel.show {
        Show::Frame => stage.shown()?,
        Show::Truth => stage.accumulated(camera, &settings, truth)?,
    };
    Ok(Shown {
        pixels,
        ms,
        denoiser_ms,
    })
}

/// Figure 7.11: SSIM against the mean of `truth` samples of all lights.
///
/// # Errors
/// [`RenderError`] of the device.
pub fn samples(stage: &mut Stage, camera: &Camera, truth: u32) -> Result<Vec<SampleRow>, RenderError> {
    let truth = show(stage, camera, &ACCUMULATED, truth)?.pixels;
    let mut out = Vec::new();
    for n in SAMPLES {
        let several = lights(stage.base, Mode::Uniform, n, false, false);
        let single = one(stage.base);
        let mut measure = |settings: &Settings, samples: u32| -> Result<(f64, f64), RenderError> {
            let image = stage.accumulated(camera, settings, samples)?;
            stage.warm_up(camera, settings)?;
            let mut ended = Vec::new();
            for index in 0..TIMED {
                ended.extend(stage.frame(camera, settings, index, 1)?);
            }
            ended.extend(stage.realtime.finish()?);
            let ms = median(&ended.iter().map(FrameStats::ms).collect::<Vec<_>>()).unwrap_or(0.0) * f64::from(samples);
            Ok((ms, stage.likeness(&image, &truth)))
        };
        out.push(SampleRow {
            samples: n,
            lights: measure(&several, 1)?,
            traditional: measure(&single, n)?,
        });
    }
    Ok(out)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_figures_are_there() {
        for n in 1..=14 {
            assert!(figure(&format!("fig7.{n}")).is_some(), "{n}");
        }
        assert!(figure("fig7.15").is_none());
        assert!(figure(GLASS).is_some());
    }
}
