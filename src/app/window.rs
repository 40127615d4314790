//! The window: walk through a map.

use super::input::Input;
use super::walk::{enter, walk};
use crate::cli::CliError;
use crate::console::Cvars;
use crate::console::cvars::VIEWS;
use crate::console::settings::settings;
use crate::engine::{BackendChoice, open_device};
use crate::game::movement::Mode;
use crate::game::play::Play;
use crate::gpu::{Access, Instance, InstanceOptions, PresentMode, SubmitSync, Surface, Swapchain, Use, ValidationMode};
use crate::output::stats::{FrameStats, Summary};
use crate::render::frame::FrameInput;
use crate::render::realtime::{FRAMES_IN_FLIGHT, Realtime};
use crate::render::scene_gpu::SceneGpu;
use crate::render::settings::Settings;
use crate::scene::Scene;
use crate::scene::bvh::BvhQuality;
use crate::scene::camera::Camera;
use crate::scene::clock::Clock;
use ash::vk;
use std::collections::VecDeque;
use std::sync::Arc;
use std::time::{Duration, Instant};
use winit::application::ApplicationHandler;
use winit::dpi::PhysicalSize;
use winit::event::{DeviceEvent, DeviceId, ElementState, WindowEvent};
use winit::event_loop::{ActiveEventLoop, ControlFlow, EventLoop};
use winit::keyboard::{KeyCode, PhysicalKey};
use winit::raw_window_handle::HasDisplayHandle;
use winit::window::{CursorGrabMode, Fullscreen, Window, WindowId};

/// First size of the window's inside on GPUs, and on CPU-type devices, which are far slower.
const SIZE: (u32, u32) = (1280, 720);
const SMALL_SIZE: (u32, u32) = (640, 360);
/// Longest time that one frame lets go by, seconds.
const LONGEST_STEP: f32 = 0.25;
/// Share of the way to the wanted exposure per second.
const EXPOSURE_RATE: f32 = 2.0;
/// Frames in the title's statistics.
const RECENT: usize = 120;
/// How long to wait where there is nothing to draw to.
const IDLE: Duration = Duration::from_millis(30);

/// What the window is opened with.
pub struct Options {
    pub scene: Scene,
    pub cvars: Cvars,
    pub device: Option<String>,
    /// Close after so many frames; for tests.
    pub frames: Option<u32>,
}

/// Whether a window can be opened here.
pub fn has_display() -> bool {
    if cfg!(any(target_os = "windows", target_os = "macos")) {
        return true;
    }
    ["WAYLAND_DISPLAY", "DISPLAY"]
        .iter()
        .any(|name| std::env::var_os(name).is_some_and(|v| !v.is_empty()))
}

/// Opens the window and runs until it is closed.
///
/// # Errors
/// One sentence where no window or device can be had, or the device fails.
pub fn run(options: Options) -> Result<(), CliError> {
    let event_loop = EventLoop::new().map_err(|e| CliError::Failed(format!("cannot open a window: {e}")))?;
    event_loop.set_control_flow(ControlFlow::Poll);
    let mut app = App {
        options,
        shown: None,
        failure: None,
    };
    event_loop
        .run_app(&mut app)
        .map_err(|e| CliError::Failed(format!("the window failed: {e}")))?;
    app.failure.map_or(Ok(()), Err)
}

struct App {
    options: Options,
    shown: Option<Shown>,
    failure: Option<CliError>,
}

/// Everything that lives as long as the window. Fields are dropped in this order.
struct Shown {
    swapchain: Swapchain,
    realtime: Realtime,
    window: Arc<Window>,
    input: Input,
    play: Play,
    camera: Camera,
    captured: bool,
    last_frame: Instant,
    last_title: Instant,
    recent: VecDeque<FrameStats>,
    frame: u32,
    /// Samples in the accumulation; 0 when something moved.
    accumulated: u32,
    /// Time of the scene, seconds.
    time: f64,
}

fn present_mode(cvars: &Cvars) -> PresentMode {
    if cvars.number("r_swapInterval") != 0.0 {
        PresentMode::Vsync
    } else {
        PresentMode::Immediate
    }
}

