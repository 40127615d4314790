//! How the program behind the window begins, begins again and ends.

use super::folders::Folders;
use super::game::Game;
use super::input::Input;
use super::loading::{Loading, MapSource};
use super::screen::{Screen, ScreenOptions};
use super::ui::Ui;
use crate::cli::CliError;
use crate::console::config::Config;
use crate::console::table::R_MODES;
use crate::console::{Cvars, Shell};
use crate::content::fly_through;
use crate::engine::BackendChoice;
use crate::game::play::PlayState;
use crate::gpu::{GpuError, PresentMode};
use crate::output::stats::FrameStats;
use crate::scene::camera::Camera;
use std::collections::VecDeque;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Instant;
use winit::dpi::PhysicalSize;
use winit::window::Window;

/// The window's inside on CPU-type devices, which are far slower.
const SMALL_SIZE: (u32, u32) = (640, 360);

/// What the program is started with.
pub struct Start {
    pub source: MapSource,
    pub folders: Folders,
    pub config: Config,
    pub shell: Shell,
    /// The map that was asked for; else the one that ships.
    pub map: Option<String>,
    pub device: String,
    /// Close after so many frames of a map; for tests.
    pub frames: Option<u32>,
    /// Frame times of the whole run.
    pub stats: Option<StatsRun>,
    /// Where the player goes on once the map is there.
    pub resume: Option<Resume>,
    /// When the device was lost last.
    pub lost: Option<Instant>,
    /// Console commands for the map once it is there.
    pub commands: String,
    /// Lines of the console that have been told already.
    pub log_seen: u64,
}

/// Frame times being written down, and where they go.
pub struct StatsRun {
    pub path: PathBuf,
    pub frames: Vec<FrameStats>,
}

impl StatsRun {
    /// Nothing written down yet.
    pub fn new(path: PathBuf) -> Self {
        Self {
            path,
            frames: Vec::new(),
        }
    }
}

/// A player to go on with on the same map.
pub struct Resume {
    pub(super) map: String,
    pub(super) state: PlayState,
    pub(super) camera: Camera,
    /// The scene's, seconds.
    pub(super) time: f64,
}

/// Variables of the window as they are applied.
#[derive(Clone, PartialEq)]
pub(super) struct Applied {
    pub(super) fullscreen: bool,
    pub(super) mode: String,
    vsync: bool,
}

impl Applied {
    pub(super) fn wanted(cvars: &Cvars) -> Self {
        Self {
            fullscreen: cvars.number("r_fullscreen") != 0.0,
            mode: cvars.get("r_mode").unwrap_or_default(),
            vsync: cvars.number("r_swapInterval") != 0.0,
        }
    }

    pub(super) fn present_mode(&self) -> PresentMode {
        if self.vsync {
            PresentMode::Vsync
        } else {
            PresentMode::Immediate
        }
    }
}

impl Game {
    /// Opens the device for a window and begins to load the map.
    ///
    /// # Errors
    /// One sentence where there is no device.
    pub fn new(window: Arc<Window>, start: Start) -> Result<Self, CliError> {
        let Start {
            source,
            folders,
            config,
            mut shell,
            map,
            device,
            frames,
            stats,
            resume,
            lost,
            commands,
            log_seen,
        } = start;
        let applied = Applied {
            fullscreen: false,
            mode: R_MODES[0].to_owned(),
            ..Applied::wanted(&shell.cvars)
        };
        let again = resume.is_some() || log_seen > 0;
        let mode = applied.present_mode();
        let mut opened = open_screen(&window, &shell.cvars, &device, &folders, mode);
        if let Err(e @ (GpuError::MissingFeature { .. } | GpuError::Unsupported(_))) = &opened
            && shell.cvars.number("rt_backend") != 0.0
        {
            // Whoever kept it in their settings would never get in again.
            let warning = format!("{e}; rt_backend is auto now");
            eprintln!("warning: {warning}");
            shell.log.warn(warning);
            shell.set("rt_backend", "auto");
            opened = open_screen(&window, &shell.cvars, &device, &folders, mode);
        }
        let screen = opened.map_err(|e| match e {
            GpuError::NoLoader(_) | GpuError::NoDevice => {
                CliError::NoWindow(format!("the window needs a Vulkan device ({e}): running without one"))
            }
            other => CliError::failed(other),
        })?;
        if screen.on_cpu() && !again && shell.cvars.number("r_mode") == 0.0 {
            // The answer, where there is one at once, comes as a resize event otherwise.
            let _ = window.request_inner_size(PhysicalSize::new(SMALL_SIZE.0, SMALL_SIZE.1));
        }
        if shell.cvars.get("rt_backend").as_deref() == Some("cpu") {
            shell
                .log
                .warn("the CPU tracer has no window: rt_backend is as if it were auto");
        }
        shell.names = folders.names(&source.files);
        shell
            .log
            .say(format!("^5q3rays {}^7 - {}", env!("CARGO_PKG_VERSION"), screen.line));
        for warning in &source.files.warnings {
            shell.log.warn(warning);
        }
        let ui = Ui::new(source.files.clone(), !again);
        let platform = egui_winit::State::new(
            ui.context.clone(),
            egui::ViewportId::ROOT,
            &window,
            Some(window.scale_factor() as f32),
            None,
            Some(screen.device.limits().max_image_dimension as usize),
        );
        let mut game = Self {
            level: None,
            loading: None,
            abandoned: Vec::new(),
            screen,
            platform,
            ui,
            shell,
            config,
            folders,
            source,
            device,
            input: Input::default(),
            recorder: None,
            playback: None,
            stats: None,
            whole_run: stats,
            films: Vec::new(),
            shown: None,
            resume,
            recent: VecDeque::new(),
            pace: VecDeque::new(),
            focused: false,
            captured: false,
            alt: false,
            last_frame: Instant::now(),
            last_report: Instant::now(),
            notice: None,
            log_seen,
            applied,
            lost,
            frames_left: frames,
            quit: false,
            restart: false,
            #[cfg(feature = "gamepad")]
            pads: super::gamepad::Pads::new(),
            #[cfg(feature = "compile-shaders")]
            shaders: super::shader_watch::ShaderWatch::new(),
            window,
        };
        // Scripts of the user's own come first, the command line's commands once the map is there.
        game.run_console();
        match map {
            Some(map) => game.load(&map),
            // Those scripts may have named one.
            None if game.loading.is_none() => game.load(fly_through::MAP),
            None => {}
        }
        game.shell.push(&commands);
        game.shell.hold();
        Ok(game)
    }

