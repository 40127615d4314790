//! The program behind the window: what a frame does, in order.

use super::folders::{Folders, UserScripts};
use super::input::Input;
use super::journey::{Playback, Recorder};
use super::level::{Level, View};
use super::lifecycle::{Applied, Resume, StatsRun};
use super::loading::{Loading, MapSource};
use super::painter::Painting;
use super::screen::Screen;
use super::ui::{Facts, PlayerFacts, Ui};
use crate::cli::CliError;
use crate::console::Shell;
use crate::console::config::Config;
use crate::console::log::plain;
#[cfg(feature = "compile-shaders")]
use crate::console::shell::Action;
use crate::console::shell::Panel;
use crate::game::play::Event;
use crate::gpu::GpuError;
use crate::output::stats::{FrameStats, Summary};
use crate::render::scene_gpu::RenderError;
use crate::scene::camera::Camera;
use crate::scene::clock::Clock;
use std::collections::VecDeque;
use std::sync::Arc;
use std::sync::mpsc::Receiver;
use std::thread::JoinHandle;
use std::time::{Duration, Instant};
use winit::dpi::PhysicalSize;
use winit::window::{Fullscreen, Window};

/// Longest time that one frame lets go by, seconds.
const LONGEST_STEP: f32 = 0.25;
/// Frames in the overlay's statistics.
const RECENT: usize = 180;
/// How long to wait where there is nothing to draw to, and between frames while a map is being loaded.
const IDLE: Duration = Duration::from_millis(30);
/// How long a notice stays.
const NOTICE: Duration = Duration::from_secs(4);
/// With no smaller share of the window's pixels is it tried again after memory has run out.
const LEAST_SCALE: f64 = 0.25;
/// A device that is lost twice within this time is not opened again.
const LOST_TWICE: Duration = Duration::from_secs(30);

/// Everything that lives as long as the window. What uses the device is dropped before it.
pub struct Game {
    pub(super) level: Option<Level>,
    pub(super) loading: Option<Loading>,
    /// Loadings that nobody waits for any more.
    pub(super) abandoned: Vec<Loading>,
    pub(super) screen: Screen,
    pub(super) window: Arc<Window>,
    pub(super) platform: egui_winit::State,
    pub(super) ui: Ui,
    pub(super) shell: Shell,
    pub(super) config: Config,
    pub(super) folders: Folders,
    pub(super) source: MapSource,
    pub(super) device: String,
    pub(super) input: Input,
    pub(super) recorder: Option<Recorder>,
    pub(super) playback: Option<Playback>,
    /// Frame times written down by the console's `stats`, and those of the whole run.
    pub(super) stats: Option<StatsRun>,
    pub(super) whole_run: Option<StatsRun>,
    pub(super) films: Vec<FilmWork>,
    /// What the last frame showed.
    pub(super) shown: Option<(Camera, Clock)>,
    /// Where the player goes on once the map is loaded again.
    pub(super) resume: Option<Resume>,
    pub(super) recent: VecDeque<FrameStats>,
    pub(super) pace: VecDeque<f32>,
    pub(super) focused: bool,
    pub(super) captured: bool,
    pub(super) alt: bool,
    pub(super) last_frame: Instant,
    pub(super) last_report: Instant,
    pub(super) notice: Option<(String, Instant)>,
    pub(super) log_seen: u64,
    pub(super) applied: Applied,
    pub(super) lost: Option<Instant>,
    pub(super) frames_left: Option<u32>,
    pub quit: bool,
    /// The device is to be opened anew: [`Self::reopen`].
    pub restart: bool,
    #[cfg(feature = "gamepad")]
    pub(super) pads: super::gamepad::Pads,
    #[cfg(feature = "compile-shaders")]
    pub(super) shaders: super::shader_watch::ShaderWatch,
}

/// A film being made.
pub(super) struct FilmWork {
    pub name: String,
    /// What it says about itself.
    pub note: String,
    pub news: Receiver<FilmNews>,
    pub worker: JoinHandle<()>,
}

/// News of a film being made.
pub(super) enum FilmNews {
    Share(f32),
    Done(Result<String, String>),
}

impl Game {
    /// Begins to load a map; the one that is there stays until that has come.
    pub(super) fn load(&mut self, map: &str) {
        self.abandoned.extend(self.loading.take());
        // Frames of the map and frames without one take turns.
        self.idle();
        let size = self.traced_size();
        self.shell.hold();
        self.loading = Some(Loading::begin(map, &self.source, &self.shell.cvars, &self.screen, size));
    }