impl Shown {
    fn new(event_loop: &ActiveEventLoop, options: &Options) -> Result<Self, CliError> {
        let display = event_loop.display_handle().map_err(CliError::failed)?.as_raw();
        let instance = Instance::new(&InstanceOptions {
            validation: ValidationMode::Off,
            display: Some(display),
        })
        .map_err(CliError::failed)?;
        let attributes = Window::default_attributes()
            .with_title(format!("q3rays - {}", options.scene.name))
            .with_inner_size(PhysicalSize::new(SIZE.0, SIZE.1));
        let window = Arc::new(event_loop.create_window(attributes).map_err(CliError::failed)?);
        if options.cvars.number("r_fullscreen") != 0.0 {
            window.set_fullscreen(Some(Fullscreen::Borderless(None)));
        }
        let surface = Arc::new(Surface::new(&instance, &window).map_err(CliError::failed)?);
        let choice = BackendChoice::from_word(&options.cvars.get("rt_backend").unwrap_or_default());
        let device = options.device.as_deref().unwrap_or("auto");
        let (device, backend) = open_device(choice, device, &instance, Some(&surface)).map_err(CliError::failed)?;
        if device.info().device_type == vk::PhysicalDeviceType::CPU {
            // The answer, where there is one at once, comes as a resize event otherwise.
            let _ = window.request_inner_size(PhysicalSize::new(SMALL_SIZE.0, SMALL_SIZE.1));
        }
        let scene = SceneGpu::new(&device, &options.scene, backend, BvhQuality::Balanced).map_err(CliError::failed)?;
        let size = window.inner_size();
        let mode = present_mode(&options.cvars);
        let swapchain = Swapchain::new(&device, &surface, size.width, size.height, mode, FRAMES_IN_FLIGHT)
            .map_err(CliError::failed)?;
        let realtime =
            Realtime::new(Arc::new(scene), (size.width.max(1), size.height.max(1)), None).map_err(CliError::failed)?;
        let fov = options.cvars.number("cg_fov") as f32;
        let (play, camera) = enter(&options.scene, fov);
        Ok(Self {
            swapchain,
            realtime,
            window,
            input: Input::default(),
            play,
            camera,
            captured: false,
            last_frame: Instant::now(),
            last_title: Instant::now(),
            recent: VecDeque::new(),
            frame: 0,
            accumulated: 0,
            time: 0.0,
        })
    }

    fn capture(&mut self, captured: bool) {
        // Not every platform can lock the pointer, some can only confine it; without either, looking still works while
        // the pointer is inside.
        let grabbed = if captured {
            self.window
                .set_cursor_grab(CursorGrabMode::Locked)
                .or_else(|_| self.window.set_cursor_grab(CursorGrabMode::Confined))
        } else {
            self.window.set_cursor_grab(CursorGrabMode::None)
        };
        if let Err(e) = grabbed {
            tracing::debug!("the pointer cannot be held: {e}");
        }
        self.window.set_cursor_visible(!captured);
        self.captured = captured;
    }

    fn draw(&mut self, cvars: &Cvars) -> Result<(), CliError> {
        let seconds = self.last_frame.elapsed().as_secs_f32().min(LONGEST_STEP);
        self.last_frame = Instant::now();
        let accumulate = cvars.number("rt_accumulate") != 0.0 || cvars.number("rt_refine") != 0.0;
        let frozen = accumulate || cvars.number("rt_pause") != 0.0;
        let scale = if frozen { 1.0 } else { cvars.number("timescale") };
        if !frozen {
            self.time += f64::from(seconds) * scale;
        }
        let moved = walk(
            &mut self.play,
            &mut self.camera,
            &mut self.input,
            cvars.number("sensitivity") as f32,
            seconds * scale as f32,
            (Clock::from_seconds(self.time), frozen),
        );
        let entities = self.play.states();
        let size = self.window.inner_size();
        if size.width == 0 || size.height == 0 {
            std::thread::sleep(IDLE);
            return Ok(());
        }
        let before = self.realtime.view.gbuffer.size;
        self.realtime
            .resize((size.width, size.height))
            .map_err(CliError::failed)?;
        let still = accumulate && !moved && before == (size.width, size.height);
        self.accumulated = if still { self.accumulated + 1 } else { 0 };
        let now = Settings {
            clock: Clock::from_seconds(self.time),
            ..settings(cvars)
        };
        let input = FrameInput {
            camera: self.camera,
            settings: if self.accumulated > 0 {
                now.at_sample(self.frame)
            } else {
                now
            },
            lights: &[],
            polygons: &[],
            entities: &entities,
            sample_index: self.frame,
            accumulated: self.accumulated,
            exposure_blend: (EXPOSURE_RATE * seconds).min(1.0),
            reuse: self.accumulated == 0,
            output: true,
        };
        let swapchain = &mut self.swapchain;
        let mut idle = false;
        let ended = self
            .realtime
            .frame(&input, |shown| {
                let Some(acquired) = swapchain.acquire(shown.frame.slot())? else {
                    idle = true;
                    return shown.frame.submit(SubmitSync::default());
                };
                shown.tracker.pass(
                    &shown.frame.commands(),
                    &[Use::image(shown.image, Access::TransferRead)],
                )?;
                swapchain.record_blit(&shown.frame.commands(), shown.image, &acquired, Access::Present)?;
                shown.frame.submit(acquired.sync())?;
                swapchain.present(acquired)
            })
            .map_err(CliError::failed)?;
        self.frame += 1;
        if idle {
            std::thread::sleep(IDLE);
        }
        if let Some(stats) = ended {
            self.recent.push_back(stats);
            if self.recent.len() > RECENT {
                self.recent.pop_front();
            }
        }
        limit_rate(self.last_frame, cvars.number("com_maxfps"));
        Ok(())
    }

