//! The overlay: console, menu, settings, maps, times. It changes nothing by itself: what is chosen becomes console commands.

mod console;
mod hud;
mod maps;
mod menu;
mod perf;
mod settings;
mod style;

use super::loading::Progress;
use crate::assets::vfs::Vfs;
use crate::console::Shell;
use crate::console::shell::Panel;
use crate::game::movement::Mode;
use crate::output::stats::FrameStats;
use crate::scene::camera::Camera;
use std::collections::VecDeque;
use std::sync::Arc;

/// How long hints stay, seconds.
const HINTS: f64 = 20.0;

/// What the overlay shows of the program's state.
#[derive(Default)]
pub struct Facts<'a> {
    pub map: &'a str,
    /// Device and backend.
    pub line: &'a str,
    /// Size of the traced image and of the window, pixels.
    pub sizes: [(u32, u32); 2],
    /// Statistics of the last frames, oldest first.
    pub recent: Option<&'a VecDeque<FrameStats>>,
    /// Time from frame to frame, milliseconds, oldest first.
    pub pace: Option<&'a VecDeque<f32>>,
    pub player: Option<PlayerFacts>,
    /// PVS cluster of the eye, and its lights.
    pub lights: Option<(u32, usize)>,
    /// Samples averaged, and their relative standard error where it is known.
    pub samples: u32,
    pub error: Option<f32>,
    pub loading: Option<(&'a str, Progress, f32)>,
    /// What goes on beside: recordings, films.
    pub notes: Vec<String>,
    /// The way is being recorded.
    pub recording: bool,
    /// What has just happened.
    pub notice: Option<&'a str>,
    /// Of GPU memory taken, bytes.
    pub memory: u64,
}

/// The player, as the corners of the picture tell of them.
pub struct PlayerFacts {
    pub camera: Camera,
    pub speed: f32,
    pub health: f32,
    pub mode: Mode,
    /// They look at a recording.
    pub watching: bool,
}

/// Which panels are open, and what they remember.
pub struct Ui {
    pub context: egui::Context,
    console: console::ConsolePanel,
    settings: settings::SettingsPanel,
    maps: maps::MapPanel,
    console_open: bool,
    menu_open: bool,
    settings_open: bool,
    maps_open: bool,
    /// Events that came before the console was opened: they are for what was open then.
    earlier: Vec<egui::Event>,
    /// Events that the console has still to see, in later frames.
    later: Vec<egui::Event>,
    /// Hints for those who are here for the first time are shown until then, seconds.
    hints_until: f64,
}

impl Ui {
    /// Nothing open. `hints`: somebody may be here for the first time.
    pub fn new(files: Arc<Vfs>, hints: bool) -> Self {
        let context = egui::Context::default();
        style::apply(&context);
        Self {
            context,
            console: console::ConsolePanel::default(),
            settings: settings::SettingsPanel::default(),
            maps: maps::MapPanel::new(files),
            console_open: false,
            menu_open: false,
            settings_open: false,
            maps_open: false,
            earlier: Vec::new(),
            later: Vec::new(),
            hints_until: if hints { HINTS } else { 0.0 },
        }
    }

    /// Opens or closes a panel. `before`: events that came before, none of which a frame has seen; what was typed into the console until
    /// it closes is still done.
    pub fn toggle(&mut self, panel: Panel, before: &mut Vec<egui::Event>) {
        if self.console_open {
            self.later.append(before);
        } else if panel == Panel::Console {
            self.earlier.append(before);
        }
        let open = match panel {
            Panel::Console => &mut self.console_open,
            Panel::Menu => {
                // What closes the menu closes all.
                if self.wants_pointer() {
                    self.close_all();
                    return;
                }
                &mut self.menu_open
            }
            Panel::Settings => &mut self.settings_open,
            Panel::Maps => &mut self.maps_open,
        };
        *open = !*open;
        if panel == Panel::Console && self.console_open {
            self.console.focus();
        }
    }

    /// Closes what is open.
    pub fn close_all(&mut self) {
        self.settings.end_binding();
        (self.console_open, self.menu_open, self.settings_open, self.maps_open) = (false, false, false, false);
    }

    /// Whether keys and mouse are for the overlay.
    pub fn wants_pointer(&self) -> bool {
        self.console_open || self.menu_open || self.settings_open || self.maps_open
    }

    /// Whether the console is open, where keys are text.
    pub fn console_is_open(&self) -> bool {
        self.console_open
    }

    /// A key went down while the overlay waits for one to bind. True where it did.
    pub fn take_key(&mut self, key: &str, shell: &mut Shell) -> bool {
        self.settings.take_key(key, shell)
    }