    /// Size of the traced image: the window's, scaled.
    fn traced_size(&self) -> (u32, u32) {
        let size = self.window.inner_size();
        let scale = self.shell.cvars.number("rt_scale");
        let most = self.screen.device.limits().max_image_dimension;
        let edge = |n: u32| ((f64::from(n) * scale).round() as u32).clamp(1, most);
        (edge(size.width), edge(size.height))
    }

    /// One frame.
    ///
    /// # Errors
    /// One sentence where the device cannot go on.
    pub fn frame(&mut self) -> Result<(), CliError> {
        let seconds = self.last_frame.elapsed().as_secs_f32();
        self.last_frame = Instant::now();
        self.gamepad();
        self.run_console();
        self.follow_films();
        self.take_level();
        self.apply_window();
        self.watch_shaders();
        if !self.screen.has_area() {
            std::thread::sleep(IDLE);
            return Ok(());
        }
        let painting = self.overlay();
        match self.draw(seconds.min(LONGEST_STEP), &painting) {
            Ok(true) => push(&mut self.pace, seconds * 1e3),
            Ok(false) => std::thread::sleep(IDLE),
            Err(e) => self.recover(e)?,
        }
        self.report();
        self.capture_pointer();
        self.limit_rate();
        Ok(())
    }

    /// Runs what the console has to run.
    pub(super) fn run_console(&mut self) {
        let (folder, files) = (self.folders.config.clone(), self.source.files.clone());
        let scripts = UserScripts {
            folder: &folder,
            files: &files,
        };
        self.shell.begin_frame();
        // One by one, so that each finds what those before it have done.
        while let Some(actions) = self.shell.step(&scripts) {
            actions.into_iter().for_each(|action| self.act(action));
        }
        if self.shell.log.added() != self.log_seen {
            let new = (self.shell.log.added() - self.log_seen) as usize;
            self.log_seen = self.shell.log.added();
            let lines: Vec<String> = self.shell.log.lines().rev().take(new).map(plain).collect();
            // Who follows from outside reads along.
            lines
                .iter()
                .rev()
                .for_each(|line| tracing::info!(target: "console", "{line}"));
            let last = lines.into_iter().next().filter(|_| !self.ui.console_is_open());
            self.notice = last.map(|line| (line, Instant::now()));
        }
        self.notice.take_if(|(_, since)| since.elapsed() > NOTICE);
    }

    /// Takes over a map that has come.
    fn take_level(&mut self) {
        self.abandoned.retain_mut(|loading| loading.take().is_none());
        let Some((map, seconds, outcome)) = self.loading.as_mut().and_then(|loading| {
            let outcome = loading.take()?;
            Some((loading.map.clone(), loading.elapsed().as_secs_f32(), outcome))
        }) else {
            return;
        };
        self.loading = None;
        self.shell.release();
        self.idle();
        match outcome {
            Ok(mut level) => {
                self.end_recording();
                for warning in level.warnings.iter().take(5) {
                    self.shell.log.warn(warning);
                }
                if let Some(resume) = self.resume.take()
                    && resume.map == level.map
                    && level.play.restore(&resume.state)
                {
                    (level.camera, level.time) = (resume.camera, resume.time);
                }
                let times = level
                    .loading_times
                    .map(|(what, time)| format!("{what} {:.2}", time.as_secs_f32()));
                self.shell
                    .log
                    .say(format!("{map} loaded in {seconds:.2} s ({})", times.join(", ")));
                self.window.set_title(&format!("q3rays - {map}"));
                self.level = Some(level);
                self.recent.clear();
                self.pace.clear();
                self.keep_pipelines();
                self.begin_playback_here();
            }
            Err(e) => {
                self.shell.log.warn(&e);
                // What waited for this map has none.
                self.playback = None;
                self.resume = None;
                if self.level.is_none() {
                    // Nobody would see why nothing is there.
                    self.ui.close_all();
                    self.toggle(Panel::Console);
                }
            }
        }
    }

    /// Waits for the GPU: frames with and without a map take turns only then.
    pub(super) fn idle(&mut self) {
        if let Err(e) = self.screen.device.wait_idle() {
            tracing::debug!("{e}");
        }
    }

    /// Keeps the driver's compiled pipelines for the next start.
    fn keep_pipelines(&mut self) {
        let path = self.folders.pipelines();
        let folder = path.parent().map_or(Ok(()), std::fs::create_dir_all);
        let kept = folder
            .map_err(|e| e.to_string())
            .and_then(|()| self.screen.cache.save(&path).map_err(|e| e.to_string()));
        if let Err(e) = kept {
            self.shell.log.warn(format!("compiled shaders are not kept: {e}"));
        }
    }