    /// Once a second: the title tells times, and `rt_printPerfStats` the passes.
    fn report(&mut self, map: &str, cvars: &Cvars) {
        if self.last_title.elapsed() < Duration::from_secs(1) {
            return;
        }
        self.last_title = Instant::now();
        let frames: Vec<FrameStats> = self.recent.iter().cloned().collect();
        let s = Summary::of_frames(&frames);
        let view = cvars.get("rt_view").unwrap_or_default();
        let samples = if self.accumulated > 0 {
            format!(" - {} samples", self.accumulated)
        } else {
            String::new()
        };
        let way = match self.play.body.mode {
            Mode::Walk => "walk",
            Mode::Fly => "fly",
            Mode::NoClip => "noclip",
        };
        let health = self.play.health.ceil();
        self.window.set_title(&format!(
            "q3rays - {map} - {:.1} ms (95% {:.1}) - {way} - health {health} - view {view}{samples} - WASD move, Space jump, C crouch, \
             N noclip, mouse look, 0-9 views, P refine, Esc quits",
            s.p50, s.p95
        ));
        if cvars.number("rt_printPerfStats") != 0.0
            && let Some(last) = frames.last()
        {
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
    }
}

/// Sleeps out the rest of a frame under `com_maxfps`.
fn limit_rate(start: Instant, fps: f64) {
    if fps > 0.0 {
        let wanted = Duration::from_secs_f64(1.0 / fps);
        if let Some(rest) = wanted.checked_sub(start.elapsed()) {
            std::thread::sleep(rest);
        }
    }
}

impl App {
    fn fail(&mut self, event_loop: &ActiveEventLoop, error: CliError) {
        self.failure.get_or_insert(error);
        event_loop.exit();
    }

    fn key(&mut self, event_loop: &ActiveEventLoop, code: KeyCode, down: bool) {
        let Some(shown) = &mut self.shown else { return };
        shown.input.key(code, down);
        if !down {
            return;
        }
        const DIGITS: [KeyCode; 10] = [
            KeyCode::Digit0,
            KeyCode::Digit1,
            KeyCode::Digit2,
            KeyCode::Digit3,
            KeyCode::Digit4,
            KeyCode::Digit5,
            KeyCode::Digit6,
            KeyCode::Digit7,
            KeyCode::Digit8,
            KeyCode::Digit9,
        ];
        let toggled = self.options.cvars.number("rt_refine") == 0.0;
        let set = match code {
            KeyCode::Escape => {
                event_loop.exit();
                return;
            }
            KeyCode::KeyN => {
                let body = &mut shown.play.body;
                body.mode = match body.mode {
                    Mode::NoClip => Mode::Walk,
                    _ => Mode::NoClip,
                };
                return;
            }
            KeyCode::KeyP => Some(("rt_refine", u32::from(toggled).to_string())),
            _ => DIGITS
                .iter()
                .position(|d| *d == code)
                .map(|i| ("rt_view", VIEWS[i].to_owned())),
        };
        if let Some((name, value)) = set {
            // Names and values are the table's own.
            if let Err(e) = self.options.cvars.set(name, &value) {
                tracing::warn!("{e}");
            }
            shown.accumulated = 0;
        }
    }
}

impl ApplicationHandler for App {
    fn resumed(&mut self, event_loop: &ActiveEventLoop) {
        if self.shown.is_none() {
            match Shown::new(event_loop, &self.options) {
                Ok(shown) => self.shown = Some(shown),
                Err(e) => self.fail(event_loop, e),
            }
        }
    }

    fn window_event(&mut self, event_loop: &ActiveEventLoop, _: WindowId, event: WindowEvent) {
        let Some(shown) = &mut self.shown else { return };
        match event {
            WindowEvent::CloseRequested => event_loop.exit(),
            WindowEvent::Resized(size) => shown.swapchain.resize(size.width, size.height),
            WindowEvent::Focused(focused) => {
                shown.input.release_all();
                shown.capture(focused);
            }
            WindowEvent::MouseInput {
                state: ElementState::Pressed,
                ..
            } => shown.capture(true),
            WindowEvent::KeyboardInput { event, .. } => {
                // A held key repeats: it is down already.
                if let PhysicalKey::Code(code) = event.physical_key
                    && !event.repeat
                {
                    self.key(event_loop, code, event.state == ElementState::Pressed);
                }
            }
            _ => {}
        }
    }

    fn device_event(&mut self, _: &ActiveEventLoop, _: DeviceId, event: DeviceEvent) {
        if let (Some(shown), DeviceEvent::MouseMotion { delta }) = (&mut self.shown, event)
            && shown.captured
        {
            shown.input.mouse(delta.0, delta.1);
        }
    }

    fn about_to_wait(&mut self, event_loop: &ActiveEventLoop) {
        let Some(shown) = &mut self.shown else { return };
        match shown.draw(&self.options.cvars) {
            Ok(()) => shown.report(&self.options.scene.name, &self.options.cvars),
            Err(e) => return self.fail(event_loop, e),
        }
        if self.options.frames.is_some_and(|n| shown.frame >= n) {
            event_loop.exit();
        }
    }

    fn exiting(&mut self, _: &ActiveEventLoop) {
        // The GPU must be done before window and device go; an error here has been told already or no longer matters.
        if let Some(mut shown) = self.shown.take()
            && let Err(e) = shown.realtime.finish()
        {
            tracing::debug!("at exit: {e}");
        }
    }
}
