//! The console: its text, and a line to type into.

use super::style::{CODES, SHADE};
use crate::console::Shell;
use crate::console::complete::{Candidate, complete};
use crate::console::log::runs;
use egui::text::{CCursor, CCursorRange, LayoutJob, TextFormat};
use egui::{Color32, FontId, Key, Modifiers, RichText, ScrollArea, TextEdit, vec2};

/// Lines that were typed, kept for going back.
const MOST_HISTORY: usize = 256;
/// Share of the window's height.
const HEIGHT: f32 = 0.55;
/// Candidates that are listed under the line, where there is room.
const MOST_SHOWN: usize = 16;
/// Lines by which a page key scrolls.
const PAGE: f32 = 10.0;

/// What the console remembers.
#[derive(Default)]
pub struct ConsolePanel {
    line: String,
    history: Vec<String>,
    /// Place in the history; its length where the line is new.
    place: usize,
    candidates: Vec<Candidate>,
    wants_focus: bool,
    /// Points by which to scroll, from the page keys.
    scroll: f32,
}

impl ConsolePanel {
    /// Whether it has been opened and not been drawn since: its line has no keys yet.
    pub fn is_new(&self) -> bool {
        self.wants_focus
    }

    #[cfg(test)]
    pub fn drawn(&mut self) {
        self.wants_focus = false;
    }

    /// The line gets the keys.
    pub fn focus(&mut self) {
        self.wants_focus = true;
        self.place = self.history.len();
    }

    /// Shows it over the upper half of the window.
    pub fn show(&mut self, ctx: &egui::Context, shell: &mut Shell) {
        let screen = ctx.content_rect();
        let height = screen.height() * HEIGHT;
        egui::Area::new("console".into())
            .fixed_pos(screen.min)
            .order(egui::Order::Foreground)
            .show(ctx, |ui| {
                egui::Frame::NONE
                    .fill(Color32::from_rgba_premultiplied(10, 10, 14, 232))
                    .inner_margin(6)
                    .show(ui, |ui| {
                        ui.set_width(screen.width() - 12.0);
                        ui.set_height(height);
                        self.contents(ui, height, shell);
                    });
                let rect = ui.min_rect();
                ui.painter()
                    .hline(rect.x_range(), rect.bottom(), (2.0, super::style::ACCENT));
            });
    }

    fn contents(&mut self, ui: &mut egui::Ui, height: f32, shell: &mut Shell) {
        let row = ui.text_style_height(&egui::TextStyle::Monospace);
        let below = row * 2.6;
        self.text(ui, height - below, shell);
        ui.separator();
        self.keys(ui, shell);
        ui.horizontal(|ui| {
            if ui.small_button("copy all").clicked() {
                ui.ctx().copy_text(shell.log.plain());
            }
            ui.label(RichText::new("]").monospace().color(super::style::ACCENT));
            let id = egui::Id::new("console line");
            let edit = TextEdit::singleline(&mut self.line)
                .id(id)
                .font(egui::TextStyle::Monospace)
                .frame(egui::Frame::NONE)
                .desired_width(f32::INFINITY)
                .lock_focus(true)
                .hint_text("type a command; Tab completes, Up goes back, help tells more")
                .show(ui);
            if self.wants_focus || !edit.response.has_focus() {
                edit.response.request_focus();
                let mut state = edit.state;
                let end = CCursor::new(self.line.chars().count());
                state.cursor.set_char_range(Some(CCursorRange::one(end)));
                state.store(ui.ctx(), id);
                self.wants_focus = false;
            }
            if edit.response.changed() {
                self.candidates.clear();
            }
        });
        self.list_candidates(ui);
    }

    /// The text, scrolled to its end until somebody scrolls back.
    fn text(&mut self, ui: &mut egui::Ui, height: f32, shell: &mut Shell) {
        let font = FontId::monospace(ui.text_style_height(&egui::TextStyle::Monospace) * 0.85);
        let scrolled = std::mem::take(&mut self.scroll);
        let width = ui.available_width();
        ScrollArea::vertical()
            .max_height(height)
            .min_scrolled_height(height)
            .auto_shrink([false, false])
            .stick_to_bottom(true)
            .show(ui, |ui| {
                ui.set_width(width);
                ui.spacing_mut().item_spacing.y = 0.0;
                if scrolled != 0.0 {
                    ui.scroll_with_delta(vec2(0.0, scrolled));
                }
                for line in shell.log.lines() {
                    ui.label(coloured(line, &font));
                }
            });
    }