    /// Lets go of the device, opens it anew and loads the map again; the player stays where they are.
    ///
    /// # Errors
    /// One sentence where there is no device any more.
    pub fn reopen(mut self) -> Result<Self, CliError> {
        self.put_down();
        let coming = self.loading.as_ref().map(|loading| loading.map.clone());
        self.join_threads();
        let level = self.level.take();
        let resume = self.resume.take().or_else(|| {
            level.as_ref().map(|level| Resume {
                map: level.map.clone(),
                state: level.play.state(),
                camera: level.camera,
                time: level.time,
            })
        });
        let mut start = Start {
            map: coming.or(level.as_ref().map(|l| l.map.clone())),
            source: self.source.clone(),
            folders: self.folders.clone(),
            device: self.device.clone(),
            frames: self.frames_left,
            stats: self.whole_run.take(),
            lost: self.lost,
            commands: String::new(),
            log_seen: self.log_seen,
            resume,
            shell: std::mem::take(&mut self.shell),
            config: self.config,
        };
        start.shell.hold();
        let window = self.window.clone();
        let (applied, focused, captured) = (self.applied, self.focused, self.captured);
        // A window has one device at a time.
        drop((level, self.screen));
        let mut game = Self::new(window, start).map_err(|e| match e {
            // Nothing else begins in the middle of a game.
            CliError::NoWindow(reason) => CliError::Failed(reason),
            other => other,
        })?;
        (game.applied, game.focused, game.captured) = (applied, focused, captured);
        Ok(game)
    }

    /// Writes what is being recorded and what is kept; what goes wrong is told.
    fn put_down(&mut self) {
        self.end_recording();
        if let Err(e) = self.end_playback() {
            eprintln!("warning: the playback's times are not kept: {e}");
        }
        if let Some(level) = &mut self.level {
            match level.realtime.finish() {
                Ok(rest) => rest.into_iter().for_each(|stats| self.note_stats(stats)),
                Err(e) => eprintln!("warning: {e}"),
            }
        }
        if let Some(run) = self.stats.take()
            && let Err(e) = self.write_stats(&run)
        {
            eprintln!("warning: {e}");
        }
        if let Err(e) = self.config.write(&self.shell) {
            eprintln!("warning: the settings are not kept: {e}");
        }
    }

    /// Waits for all that still uses the device. Films are cut short.
    fn join_threads(&mut self) {
        for film in self.films.drain(..) {
            eprintln!("warning: the {} is cut short", film.note);
            drop(film.news);
            if film.worker.join().is_err() {
                tracing::warn!("the film {} broke off", film.name);
            }
        }
        self.abandoned.extend(self.loading.take());
        self.abandoned.drain(..).for_each(Loading::join);
    }

    /// Ends: writes what is to be kept and waits for the GPU.
    ///
    /// # Errors
    /// One sentence where the run's frame times cannot be written.
    pub fn close(mut self) -> Result<(), CliError> {
        self.put_down();
        self.join_threads();
        self.idle();
        match self.whole_run.take() {
            Some(run) => self.write_stats(&run).map_err(CliError::Failed),
            None => Ok(()),
        }
    }
}

fn open_screen(
    window: &Arc<Window>,
    cvars: &Cvars,
    device: &str,
    folders: &Folders,
    mode: PresentMode,
) -> Result<Screen, GpuError> {
    let backend = BackendChoice::from_word(&cvars.get("rt_backend").unwrap_or_default());
    Screen::new(
        window,
        &ScreenOptions {
            backend,
            device,
            mode,
            pipelines: &folders.pipelines(),
        },
    )
}