    /// Makes the window what its variables want.
    fn apply_window(&mut self) {
        let wanted = Applied::wanted(&self.shell.cvars);
        if wanted == self.applied {
            return;
        }
        if wanted.fullscreen != self.applied.fullscreen {
            self.window
                .set_fullscreen(wanted.fullscreen.then_some(Fullscreen::Borderless(None)));
        }
        if wanted.mode != self.applied.mode
            && let Some((width, height)) = wanted.mode.split_once('x')
            && let (Ok(width), Ok(height)) = (width.parse::<u32>(), height.parse::<u32>())
            && let Some(size) = self.window.request_inner_size(PhysicalSize::new(width, height))
        {
            self.screen.resize(size.width, size.height);
        }
        self.screen.set_mode(wanted.present_mode());
        self.applied = wanted;
    }

    /// Builds the overlay.
    fn overlay(&mut self) -> Painting {
        let input = self.platform.take_egui_input(&self.window);
        let size = self.window.inner_size();
        let playing = self.playback.as_ref();
        let shown = self.shown.map(|(camera, _)| camera);
        let player = self.level.as_ref().map(|level| PlayerFacts {
            camera: shown.unwrap_or(level.camera),
            speed: level.play.body.velocity.length(),
            health: level.play.health,
            mode: level.play.body.mode,
            watching: playing.is_some(),
        });
        let notes = self.notes();
        let facts = Facts {
            map: self.level.as_ref().map_or("", |l| l.map.as_str()),
            line: &self.screen.line,
            sizes: [self.traced_size(), (size.width, size.height)],
            recent: Some(&self.recent),
            pace: Some(&self.pace),
            lights: self
                .level
                .as_ref()
                .zip(shown)
                .and_then(|(level, camera)| level.lights_at(&camera)),
            samples: self.level.as_ref().map_or(0, |l| l.accumulated),
            error: self.level.as_ref().and_then(|l| l.error),
            loading: self
                .loading
                .as_ref()
                .map(|l| (l.map.as_str(), l.progress(), l.elapsed().as_secs_f32())),
            notes,
            recording: self.recorder.is_some(),
            notice: self.notice.as_ref().map(|(text, _)| text.as_str()),
            player,
            memory: self.screen.device.memory_reserved(),
        };
        let out = self.ui.show(input, &facts, &mut self.shell);
        let cursor = self.ui.wants_pointer();
        let mut platform = out.platform_output;
        if !cursor {
            // The pointer is hidden while it looks around.
            platform.cursor_icon = egui::CursorIcon::None;
        }
        self.platform.handle_platform_output(&self.window, platform);
        Painting {
            primitives: self.ui.context.tessellate(out.shapes, out.pixels_per_point),
            textures: out.textures_delta,
            scale: out.pixels_per_point,
        }
    }

    /// What goes on beside the picture.
    fn notes(&self) -> Vec<String> {
        let mut out = Vec::new();
        if let Some(r) = &self.recorder {
            out.push(format!("recording: {} frames", r.recording.frames.len()));
        }
        if let Some(p) = &self.playback {
            out.push(format!("{}: {:.0}% of {:.1} s", p.name, p.share() * 100.0, p.length()));
        }
        if let Some(s) = &self.stats {
            out.push(format!("frame times: {}", s.frames.len()));
        }
        out.extend(self.films.iter().map(|film| film.note.clone()));
        out
    }

    /// Draws what there is to draw. False where the window cannot show anything now.
    fn draw(&mut self, seconds: f32, painting: &Painting) -> Result<bool, RenderError> {
        self.screen.update(painting)?;
        let size = self.traced_size();
        let view = self.next_view(seconds)?;
        let (Some(view), Some(level)) = (view, &mut self.level) else {
            let shown = self.screen.show_nothing(painting)?;
            // Whoever loads the map has use for the processor.
            std::thread::sleep(IDLE);
            return Ok(shown);
        };
        self.shown = Some((view.camera, view.clock));
        let (shown, ended) = level.show(&view, &self.shell.cvars, size, &mut self.screen, painting)?;
        if let Some(stats) = ended {
            self.note_stats(stats);
        }
        if let Some(left) = &mut self.frames_left {
            *left = left.saturating_sub(1);
            self.quit |= *left == 0;
        }
        Ok(shown)
    }