    /// Keys that do something with the console's line act on what was typed before them, and not on what is typed after: where one frame
    /// brings several, the rest waits for the next.
    fn in_order(&mut self, mut input: egui::RawInput, console_shown: bool) -> egui::RawInput {
        let earlier = std::mem::take(&mut self.earlier);
        let mut events = std::mem::take(&mut self.later);
        events.append(&mut input.events);
        if console_shown && self.console.is_new() {
            // Its line has the keys once it has been drawn.
            self.later = std::mem::take(&mut events);
        } else if console_shown {
            console::drop_repeats(&mut events);
            let acts = events.iter().position(console::acts_on_line);
            let cut = match acts {
                Some(0) => 1 + usize::from(events.len() > 1 && console::is_release(&events[1])),
                Some(at) => at,
                None => events.len(),
            };
            self.later = events.split_off(cut);
        }
        input.events = earlier;
        input.events.append(&mut events);
        input
    }

    /// Builds the overlay for a frame.
    pub fn show(&mut self, input: egui::RawInput, facts: &Facts<'_>, shell: &mut Shell) -> egui::FullOutput {
        // What was typed until it closed has still to be done.
        let console_shown = self.console_open || !self.later.is_empty();
        let input = self.in_order(input, console_shown);
        self.context.set_zoom_factor(shell.cvars.number("con_scale") as f32);
        let context = self.context.clone();
        context.run_ui(input, |ui| {
            let ctx = ui.ctx().clone();
            hud::show(&ctx, facts, shell, self.hints_until, self.wants_pointer());
            if shell.cvars.number("rt_printPerfStats") != 0.0 {
                perf::show(&ctx, facts);
            }
            if self.settings_open {
                self.settings.show(&ctx, &mut self.settings_open, facts, shell);
            }
            if self.maps_open && self.maps.show(&ctx, &mut self.maps_open, shell) {
                self.close_all();
            }
            if self.menu_open {
                match menu::show(&ctx, facts, shell) {
                    Some(menu::Choice::Resume) => self.menu_open = false,
                    Some(menu::Choice::Open(panel)) => {
                        self.menu_open = false;
                        self.toggle(panel, &mut Vec::new());
                    }
                    None => {}
                }
            }
            if console_shown || self.console_open {
                self.console.show(&ctx, shell);
            }
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use egui::{Event, Key, Modifiers, RawInput};

    fn text(text: &str) -> Event {
        Event::Text(text.to_owned())
    }

    fn press(key: Key, pressed: bool) -> Event {
        Event::Key {
            key,
            physical_key: None,
            pressed,
            repeat: false,
            modifiers: Modifiers::NONE,
        }
    }

    /// What a frame brings, and what of it the overlay gets to see then.
    fn frame(ui: &mut Ui, events: Vec<Event>) -> Vec<Event> {
        let shown = ui.console_open || !ui.later.is_empty();
        let input = RawInput {
            events,
            ..RawInput::default()
        };
        let seen = ui.in_order(input, shown).events;
        if shown && ui.console.is_new() {
            ui.console.drawn();
        }
        seen
    }

    #[test]
    fn what_was_typed_before_the_console_opened_is_not_its() {
        let mut ui = Ui::new(Arc::new(Vfs::mount(&[], &[])), false);
        ui.toggle(Panel::Settings, &mut Vec::new());
        ui.toggle(Panel::Console, &mut vec![text("search")]);
        assert_eq!(frame(&mut ui, vec![text("typed")]), [text("search")]);
        assert_eq!(frame(&mut ui, Vec::new()), [text("typed")]);
    }

    #[test]
    fn what_was_typed_until_the_console_closed_is_done() {
        let mut ui = Ui::new(Arc::new(Vfs::mount(&[], &[])), false);
        ui.toggle(Panel::Console, &mut Vec::new());
        let (down, up) = (press(Key::Enter, true), press(Key::Enter, false));
        ui.toggle(Panel::Console, &mut vec![text("echo"), down.clone(), up.clone()]);
        assert!(!ui.wants_pointer());
        assert_eq!(frame(&mut ui, Vec::new()), []);
        assert_eq!(frame(&mut ui, Vec::new()), [text("echo")]);
        assert_eq!(frame(&mut ui, Vec::new()), [down, up]);
        assert!(ui.later.is_empty());
    }

    #[test]
    fn a_held_key_ends_when_it_is_let_go() {
        let mut ui = Ui::new(Arc::new(Vfs::mount(&[], &[])), false);
        ui.toggle(Panel::Console, &mut Vec::new());
        assert_eq!(frame(&mut ui, Vec::new()), []);
        let (down, up) = (press(Key::ArrowUp, true), press(Key::ArrowUp, false));
        let mut events = vec![down.clone(); 20];
        events.push(up.clone());
        assert_eq!(frame(&mut ui, events), [down.clone(), up.clone()]);
        assert!(ui.later.is_empty());
        // Pressed twice, it acts twice.
        let twice = vec![down.clone(), up.clone(), down.clone(), up.clone()];
        assert_eq!(frame(&mut ui, twice), [down.clone(), up.clone()]);
        assert_eq!(frame(&mut ui, Vec::new()), [down, up]);
    }
}
