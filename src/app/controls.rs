//! Keys, mouse and gamepad: what of them is for the overlay, and what for the player.

use super::game::Game;
use super::keys;
use crate::console::shell::Panel;
use crate::console::{commands, tokens};
use winit::event::{ElementState, KeyEvent, WindowEvent};
use winit::keyboard::{KeyCode, PhysicalKey};
use winit::window::CursorGrabMode;

impl Game {
    /// The pointer is held while it looks around.
    pub(super) fn capture_pointer(&mut self) {
        let wanted = self.focused && !self.ui.wants_pointer() && self.level.is_some();
        if wanted == self.captured {
            return;
        }
        // Not every platform can lock the pointer, some can only confine it; without either, looking still works while
        // the pointer is inside.
        let grabbed = if wanted {
            self.window
                .set_cursor_grab(CursorGrabMode::Locked)
                .or_else(|_| self.window.set_cursor_grab(CursorGrabMode::Confined))
        } else {
            self.window.set_cursor_grab(CursorGrabMode::None)
        };
        if let Err(e) = grabbed {
            tracing::debug!("the pointer cannot be held: {e}");
        }
        self.window.set_cursor_visible(!wanted);
        self.captured = wanted;
        if !wanted {
            self.input.release_all();
        }
    }

    /// The mouse moved by counts.
    pub fn mouse_moved(&mut self, dx: f64, dy: f64) {
        if self.captured {
            self.input.mouse(dx, dy);
        }
    }

    /// Something happened to the window.
    pub fn window_event(&mut self, event: &WindowEvent) {
        match event {
            WindowEvent::CloseRequested => self.quit = true,
            WindowEvent::Resized(size) => self.screen.resize(size.width, size.height),
            WindowEvent::Focused(focused) => {
                self.focused = *focused;
                self.input.release_all();
            }
            WindowEvent::ModifiersChanged(now) => self.alt = now.state().alt_key(),
            WindowEvent::KeyboardInput { event, .. } if self.key(event) => return,
            WindowEvent::MouseInput { state, button, .. } => {
                if let Some(name) = keys::button_name(*button)
                    && self.press(name, *state == ElementState::Pressed, false)
                {
                    return;
                }
            }
            WindowEvent::MouseWheel { delta, .. } => {
                if let Some(name) = keys::wheel_name(*delta)
                    && (self.press(name, true, false) | self.press(name, false, false))
                {
                    return;
                }
            }
            _ => {}
        }
        // What it answers is about repainting, and every frame is painted.
        let _ = self.platform.on_window_event(&self.window, event);
    }

    /// A key. True where the overlay must not get it.
    fn key(&mut self, event: &KeyEvent) -> bool {
        let PhysicalKey::Code(code) = event.physical_key else {
            return false;
        };
        let down = event.state == ElementState::Pressed;
        if down && self.alt && code == KeyCode::Enter {
            if !event.repeat {
                self.shell.push("toggle r_fullscreen");
            }
            return true;
        }
        // A held key repeats: it is down already.
        match keys::name(code) {
            Some(name) if event.repeat => {
                let panel = self
                    .shell
                    .binds
                    .get(name)
                    .is_some_and(|command| opens_panels(name, command));
                panel || !self.ui.wants_pointer()
            }
            Some(name) => self.press(name, down, true),
            None => false,
        }
    }

    /// A key or button by its name went down or up. True where the overlay must not get it.
    fn press(&mut self, name: &str, down: bool, keyboard: bool) -> bool {
        if !down {
            self.input.release_key(name);
            return !self.ui.wants_pointer();
        }
        if self.ui.take_key(name, &mut self.shell) {
            return true;
        }
        let Some(command) = self.shell.binds.get(name).map(str::to_owned) else {
            // Without any key for it, nobody would get into the menu again.
            if name == "ESCAPE" {
                self.toggle(Panel::Menu);
                return true;
            }
            return !self.ui.wants_pointer();
        };
        if self.ui.wants_pointer() && !(keyboard && opens_panels(name, &command)) {
            return false;
        }
        let mut queued = false;
        for words in tokens::commands(&command) {
            if !queued
                && words.len() == 1
                && let Some(panel) = Panel::of_command(&words[0])
            {
                // At once: the next key may come before the next frame, and is for what is open by then.
                self.toggle(panel);
                continue;
            }
            match words[0].strip_prefix('+').and_then(commands::button) {
                Some(button) => self.input.press(button, name),
                None => {
                    let quoted: Vec<String> = words.iter().map(|w| tokens::quoted(w)).collect();
                    self.shell.push(&quoted.join(" "));
                    queued = true;
                }
            }
        }
        true
    }

    #[cfg(feature = "gamepad")]
    pub(super) fn gamepad(&mut self) {
        for (name, down) in self.pads.poll() {
            // What opens and closes panels works from everywhere.
            self.press(name, down, true);
        }
        self.input.sticks = self.pads.sticks();
    }

    #[cfg(not(feature = "gamepad"))]
    pub(super) fn gamepad(&mut self) {}
}

/// Whether a key opens and closes panels: it does so while one is open, too, where it does not write.
fn opens_panels(name: &str, command: &str) -> bool {
    let panel = Panel::of_command(command);
    let writes = name.chars().count() == 1 && panel != Some(Panel::Console);
    let function = name.len() > 1 && name.starts_with('F');
    (panel.is_some() && !writes) || function
}
