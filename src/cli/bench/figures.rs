//! `q3rays bench fig7.N`: the thesis's experiments.

use super::super::args::{CliError, CliResult};
use super::super::common::{Common, progress};
use super::frames::{FramesArgs, usual_maps};
use super::results::write;
use super::{FOV, vulkan_engine};
use crate::bench::figures::{Figure, GLASS, Panel, SIZES, SOLO, Show, figure, samples, show};
use crate::bench::frames::{Way, go};
use crate::bench::page::Page;
use crate::bench::plot::{Axis, Series, Style, bars, chart};
use crate::bench::references::Pixels;
use crate::bench::run_info::RunInfo;
use crate::bench::stage::Stage;
use crate::bench::tour::Tour;
use crate::console::Cvars;
use crate::console::settings::settings;
use crate::engine::Prepared;
use crate::output::{atomic, png_file, stdout};
use crate::reference::direct::strongest_light;
use crate::reference::trace::Tracer;
use crate::reference::views::feature_views;
use crate::render::realtime::Realtime;
use crate::render::scene_gpu::SceneGpu;
use crate::render::settings::Settings;
use crate::scene::Scene;
use crate::scene::camera::Camera;
use crate::scene::records::SEEN_BY_EYE;
use glam::Vec3;
use serde_json::{Value, json};
use std::sync::Arc;

/// One map's figure being made.
struct Making<'a> {
    args: &'a FramesArgs,
    scene: &'a Scene,
    gpu: Arc<SceneGpu>,
    cvars: &'a Cvars,
    view: Camera,
    /// The light that figure 7.12 shows.
    solo: Option<u32>,
}

/// Makes a figure of each map.
pub(super) fn run(common: &Common, cvars: &Cvars, args: &FramesArgs, name: &str, maps: &[String]) -> CliResult {
    let Some((title, made_of)) = figure(name) else {
        return Err(CliError::Usage(format!(
            "there is no experiment \"{name}\"; those of the thesis are fig7.1 to fig7.14 and {GLASS}"
        )));
    };
    let maps = usual_maps(common, maps)?;
    let engine = vulkan_engine(common, cvars, name)?;
    let mut page = Page::new(&format!("q3rays: the thesis's {name}: {title}"));
    RunInfo::new(&engine, cvars).show(&mut page);
    let mut data = Vec::new();
    let bar = progress(maps.len() as u64, name);
    for map in &maps {
        let (scene, _) = common.lit_scene(map, cvars)?;
        let Prepared::Gpu(gpu) = engine.prepare(&scene).map_err(CliError::failed)? else {
            return Err(CliError::Failed("the experiments run on Vulkan devices".to_owned()));
        };
        let view = match name == GLASS && !args.view.named() {
            true => glass(&scene)?,
            false => args.view.camera(&scene, FOV)?,
        };
        let solo = (name == SOLO).then(|| args.light.unwrap_or_else(|| strongest_light(&scene, &view)));
        let making = Making {
            args,
            scene: &scene,
            gpu,
            cvars,
            view,
            solo,
        };
        page.heading(map);
        if let Some(light) = solo {
            page.paragraph(&format!("Light {light} of {}.", scene.lights.lights.len()));
        }
        let found = match &made_of {
            Figure::Pictures(panels) => making.pictures(&mut page, panels)?,
            Figure::Sizes(panels) => making.sizes(&mut page, panels, name == "fig7.8")?,
            Figure::Samples => making.samples(&mut page)?,
            Figure::Walk(panel) => making.walk(&mut page, panel)?,
        };
        data.push(json!({ "map": map, "lights": scene.lights.lights.len(), "light": solo, "figure": found }));
        bar.inc(1);
        let all = json!({ "kind": name, "title": title, "maps": data });
        write(
            &args.out.join("data.json"),
            &serde_json::to_string_pretty(&all).map_err(CliError::failed)?,
        )?;
        write(&args.out.join("report.html"), &page.html())?;
    }
    bar.finish_and_clear();
    stdout::line(args.out.join("report.html").display()).map_err(CliError::failed)
}

/// A view of a pane or of water, right at it.
fn glass(scene: &Scene) -> Result<Camera, CliError> {
    let found = feature_views(scene).into_iter().find(|v| v.feature == "dielectric");
    let found = found.ok_or_else(|| {
        CliError::Failed(format!(
            "no glass or water of {} can be seen well; name a view of some with --camera",
            scene.name
        ))
    })?;
    // Level views have it so much below their middle.
    let pitch = (-found.at[1] * (0.5 * FOV).to_radians().tan()).atan().to_degrees();
    Ok(Camera {
        pitch,
        ..Camera::new(found.eye.into(), found.yaw, FOV)
    })
}

