//! Where the time goes (`rt_printPerfStats`): passes, rays, lights, and a graph of frame times.

use super::Facts;
use super::style::{ACCENT, TEXT, over_picture};
use crate::output::stats::{FrameStats, Summary};
use egui::{Align2, Color32, RichText, Sense, Stroke, pos2, vec2};
use std::collections::BTreeMap;

/// Frames that passes are averaged over.
const AVERAGED: usize = 30;
const WIDTH: f32 = 330.0;
const GRAPH_HEIGHT: f32 = 64.0;
const BAR: f32 = 120.0;

/// Shows it in the upper left corner.
pub fn show(ctx: &egui::Context, facts: &Facts<'_>) {
    egui::Area::new("perf".into())
        .anchor(Align2::LEFT_TOP, vec2(8.0, 8.0))
        .interactable(false)
        .order(egui::Order::Background)
        .show(ctx, |ui| {
            over_picture().show(ui, |ui| {
                ui.set_width(WIDTH);
                ui.spacing_mut().item_spacing.y = 1.0;
                ui.spacing_mut().interact_size.y = 0.0;
                contents(ui, facts);
            });
        });
}

fn line(ui: &mut egui::Ui, text: String) {
    ui.label(RichText::new(text).monospace().small().color(TEXT));
}

fn contents(ui: &mut egui::Ui, facts: &Facts<'_>) {
    line(ui, facts.line.to_owned());
    let [traced, window] = facts.sizes;
    line(
        ui,
        format!(
            "{}  {}x{} traced, {}x{} shown, {} MiB",
            facts.map,
            traced.0,
            traced.1,
            window.0,
            window.1,
            facts.memory >> 20
        ),
    );
    let frames: Vec<&FrameStats> = facts.recent.into_iter().flatten().collect();
    let times: Vec<f64> = frames.iter().map(|f| f.ms()).collect();
    let s = Summary::of(times.clone());
    line(
        ui,
        format!(
            "GPU ms: median {:.2}  95% {:.2}  99% {:.2}  most {:.2}",
            s.p50, s.p95, s.p99, s.max
        ),
    );
    if let Some(pace) = facts.pace {
        let p = Summary::of(pace.iter().map(|ms| f64::from(*ms)).collect());
        line(
            ui,
            format!("frame ms: median {:.2}  95% {:.2}  99% {:.2}", p.p50, p.p95, p.p99),
        );
    }
    graph(ui, &times, s.p95);
    let last = &frames[frames.len().saturating_sub(AVERAGED)..];
    rays(ui, last);
    match facts.lights {
        Some((cluster, lights)) => line(ui, format!("PVS cluster {cluster}: {lights} lights considered")),
        None => line(ui, "the eye is in no PVS cluster".to_owned()),
    }
    if let Some(history) = mean(last.iter().filter_map(|f| f.history)) {
        line(ui, format!("history length: {history:.1} frames on average"));
    }
    bars(ui, last);
}

fn mean(values: impl Iterator<Item = f64>) -> Option<f64> {
    let (n, sum) = values.fold((0u32, 0.0), |(n, sum), x| (n + 1, sum + x));
    (n > 0).then(|| sum / f64::from(n))
}

/// Frame times of the last frames; the line is their 95th percentile.
fn graph(ui: &mut egui::Ui, times: &[f64], p95: f64) {
    let (rect, _) = ui.allocate_exact_size(vec2(WIDTH, GRAPH_HEIGHT), Sense::hover());
    let painter = ui.painter();
    painter.rect_filled(rect, 2.0, Color32::from_black_alpha(120));
    let top = (p95 * 1.5).max(1e-3);
    let y = |ms: f64| rect.bottom() - (ms / top).min(1.0) as f32 * rect.height();
    let step = rect.width() / times.len().max(2) as f32;
    for (i, ms) in times.iter().enumerate() {
        let x = rect.left() + (i as f32 + 0.5) * step;
        let colour = if *ms > p95 {
            Color32::from_rgb(255, 90, 80)
        } else {
            ACCENT
        };
        painter.line_segment(
            [pos2(x, rect.bottom()), pos2(x, y(*ms))],
            Stroke::new(step.max(1.0), colour),
        );
    }
    painter.hline(rect.x_range(), y(p95), Stroke::new(1.0, TEXT));
    let text = format!("{top:.1} ms");
    painter.text(
        rect.left_top(),
        Align2::LEFT_TOP,
        text,
        egui::FontId::monospace(9.0),
        TEXT,
    );
}

fn rays(ui: &mut egui::Ui, frames: &[&FrameStats]) {
    let sum = |count: fn(&FrameStats) -> u64| frames.iter().map(|f| count(f)).sum::<u64>() as f64;
    let seconds = frames.iter().map(|f| f.ms()).sum::<f64>() / 1e3;
    let (primary, shadow, skipped) = (
        sum(|f| f.rays.primary),
        sum(|f| f.rays.shadow),
        sum(|f| f.rays.shadow_skipped),
    );
    if seconds > 0.0 {
        let rate = (primary + shadow) / seconds / 1e6;
        let share = 100.0 * skipped / (shadow + skipped).max(1.0);
        line(
            ui,
            format!("{rate:.1} Mrays/s: primary and shadow; {share:.0}% of the shadow rays skipped"),
        );
    }
}

/// GPU time by pass, averaged.
fn bars(ui: &mut egui::Ui, frames: &[&FrameStats]) {
    let mut order: Vec<&str> = Vec::new();
    let mut sums: BTreeMap<&str, f64> = BTreeMap::new();
    for f in frames {
        for (name, ms) in &f.passes {
            if !order.contains(&name.as_str()) {
                order.push(name);
            }
            *sums.entry(name).or_default() += ms.as_f64().unwrap_or(0.0) / frames.len() as f64;
        }
    }
    let longest = sums.values().copied().fold(1e-6, f64::max);
    for name in order {
        let ms = sums.get(name).copied().unwrap_or(0.0);
        ui.horizontal(|ui| {
            let (rect, _) = ui.allocate_exact_size(vec2(BAR, 9.0), Sense::hover());
            let mut bar = rect;
            bar.set_width(BAR * (ms / longest) as f32);
            ui.painter().rect_filled(bar, 1.0, ACCENT);
            line(ui, format!("{ms:7.3}  {name}"));
        });
    }
}
