//! Every variable with what it does, the frame's intermediate images, and the keys.

use super::Facts;
use super::style::ACCENT;
use crate::console::Shell;
use crate::console::binds::key_name;
use crate::console::commands::BUTTONS;
use crate::console::table::{CVARS, Cvar, Kind, VIEWS};
use crate::console::tokens::quoted;
use egui::{ComboBox, DragValue, RichText, ScrollArea, Slider, vec2};

/// Largest whole number that gets a slider; larger ranges are dragged.
const SLIDER_RANGE: i64 = 128;

/// Width of the window, points.
const WIDTH: f32 = 440.0;

/// Parts of the window.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum Tab {
    #[default]
    Rays,
    Game,
    Window,
    Views,
    Keys,
}

/// What the window remembers.
#[derive(Default)]
pub struct SettingsPanel {
    tab: Tab,
    search: String,
    /// Command that waits for a key.
    binding: Option<String>,
}

/// The tab that a variable belongs to, by its name's beginning.
fn tab_of(cvar: &Cvar) -> Tab {
    match cvar.name.split_once('_').map_or(cvar.name, |(start, _)| start) {
        "rt" => Tab::Rays,
        "r" | "com" | "con" => Tab::Window,
        _ => Tab::Game,
    }
}

/// Commands that are offered for keys, beside those that are held.
const COMMANDS: [(&str, &str); 14] = [
    ("toggleconsole", "console"),
    ("togglemenu", "menu"),
    ("settings", "settings"),
    ("maps", "maps"),
    ("noclip", "through walls"),
    ("fly", "fly"),
    ("kill", "back to a spawn"),
    ("screenshot", "picture"),
    ("record", "record"),
    ("stoprecord", "end of the recording"),
    ("toggle rt_refine", "refine the still picture"),
    ("toggle rt_pause", "stop the clock"),
    ("toggle rt_printPerfStats", "times"),
    ("toggle r_fullscreen", "whole screen"),
];

impl SettingsPanel {
    /// Waits for no key any more.
    pub fn end_binding(&mut self) {
        self.binding = None;
    }

    /// A key went down: binds it where one is waited for. Escape leaves things as they are.
    pub fn take_key(&mut self, key: &str, shell: &mut Shell) -> bool {
        let Some(command) = self.binding.take() else {
            return false;
        };
        if key != "ESCAPE"
            && let Some(key) = key_name(key)
        {
            shell.push(&format!("bind {} {}", quoted(&key), quoted(&command)));
        }
        true
    }

    /// Shows the window.
    pub fn show(&mut self, ctx: &egui::Context, open: &mut bool, facts: &Facts<'_>, shell: &mut Shell) {
        let screen = ctx.content_rect();
        egui::Window::new("Settings")
            .open(open)
            // The times are on the other side.
            .default_pos(screen.right_top() + vec2(-24.0 - WIDTH, 24.0))
            .default_size(vec2(WIDTH, screen.height() * 0.75))
            .show(ctx, |ui| {
                ui.horizontal(|ui| {
                    for (tab, name) in [
                        (Tab::Rays, "Rays and light"),
                        (Tab::Game, "Game"),
                        (Tab::Window, "Window"),
                        (Tab::Views, "Views"),
                        (Tab::Keys, "Keys"),
                    ] {
                        ui.selectable_value(&mut self.tab, tab, name);
                    }
                });
                ui.separator();
                match self.tab {
                    Tab::Views => views(ui, shell),
                    Tab::Keys => self.keys(ui, shell),
                    tab => self.variables(ui, tab, facts, shell),
                }
            });
    }

    fn variables(&mut self, ui: &mut egui::Ui, tab: Tab, facts: &Facts<'_>, shell: &mut Shell) {
        ui.horizontal(|ui| {
            ui.label("Search");
            ui.text_edit_singleline(&mut self.search);
            if ui.button("All to default").clicked() {
                for c in CVARS.iter().filter(|c| tab_of(c) == tab) {
                    shell.push(&format!("set {} {}", c.name, quoted(&c.default_text())));
                }
            }
        });
        ui.label(RichText::new(facts.line).small().weak());
        let part = self.search.trim().to_lowercase();
        let matches = |c: &&Cvar| c.name.to_lowercase().contains(&part) || c.help.to_lowercase().contains(&part);
        ScrollArea::vertical().auto_shrink([false, false]).show(ui, |ui| {
            for c in CVARS
                .iter()
                .filter(|c| tab_of(c) == tab || !part.is_empty())
                .filter(matches)
            {
                variable(ui, c, shell);
            }
        });
    }