impl Making<'_> {
    fn stage(&self, size: (u32, u32)) -> Result<Stage, CliError> {
        let base = settings(self.cvars);
        let base = Settings {
            solo_light: self.solo.or(base.solo_light),
            ..base
        };
        Stage::new(self.gpu.clone(), &base, size, 1).map_err(CliError::failed)
    }

    /// The view, nearer to what is under the crosshair, be it glass.
    fn closer(&self, share: f32) -> Camera {
        if share <= 0.0 {
            return self.view;
        }
        let (eye, forward) = (Vec3::from(self.view.eye), self.view.axes().forward);
        let hit = Tracer::new(self.scene).look(self.scene, eye, forward, None, SEEN_BY_EYE);
        let way = hit.map_or(0.0, |h| h.t as f32) * share;
        Camera {
            eye: (eye + forward * way).into(),
            ..self.view
        }
    }

    fn picture(&self, page: &mut Page, label: &str, caption: &str, pixels: &[[u8; 3]]) -> CliResult {
        let (width, height) = self.args.size;
        let stem = label.replace(", ", "_").replace(' ', "-");
        let path = self
            .args
            .out
            .join("pictures")
            .join(format!("{}-{stem}.png", self.scene.name));
        atomic::create_parent(&path).map_err(CliError::failed)?;
        png_file::write(&path, width, height, pixels, &[]).map_err(CliError::failed)?;
        page.picture(width, height, pixels, caption);
        Ok(())
    }

    fn pictures(&self, page: &mut Page, panels: &[Panel]) -> Result<Value, CliError> {
        let mut stage = self.stage(self.args.size)?;
        if let Some(path) = &self.args.original {
            let (width, height, pixels) = png_file::read_bytes(path).map_err(CliError::failed)?;
            page.picture(width, height, &pixels, "the original");
        }
        let mut shown = Vec::new();
        for panel in panels {
            let camera = self.closer(panel.closer);
            shown.push(show(&mut stage, &camera, panel, self.args.truth).map_err(CliError::failed)?);
        }
        let truth: Option<Pixels> = panels
            .last()
            .zip(shown.last())
            .filter(|(panel, _)| panel.show == Show::Truth)
            .map(|(_, s)| s.pixels.clone());
        let mut rows = Vec::new();
        let mut out = Vec::new();
        for (panel, one) in panels.iter().zip(&shown) {
            let comparable = truth.as_ref().filter(|_| !panel.apart);
            let metrics = comparable.and_then(|t| stage.compare_images(&one.pixels, t).ok());
            let figure = |f: Option<f64>| f.map_or("–".to_owned(), |v| format!("{v:.4}"));
            let of = |f: fn(&crate::metrics::Metrics) -> Option<f64>| metrics.as_ref().and_then(f);
            let (ssim, flip, error) = (of(|m| m.ssim), of(|m| m.flip), of(|m| m.rel_mse));
            rows.push(vec![
                panel.label.to_owned(),
                format!("{:.3}", one.ms),
                figure(ssim),
                figure(flip),
                error.map_or("–".to_owned(), |e| format!("{e:.2e}")),
            ]);
            out.push(json!({ "panel": panel.label, "ms": one.ms, "ssim": ssim, "flip": flip, "rel_mse": error }));
            let reference = truth.as_ref().filter(|_| !panel.apart).unwrap_or(&one.pixels);
            let display = stage.displayed(&one.pixels, reference);
            self.picture(page, panel.label, panel.label, &display)?;
        }
        page.table(&["panel", "ms a frame", "SSIM", "FLIP", "rel_mse"], &rows);
        Ok(json!(out))
    }

    fn sizes(&self, page: &mut Page, panels: &[Panel], of_denoiser: bool) -> Result<Value, CliError> {
        let mut lengths = Vec::new();
        let mut out = Vec::new();
        for size in SIZES {
            let mut stage = self.stage(size)?;
            for panel in panels {
                let shown = show(&mut stage, &self.view, panel, self.args.truth).map_err(CliError::failed)?;
                let ms = if of_denoiser { shown.denoiser_ms } else { shown.ms };
                lengths.push((format!("{}x{}, {}", size.0, size.1, panel.label), vec![ms]));
                out.push(json!({ "size": [size.0, size.1], "panel": panel.label, "ms": ms }));
            }
        }
        let svg = bars("ms", &["ms"], &lengths).map_err(CliError::failed)?;
        page.plot(&svg, "Median of 16 frames (data.json).");
        Ok(json!(out))
    }

    fn samples(&self, page: &mut Page) -> Result<Value, CliError> {
        let mut stage = self.stage(self.args.size)?;
        let rows = samples(&mut stage, &self.view, self.args.truth).map_err(CliError::failed)?;
        for (name, of) in [("ms", 0), ("SSIM", 1)] {
            let series = |label: &str, traditional: bool| Series {
                name: label.to_owned(),
                points: rows
                    .iter()
                    .map(|r| {
                        let (ms, ssim) = if traditional { r.traditional } else { r.lights };
                        (f64::from(r.samples), if of == 0 { ms } else { ssim })
                    })
                    .collect(),
                style: Style::Both,
            };
            let axis = |name| Axis {
                name,
                logarithmic: false,
            };
            let both = [series("lights", false), series("traditional samples", true)];
            let svg = chart([axis("samples"), axis(name)], &both).map_err(CliError::failed)?;
            page.plot(&svg, &format!("{name} against the number of samples (data.json)."));
        }
        Ok(json!(rows))
    }

    fn walk(&self, page: &mut Page, panel: &Panel) -> Result<Value, CliError> {
        let size = SIZES[0];
        let mut realtime = Realtime::new(self.gpu.clone(), size, None).map_err(CliError::failed)?;
        let tour = Tour::new(self.scene, FOV).cameras(self.args.frames as usize);
        let settings = (panel.change)(settings(self.cvars));
        let way = Way::of_cameras("tour", &tour, settings.clock);
        let frames = go(&mut realtime, &settings, &way, 4, &|| {}).map_err(CliError::failed)?;
        let times: Vec<f64> = frames.iter().map(|f| f.stats.ms()).collect();
        let series = [Series {
            name: panel.label.to_owned(),
            points: times.iter().enumerate().map(|(i, t)| (i as f64, *t)).collect(),
            style: Style::Line,
        }];
        let axis = |name| Axis {
            name,
            logarithmic: false,
        };
        let svg = chart([axis("frame"), axis("ms")], &series).map_err(CliError::failed)?;
        page.plot(&svg, "Frame time along the tour at 1280x720 (data.json).");
        Ok(json!(times))
    }
}