    /// What the map shows next; nothing while another is loaded.
    fn next_view(&mut self, seconds: f32) -> Result<Option<View>, RenderError> {
        if self.loading.is_some() {
            self.input.forget();
            return Ok(None);
        }
        let Some(level) = &mut self.level else {
            return Ok(None);
        };
        if let Some(playback) = &mut self.playback {
            if let Some(view) = playback.next(seconds) {
                self.input.forget();
                return Ok(Some(view));
            }
            self.end_playback()?;
            return self.next_view(seconds);
        }
        if self.ui.wants_pointer() {
            self.input.release_all();
        }
        let before = self
            .recorder
            .as_ref()
            .is_some_and(|r| r.disturbed)
            .then(|| level.play.state());
        let walked = level.walk(&mut self.input, &self.shell.cvars, seconds);
        walked
            .events
            .iter()
            .filter_map(told)
            .for_each(|text| self.shell.log.say(text));
        if let Some(recorder) = &mut self.recorder {
            let before = before.unwrap_or_else(|| level.play.state());
            if !recorder.push(&walked, before) {
                self.shell.log.warn("the recording is full");
                self.end_recording();
            }
        }
        Ok(Some(walked.view))
    }

    pub(super) fn note_stats(&mut self, stats: FrameStats) {
        for run in self.stats.iter_mut().chain(&mut self.whole_run) {
            run.frames.push(stats.clone());
        }
        if let Some(playback) = &mut self.playback {
            playback.stats.push(stats.clone());
        }
        push(&mut self.recent, stats);
    }

    /// Opens the device anew after it or the window's surface was lost; tells why where that happens again at once.
    fn recover(&mut self, error: RenderError) -> Result<(), CliError> {
        let scale = self.shell.cvars.number("rt_scale");
        if matches!(error, RenderError::Gpu(GpuError::OutOfDeviceMemory { .. })) && scale > LEAST_SCALE {
            self.shell.log.warn(format!("{error}; tracing fewer pixels"));
            self.shell.set("rt_scale", &(scale * 0.5).to_string());
            self.restart = true;
            return Ok(());
        }
        let lost = matches!(
            error,
            RenderError::Gpu(GpuError::DeviceLost { .. } | GpuError::SurfaceLost { .. })
        );
        if !lost || self.lost.is_some_and(|at| at.elapsed() < LOST_TWICE) {
            return Err(CliError::failed(error));
        }
        self.lost = Some(Instant::now());
        self.shell.log.warn(format!("{error}; opening it again"));
        self.restart = true;
        Ok(())
    }

    /// Once a second, where `rt_printPerfStats 2` asks for it: times by pass.
    fn report(&mut self) {
        if self.last_report.elapsed() < Duration::from_secs(1) || self.shell.cvars.number("rt_printPerfStats") < 2.0 {
            return;
        }
        self.last_report = Instant::now();
        let Some(last) = self.recent.back() else { return };
        let frames: Vec<FrameStats> = self.recent.iter().cloned().collect();
        let s = Summary::of_frames(&frames);
        let passes: Vec<_> = last
            .passes
            .iter()
            .map(|(name, ms)| format!("{name} {:.2}", ms.as_f64().unwrap_or(0.0)))
            .collect();
        eprintln!(
            "p50 {:.2} p95 {:.2} p99 {:.2} ms; {}",
            s.p50,
            s.p95,
            s.p99,
            passes.join(", ")
        );
    }

    /// Sleeps out the rest of a frame under `com_maxfps`.
    fn limit_rate(&self) {
        let fps = self.shell.cvars.number("com_maxfps");
        if fps > 0.0 && !self.playback.as_ref().is_some_and(|p| p.timed) {
            let wanted = Duration::from_secs_f64(1.0 / fps);
            if let Some(rest) = wanted.checked_sub(self.last_frame.elapsed()) {
                std::thread::sleep(rest);
            }
        }
    }

    /// Uses shaders that were changed on disk.
    #[cfg(feature = "compile-shaders")]
    fn watch_shaders(&mut self) {
        if self.shaders.changed() {
            self.act(Action::ReloadShaders);
        }
    }

    #[cfg(not(feature = "compile-shaders"))]
    fn watch_shaders(&mut self) {}
}

/// What an event is to the player.
fn told(event: &Event) -> Option<String> {
    Some(match event {
        Event::Thrown => "a jump pad throws you".to_owned(),
        Event::Teleported => "you are somewhere else".to_owned(),
        Event::Died => "^1you are dead: back at a spawn".to_owned(),
        Event::Fell => "^1you fell out of the map: back at a spawn".to_owned(),
        Event::Took(class) => format!("you take {class}"),
        Event::Turned(_) | Event::Moved { .. } => return None,
    })
}

/// Adds to the last frames.
fn push<T>(last: &mut VecDeque<T>, value: T) {
    last.push_back(value);
    if last.len() > RECENT {
        last.pop_front();
    }
}
