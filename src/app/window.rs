//! The window's events.

use super::game::Game;
use crate::cli::CliError;
use std::sync::Arc;
use winit::application::ApplicationHandler;
use winit::dpi::PhysicalSize;
use winit::event::{DeviceEvent, DeviceId, WindowEvent};
use winit::event_loop::{ActiveEventLoop, ControlFlow, EventLoop};
use winit::window::{Window, WindowId};

pub use super::lifecycle::{Start, StatsRun};

/// First size of the window's inside.
const SIZE: (u32, u32) = (1280, 720);

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
pub fn run(start: Start) -> Result<(), CliError> {
    let event_loop =
        EventLoop::new().map_err(|e| CliError::NoWindow(format!("cannot open a window ({e}): running without one")))?;
    event_loop.set_control_flow(ControlFlow::Poll);
    let mut app = App {
        start: Some(start),
        game: None,
        failure: None,
    };
    event_loop
        .run_app(&mut app)
        .map_err(|e| CliError::Failed(format!("the window failed: {e}")))?;
    app.failure.map_or(Ok(()), Err)
}

struct App {
    /// Until the window is there.
    start: Option<Start>,
    game: Option<Game>,
    failure: Option<CliError>,
}

impl App {
    fn fail(&mut self, event_loop: &ActiveEventLoop, error: CliError) {
        self.failure.get_or_insert(error);
        event_loop.exit();
    }

    fn open(event_loop: &ActiveEventLoop, start: Start) -> Result<Game, CliError> {
        let attributes = Window::default_attributes()
            .with_title("q3rays")
            .with_inner_size(PhysicalSize::new(SIZE.0, SIZE.1));
        let window = event_loop.create_window(attributes).map_err(CliError::failed)?;
        Game::new(Arc::new(window), start)
    }
}

impl ApplicationHandler for App {
    fn resumed(&mut self, event_loop: &ActiveEventLoop) {
        if let Some(start) = self.start.take() {
            match Self::open(event_loop, start) {
                Ok(game) => self.game = Some(game),
                Err(e) => self.fail(event_loop, e),
            }
        }
    }

    fn window_event(&mut self, _: &ActiveEventLoop, _: WindowId, event: WindowEvent) {
        if let Some(game) = &mut self.game {
            game.window_event(&event);
        }
    }

    fn device_event(&mut self, _: &ActiveEventLoop, _: DeviceId, event: DeviceEvent) {
        if let (Some(game), DeviceEvent::MouseMotion { delta }) = (&mut self.game, event) {
            game.mouse_moved(delta.0, delta.1);
        }
    }

    fn about_to_wait(&mut self, event_loop: &ActiveEventLoop) {
        let Some(game) = &mut self.game else { return };
        match game.frame() {
            Ok(()) if game.quit => event_loop.exit(),
            Ok(()) if game.restart => match self.game.take().map(Game::reopen) {
                Some(Ok(game)) => self.game = Some(game),
                Some(Err(e)) => self.fail(event_loop, e),
                None => {}
            },
            Ok(()) => {}
            Err(e) => self.fail(event_loop, e),
        }
    }

    fn exiting(&mut self, _: &ActiveEventLoop) {
        if let Some(game) = self.game.take()
            && let Err(e) = game.close()
        {
            self.failure.get_or_insert(e);
        }
    }
}