    fn keys(&mut self, ui: &mut egui::Ui, shell: &mut Shell) {
        ui.label("Choose one and press a key, a mouse button or a gamepad's button for it; Escape leaves it as it is.");
        let held = BUTTONS.iter().map(|(_, name, help)| (format!("+{name}"), *help));
        let others = COMMANDS.iter().map(|(command, what)| ((*command).to_owned(), *what));
        let rows: Vec<(String, &str)> = held.chain(others).collect();
        ScrollArea::vertical().auto_shrink([false, false]).show(ui, |ui| {
            egui::Grid::new("keys").num_columns(3).striped(true).show(ui, |ui| {
                for (command, what) in rows {
                    let keys: Vec<&str> = shell.binds.keys_of(&command).collect();
                    let keys = keys.join(", ");
                    let waits = self.binding.as_ref() == Some(&command);
                    ui.label(what).on_hover_text(&command);
                    let text = if waits {
                        "press a key…".to_owned()
                    } else if keys.is_empty() {
                        "–".to_owned()
                    } else {
                        keys.clone()
                    };
                    if ui
                        .add(egui::Button::new(text).min_size(vec2(150.0, 0.0)).selected(waits))
                        .clicked()
                    {
                        self.binding = Some(command.clone());
                    }
                    if ui.small_button("clear").clicked() {
                        for key in keys.split(", ").filter(|k| !k.is_empty()) {
                            shell.push(&format!("unbind {}", quoted(key)));
                        }
                    }
                    ui.end_row();
                }
            });
        });
    }
}

/// The frame's intermediate images.
fn views(ui: &mut egui::Ui, shell: &mut Shell) {
    ui.label("What the frame is made of (rt_view). The number keys choose some of them.");
    let now = shell.cvars.get("rt_view").unwrap_or_default();
    ScrollArea::vertical().auto_shrink([false, false]).show(ui, |ui| {
        ui.horizontal_wrapped(|ui| {
            for view in VIEWS {
                let key = shell
                    .binds
                    .keys_of(&format!("rt_view {view}"))
                    .next()
                    .map(str::to_owned);
                let text = key.map_or_else(|| view.to_owned(), |k| format!("{view} [{k}]"));
                let button = egui::Button::selectable(now == view, text).min_size(vec2(110.0, 22.0));
                if ui.add(button).clicked() {
                    shell.push(&format!("rt_view {view}"));
                }
            }
        });
    });
}

/// A variable: its name, what it does, and something to change it with.
fn variable(ui: &mut egui::Ui, cvar: &Cvar, shell: &mut Shell) {
    let value = shell.cvars.number(cvar.name);
    let mut set = None;
    ui.horizontal(|ui| {
        let changed = shell.cvars.get(cvar.name).unwrap_or_default() != cvar.default_text();
        let name = RichText::new(cvar.name).monospace();
        ui.label(if changed { name.color(ACCENT) } else { name })
            .on_hover_text(cvar.help);
        ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
            if ui.add_enabled(changed, egui::Button::new("reset").small()).clicked() {
                set = Some(cvar.default_text());
            }
            match cvar.kind {
                Kind::Int { min: 0, max: 1, .. } => {
                    let mut on = value != 0.0;
                    if ui.checkbox(&mut on, "").changed() {
                        set = Some(u8::from(on).to_string());
                    }
                }
                Kind::Int { min, max, .. } => {
                    let mut whole = value as i64;
                    let changed = if max - min <= SLIDER_RANGE {
                        ui.add(Slider::new(&mut whole, min..=max)).changed()
                    } else {
                        ui.add(DragValue::new(&mut whole).range(min..=max)).changed()
                    };
                    set = changed.then(|| whole.to_string()).or(set.take());
                }
                Kind::Float { min, max, .. } => {
                    let mut number = value;
                    let speed = (number.abs() * 0.01).max((max - min).min(1.0) * 0.005);
                    let drag = DragValue::new(&mut number)
                        .range(min..=max)
                        .speed(speed)
                        .max_decimals(4);
                    if ui.add(drag).changed() {
                        set = Some(number.to_string());
                    }
                }
                Kind::Choice(words) => {
                    let mut at = value as usize;
                    let shown = words.get(at).copied().unwrap_or_default();
                    ComboBox::from_id_salt(cvar.name)
                        .selected_text(shown)
                        .show_ui(ui, |ui| {
                            for (i, word) in words.iter().enumerate() {
                                ui.selectable_value(&mut at, i, *word);
                            }
                        });
                    if at != value as usize {
                        set = words.get(at).map(|w| (*w).to_owned());
                    }
                }
            }
        });
    });
    ui.label(RichText::new(cvar.help).small().weak());
    ui.add_space(4.0);
    if let Some(value) = set {
        shell.push(&format!("set {} {}", cvar.name, quoted(&value)));
    }
}