    /// Keys that the line must not get.
    fn keys(&mut self, ui: &egui::Ui, shell: &mut Shell) {
        let pressed = |key| ui.input_mut(|i| i.consume_key(Modifiers::NONE, key));
        let row = ui.text_style_height(&egui::TextStyle::Monospace);
        if pressed(Key::PageUp) {
            self.scroll += row * PAGE;
        }
        if pressed(Key::PageDown) {
            self.scroll -= row * PAGE;
        }
        if pressed(Key::ArrowUp) && self.place > 0 {
            self.place -= 1;
            self.recall();
        }
        if pressed(Key::ArrowDown) && self.place < self.history.len() {
            self.place += 1;
            self.recall();
        }
        if pressed(Key::Tab) {
            let completion = complete(&self.line, &shell.names);
            self.line = completion.line;
            self.candidates = if completion.candidates.len() > 1 {
                completion.candidates
            } else {
                Vec::new()
            };
            self.wants_focus = true;
        }
        if pressed(Key::Enter) {
            let line = std::mem::take(&mut self.line);
            self.candidates.clear();
            if !line.trim().is_empty() {
                shell.log.say(format!("^5]{line}"));
                self.history.retain(|l| *l != line);
                self.history.push(line.clone());
                if self.history.len() > MOST_HISTORY {
                    self.history.remove(0);
                }
                shell.push(&line);
            }
            self.place = self.history.len();
            self.wants_focus = true;
        }
    }

    fn recall(&mut self) {
        self.line = self.history.get(self.place).cloned().unwrap_or_default();
        self.candidates.clear();
        self.wants_focus = true;
    }

    fn list_candidates(&self, ui: &egui::Ui) {
        if self.candidates.is_empty() {
            return;
        }
        let corner = ui.min_rect().left_bottom() + vec2(12.0, 8.0);
        let row = ui.text_style_height(&egui::TextStyle::Monospace) + 6.0;
        let room = (ui.ctx().content_rect().bottom() - corner.y) / row - 2.0;
        let shown = (room.max(1.0) as usize).min(MOST_SHOWN);
        egui::Area::new("candidates".into())
            .fixed_pos(corner)
            .constrain(false)
            .order(egui::Order::Tooltip)
            .show(ui.ctx(), |ui| {
                egui::Frame::NONE.fill(SHADE).inner_margin(6).show(ui, |ui| {
                    for c in self.candidates.iter().take(shown) {
                        ui.horizontal(|ui| {
                            ui.label(RichText::new(&c.text).monospace().color(super::style::ACCENT));
                            ui.label(RichText::new(c.help).small());
                        });
                    }
                    if let Some(more @ 1..) = self.candidates.len().checked_sub(shown) {
                        ui.label(RichText::new(format!("and {more} more")).small());
                    }
                });
            });
    }
}

/// Whether an event does something with the whole line.
pub fn acts_on_line(event: &egui::Event) -> bool {
    let egui::Event::Key { key, pressed, .. } = event else {
        return false;
    };
    *pressed && matches!(key, Key::Enter | Key::Tab | Key::ArrowUp | Key::ArrowDown)
}

/// A held key that repeats faster than frames come acts once a frame, and does not go on after it was let go. (Events do not tell yet
/// that they are repeats.)
pub fn drop_repeats(events: &mut Vec<egui::Event>) {
    let mut down = Vec::new();
    events.retain(|event| {
        let egui::Event::Key { key, pressed, .. } = event else {
            return true;
        };
        let repeats = *pressed && down.contains(key) && acts_on_line(event);
        if !*pressed {
            down.retain(|k| k != key);
        } else if !repeats {
            down.push(*key);
        }
        !repeats
    });
}

/// Whether a key was let go.
pub fn is_release(event: &egui::Event) -> bool {
    matches!(event, egui::Event::Key { pressed: false, .. })
}

/// A line in its colours.
fn coloured(line: &str, font: &FontId) -> LayoutJob {
    let mut job = LayoutJob::default();
    for (colour, text) in runs(line) {
        let format = TextFormat {
            font_id: font.clone(),
            color: CODES[usize::from(colour & 7)],
            ..TextFormat::default()
        };
        job.append(&text, 0.0, format);
    }
    if job.is_empty() {
        // An empty line is as high as any.
        job.append(" ", 0.0, TextFormat::simple(font.clone(), CODES[7]));
    }
    job
}
