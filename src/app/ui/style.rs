//! Colours and fonts of the overlay.

use egui::{Color32, CornerRadius};

/// What stands out.
pub const ACCENT: Color32 = Color32::from_rgb(255, 176, 66);
/// Text over the picture, and the shade behind it.
pub const TEXT: Color32 = Color32::from_rgb(235, 235, 235);
pub const SHADE: Color32 = Color32::from_rgba_premultiplied(8, 8, 10, 190);

/// The game's colours by number; its black would not be seen.
pub const CODES: [Color32; 8] = [
    Color32::from_rgb(110, 110, 110),
    Color32::from_rgb(255, 90, 80),
    Color32::from_rgb(110, 230, 110),
    Color32::from_rgb(250, 225, 90),
    Color32::from_rgb(120, 150, 255),
    Color32::from_rgb(100, 230, 230),
    Color32::from_rgb(240, 120, 240),
    TEXT,
];

/// Sets the context's style.
pub fn apply(context: &egui::Context) {
    context.set_theme(egui::Theme::Dark);
    context.all_styles_mut(|style| {
        let visuals = &mut style.visuals;
        visuals.window_fill = Color32::from_rgba_premultiplied(20, 20, 24, 244);
        visuals.panel_fill = visuals.window_fill;
        visuals.selection.bg_fill = Color32::from_rgb(140, 88, 20);
        visuals.hyperlink_color = ACCENT;
        visuals.window_corner_radius = CornerRadius::same(4);
        style.animation_time = 0.0;
    });
}

/// A frame for text over the picture.
pub fn over_picture() -> egui::Frame {
    egui::Frame::NONE.fill(SHADE).inner_margin(6).corner_radius(3)
}
