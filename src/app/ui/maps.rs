//! The maps found, with their level shots.

use crate::assets::image;
use crate::assets::vfs::Vfs;
use crate::assets::vfs::search_path::FoundMap;
use crate::console::Shell;
use egui::{Align2, Color32, ColorImage, RichText, ScrollArea, TextureHandle, TextureOptions, vec2};
use std::collections::HashMap;
use std::sync::Arc;

/// Size of a level shot, points.
const SHOT: egui::Vec2 = vec2(128.0, 96.0);
/// Longest edge of a level shot that is kept, texels.
const MOST_TEXELS: usize = 256;
/// Level shots decoded in one frame.
const DECODED_A_FRAME: usize = 2;

/// What the list remembers.
pub struct MapPanel {
    files: Arc<Vfs>,
    maps: Vec<FoundMap>,
    search: String,
    shots: HashMap<String, Option<TextureHandle>>,
}

impl MapPanel {
    /// The maps among some files.
    pub fn new(files: Arc<Vfs>) -> Self {
        Self {
            maps: files.maps(),
            files,
            search: String::new(),
            shots: HashMap::new(),
        }
    }

    /// Shows them. True where one was chosen.
    pub fn show(&mut self, ctx: &egui::Context, open: &mut bool, shell: &mut Shell) -> bool {
        let mut chosen = None;
        let screen = ctx.content_rect();
        egui::Window::new("Maps")
            .open(open)
            .anchor(Align2::CENTER_CENTER, vec2(0.0, 0.0))
            .fixed_size(vec2((screen.width() * 0.86).min(900.0), screen.height() * 0.72))
            .show(ctx, |ui| {
                ui.horizontal(|ui| {
                    ui.label("Search");
                    ui.text_edit_singleline(&mut self.search);
                    ui.label(RichText::new(format!("{} maps", self.maps.len())).weak());
                });
                ui.separator();
                ScrollArea::vertical().auto_shrink([false, false]).show(ui, |ui| {
                    ui.horizontal_wrapped(|ui| chosen = self.grid(ui));
                });
            });
        if let Some(map) = &chosen {
            shell.push(&format!("map \"{map}\""));
        }
        chosen.is_some()
    }

    fn grid(&mut self, ui: &mut egui::Ui) -> Option<String> {
        let part = self.search.to_lowercase();
        let found: Vec<FoundMap> = self
            .maps
            .iter()
            .filter(|m| m.name.contains(part.trim()))
            .cloned()
            .collect();
        let mut left = DECODED_A_FRAME;
        let mut chosen = None;
        for map in &found {
            let size = SHOT + vec2(8.0, 26.0);
            let (rect, response) = ui.allocate_exact_size(size, egui::Sense::click());
            if response.clicked() {
                chosen = Some(map.name.clone());
            }
            if !ui.is_rect_visible(rect) {
                continue;
            }
            if !self.shots.contains_key(&map.name) && left > 0 {
                left -= 1;
                let shot = self.shot(ui.ctx(), &map.name);
                self.shots.insert(map.name.clone(), shot);
            }
            let picture = egui::Rect::from_min_size(rect.min + vec2(4.0, 4.0), SHOT);
            let painter = ui.painter();
            match self.shots.get(&map.name) {
                Some(Some(texture)) => {
                    let whole = egui::Rect::from_min_max(egui::pos2(0.0, 0.0), egui::pos2(1.0, 1.0));
                    painter.image(texture.id(), picture, whole, Color32::WHITE);
                }
                _ => {
                    painter.rect_filled(picture, 2.0, Color32::from_gray(30));
                    let font = egui::FontId::proportional(30.0);
                    painter.text(
                        picture.center(),
                        Align2::CENTER_CENTER,
                        "?",
                        font,
                        Color32::from_gray(90),
                    );
                }
            }
            let colour = if response.hovered() {
                super::style::ACCENT
            } else {
                super::style::TEXT
            };
            let font = egui::FontId::proportional(13.0);
            painter.text(
                rect.left_bottom() + vec2(5.0, -4.0),
                Align2::LEFT_BOTTOM,
                &map.name,
                font,
                colour,
            );
            response.on_hover_text(format!("{} from {}", map.name, map.place));
        }
        if found.is_empty() {
            ui.label("no map is called that");
        }
        chosen
    }

    /// A map's level shot; `None` where it has none that can be read.
    fn shot(&self, ctx: &egui::Context, map: &str) -> Option<TextureHandle> {
        let texture = match image::load(&self.files.focused_on(map), &format!("levelshots/{map}")) {
            Ok(texture) => texture?,
            Err(e) => {
                tracing::debug!("{e}");
                return None;
            }
        };
        // The smallest level that is still as large as wanted.
        let level = (0..texture.levels.len())
            .find(|l| {
                let (w, h) = texture.level_size(*l);
                w.max(h) as usize <= MOST_TEXELS
            })
            .unwrap_or(0);
        let (width, height) = texture.level_size(level);
        let pixels = texture.levels[level]
            .iter()
            .map(|p| Color32::from_rgb(p[0], p[1], p[2]))
            .collect();
        let picture = ColorImage::new([width as usize, height as usize], pixels);
        Some(ctx.load_texture(map, picture, TextureOptions::LINEAR))
    }
}
