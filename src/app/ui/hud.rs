//! What stands over the picture: crosshair, health, position, what goes on.

use super::style::{ACCENT, TEXT, over_picture};
use super::{Facts, PlayerFacts};
use crate::console::Shell;
use crate::game::movement::Mode;
use egui::{Align2, Color32, FontId, RichText, Stroke, vec2};

/// Share of the crosshair that is left open in the middle.
const GAP: f32 = 0.25;

/// Shows it. `hints_until`: time at which hints for newcomers go, seconds.
pub fn show(ctx: &egui::Context, facts: &Facts<'_>, shell: &Shell, hints_until: f64, covered: bool) {
    let on = |name| shell.cvars.number(name) != 0.0;
    if let Some(player) = &facts.player {
        if on("cg_drawCrosshair") && !covered && !player.watching {
            crosshair(ctx, shell.cvars.number("cg_crosshairSize") as f32);
        }
        if on("cg_drawStatus") {
            corner(ctx, "status", Align2::LEFT_BOTTOM, |ui| status(ui, player));
        }
    }
    let samples = samples(facts);
    if on("cg_drawFPS") || on("cg_drawPosition") || samples.is_some() || !facts.notes.is_empty() {
        corner(ctx, "state", Align2::RIGHT_TOP, |ui| {
            if on("cg_drawFPS") {
                line(ui, &fps(facts));
            }
            if on("cg_drawPosition") {
                position(facts).iter().for_each(|text| line(ui, text));
            }
            samples.iter().chain(&facts.notes).for_each(|text| line(ui, text));
        });
    }
    if let Some((map, progress, seconds)) = &facts.loading {
        loading(ctx, map, &progress.doing, progress.share, *seconds);
    }
    if let Some(notice) = facts.notice {
        let most = ctx.content_rect().width() * 0.7;
        corner_off(ctx, "notice", Align2::CENTER_BOTTOM, 44.0, |ui| {
            ui.set_max_width(most);
            ui.label(RichText::new(notice).monospace().color(TEXT));
        });
    }
    if ctx.input(|i| i.time) < hints_until && !covered {
        corner(ctx, "hints", Align2::CENTER_BOTTOM, |ui| hints(ui, shell));
    }
}

fn corner(ctx: &egui::Context, id: &str, place: Align2, contents: impl FnOnce(&mut egui::Ui)) {
    corner_off(ctx, id, place, 8.0, contents);
}

/// `off`: points from the upper or lower edge.
fn corner_off(ctx: &egui::Context, id: &str, place: Align2, off: f32, contents: impl FnOnce(&mut egui::Ui)) {
    let inward = vec2(8.0, off) * -place.to_sign();
    egui::Area::new(id.to_owned().into())
        .anchor(place, inward)
        .interactable(false)
        .order(egui::Order::Background)
        .show(ctx, |ui| {
            over_picture().show(ui, contents);
        });
}

fn line(ui: &mut egui::Ui, text: &str) {
    ui.add(egui::Label::new(RichText::new(text).monospace().color(TEXT)).wrap_mode(egui::TextWrapMode::Extend));
}

fn crosshair(ctx: &egui::Context, size: f32) {
    let painter = ctx.layer_painter(egui::LayerId::background());
    let centre = ctx.content_rect().center();
    for (width, colour) in [
        (3.0, Color32::from_black_alpha(140)),
        (1.0, Color32::from_white_alpha(220)),
    ] {
        for way in [vec2(1.0, 0.0), vec2(-1.0, 0.0), vec2(0.0, 1.0), vec2(0.0, -1.0)] {
            let ends = [centre + way * size * 0.5 * GAP, centre + way * size * 0.5];
            painter.line_segment(ends, Stroke::new(width, colour));
        }
    }
}

fn status(ui: &mut egui::Ui, player: &PlayerFacts) {
    let text = match (player.watching, player.mode) {
        (true, _) => "PLAYBACK".to_owned(),
        (false, Mode::Walk) => format!("{:.0}", player.health.ceil()),
        (false, Mode::Fly) => "FLY".to_owned(),
        (false, Mode::NoClip) => "NOCLIP".to_owned(),
    };
    let font = FontId::proportional(26.0);
    ui.label(RichText::new(text).font(font).color(ACCENT));
}

fn fps(facts: &Facts<'_>) -> String {
    let pace = facts.pace.map(|p| p.iter().rev().take(30).copied().collect::<Vec<_>>());
    let mean = pace
        .filter(|p| !p.is_empty())
        .map(|p| p.iter().sum::<f32>() / p.len() as f32);
    mean.map_or_else(String::new, |ms| format!("{:.0} fps", 1000.0 / ms.max(1e-3)))
}

fn position(facts: &Facts<'_>) -> Vec<String> {
    let Some(player) = &facts.player else {
        return Vec::new();
    };
    let c = &player.camera;
    let mut out = vec![
        format!("{:.1} {:.1} {:.1}", c.eye[0], c.eye[1], c.eye[2]),
        format!("yaw {:.1} pitch {:.1}", c.yaw, c.pitch),
        format!("{:.0} units/s", player.speed),
    ];
    out.push(match facts.lights {
        Some((cluster, lights)) => format!("cluster {cluster}: {lights} lights"),
        None => "in no cluster".to_owned(),
    });
    out
}

/// How far an accumulation has come.
fn samples(facts: &Facts<'_>) -> Option<String> {
    if facts.samples == 0 {
        return None;
    }
    let error = facts
        .error
        .map(|e| format!(", error {:.2}%", e * 100.0))
        .unwrap_or_default();
    Some(format!("{} samples{error}", facts.samples))
}

fn loading(ctx: &egui::Context, map: &str, doing: &str, share: f32, seconds: f32) {
    egui::Area::new("loading".into())
        .anchor(Align2::CENTER_CENTER, vec2(0.0, 0.0))
        .interactable(false)
        .show(ctx, |ui| {
            over_picture().inner_margin(16).show(ui, |ui| {
                ui.set_width(320.0);
                ui.vertical_centered(|ui| {
                    ui.label(RichText::new(map).font(FontId::proportional(22.0)).color(ACCENT));
                    ui.add(egui::ProgressBar::new(share).desired_width(300.0));
                    ui.label(format!("{doing}: {seconds:.1} s"));
                });
            });
        });
}

/// What to press, by what the keys do now.
fn hints(ui: &mut egui::Ui, shell: &Shell) {
    let key = |command: &str| shell.binds.shown_key(command).map(str::to_owned);
    let hints = [
        ("togglemenu", "menu"),
        ("toggleconsole", "console"),
        ("maps", "maps"),
        ("settings", "settings"),
    ];
    let text: Vec<String> = hints
        .iter()
        .filter_map(|(command, what)| Some(format!("{}: {what}", key(command)?)))
        .collect();
    line(ui, &text.join("   "));
}
