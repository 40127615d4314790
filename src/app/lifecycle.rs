//! How the program behind the window begins, begins again and ends.

use super::folders::Folders;
use super::game::Game;
use super::input::Input;
use super::loading::MapSource;
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
    pub map: String,
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
        } = start;
        let applied = Applied {
            fullscreen: false,
            mode: R_MODES[0].to_owned(),
            ..Applied::wanted(&shell.cvars)
        };
        let screen =
            open_screen(&window, &shell.cvars, &device, &folders, applied.present_mode()).map_err(|e| match e {
                GpuError::NoLoader(_) | GpuError::NoDevice => {
                    CliError::NoWindow(format!("the window needs a Vulkan device ({e}): running without one"))
                }
                other => CliError::failed(other),
            })?;
        if screen.on_cpu() && shell.cvars.number("r_mode") == 0.0 {
            // The answer, where there is one at once, comes as a resize event otherwise.
            let _ = window.request_inner_size(PhysicalSize::new(SMALL_SIZE.0, SMALL_SIZE.1));
        }
        shell.names = folders.names(&source.files);
        shell
            .log
            .say(format!("^5q3rays {}^7 - {}", env!("CARGO_PKG_VERSION"), screen.line));
        for warning in &source.files.warnings {
            shell.log.warn(warning);
        }
        let ui = Ui::new(source.files.clone(), resume.is_none());
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
            log_seen: 0,
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
        game.load(&map);
        game.shell.push(&commands);
        game.shell.hold();
        Ok(game)
    }

    /// Lets go of the device, opens it anew and loads the map again; the player stays where they are.
    ///
    /// # Errors
    /// One sentence where there is no device any more.
    pub fn reopen(mut self) -> Result<Self, CliError> {
        self.end_recording();
        let coming = self.loading.take().map(|loading| {
            let map = loading.map.clone();
            loading.abandon();
            map
        });
        let level = self.level.take();
        let resume = level.as_ref().filter(|_| coming.is_none()).map(|level| Resume {
            state: level.play.state(),
            camera: level.camera,
            time: level.time,
        });
        let map = coming.or(level.as_ref().map(|l| l.map.clone()));
        let start = Start {
            map: map.unwrap_or_else(|| fly_through::MAP.to_owned()),
            source: self.source.clone(),
            folders: self.folders.clone(),
            device: self.device.clone(),
            frames: self.frames_left,
            stats: self.whole_run.take(),
            lost: self.lost,
            commands: String::new(),
            resume,
            shell: std::mem::take(&mut self.shell),
            config: self.config,
        };
        let window = self.window.clone();
        let (applied, focused, log_seen) = (self.applied, self.focused, self.log_seen);
        // A window has one device at a time.
        drop((level, self.films, self.screen));
        let mut start = start;
        start.shell.hold();
        let mut game = Self::new(window, start)?;
        (game.applied, game.focused) = (applied, focused);
        game.log_seen = log_seen;
        Ok(game)
    }

    /// Ends: writes what is to be kept and waits for the GPU.
    ///
    /// # Errors
    /// One sentence where the run's frame times cannot be written.
    pub fn close(mut self) -> Result<(), CliError> {
        self.end_recording();
        if let Some(loading) = self.loading.take() {
            loading.abandon();
        }
        if let Err(e) = self.config.write(&self.shell) {
            eprintln!("warning: the settings are not kept: {e}");
        }
        if let Some(level) = &mut self.level {
            let rest = level.realtime.finish().map_err(CliError::failed)?;
            rest.into_iter().for_each(|stats| self.note_stats(stats));
        }
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
