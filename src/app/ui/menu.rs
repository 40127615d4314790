//! The menu: what there is to do, for those who know no command yet.

use super::Facts;
use super::style::ACCENT;
use crate::console::Shell;
use crate::console::shell::Panel;
use egui::{Align2, FontId, RichText, vec2};

/// What was chosen that is the overlay's own affair.
pub enum Choice {
    Resume,
    Open(Panel),
}

/// Recordings that are listed.
const MOST_RECORDINGS: usize = 8;

/// Shows it in the middle.
pub fn show(ctx: &egui::Context, facts: &Facts<'_>, shell: &mut Shell) -> Option<Choice> {
    let mut choice = None;
    egui::Window::new("menu")
        .title_bar(false)
        .resizable(false)
        .anchor(Align2::CENTER_CENTER, vec2(0.0, 0.0))
        .show(ctx, |ui| {
            ui.set_width(260.0);
            ui.vertical_centered_justified(|ui| {
                ui.label(RichText::new("q3rays").font(FontId::proportional(28.0)).color(ACCENT));
                if !facts.map.is_empty() {
                    ui.label(facts.map);
                }
                let entry = |ui: &mut egui::Ui, text: &str, command: &str| {
                    let key = shell.binds.shown_key(command).map(str::to_owned);
                    let button = egui::Button::new(RichText::new(text).size(17.0));
                    ui.add(button.right_text(RichText::new(key.unwrap_or_default()).weak()))
                        .clicked()
                };
                if entry(ui, "Resume", "togglemenu") {
                    choice = Some(Choice::Resume);
                }
                for (text, command, panel) in [
                    ("Maps", "maps", Panel::Maps),
                    ("Settings, views, keys", "settings", Panel::Settings),
                    ("Console", "toggleconsole", Panel::Console),
                ] {
                    if entry(ui, text, command) {
                        choice = Some(Choice::Open(panel));
                    }
                }
                recordings(ui, facts, shell, &mut choice);
                if ui.add(egui::Button::new(RichText::new("Quit").size(17.0))).clicked() {
                    shell.push("quit");
                }
                ui.separator();
                ui.label(RichText::new(facts.line).small().weak());
            });
        });
    choice
}

fn recordings(ui: &mut egui::Ui, facts: &Facts<'_>, shell: &mut Shell, choice: &mut Option<Choice>) {
    ui.collapsing("Recordings", |ui| {
        let mut run = |ui: &mut egui::Ui, text: &str, command: &str| {
            if ui.button(text).clicked() {
                shell.push(command);
                *choice = Some(Choice::Resume);
            }
        };
        let watching = facts.player.as_ref().is_some_and(|p| p.watching);
        if facts.recording {
            run(ui, "End the recording", "stoprecord");
        } else if watching {
            run(ui, "End the playback", "stopplayback");
        } else {
            run(ui, "Record my way", "record");
        }
        let names: Vec<String> = shell
            .names
            .recordings
            .iter()
            .rev()
            .take(MOST_RECORDINGS)
            .cloned()
            .collect();
        for name in names {
            if ui.button(format!("Show {name}")).clicked() {
                shell.push(&format!("playback \"{name}\""));
                *choice = Some(Choice::Resume);
            }
        }
    });
}
