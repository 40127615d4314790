//! The player: a body that mirrors show, and a weapon before the eye.

use super::clock::rate;
use super::material::MaterialSource;
use super::models::{Models, Skin};
use super::motion::{Motion, Steps};
use super::records::{SEEN_BY_EYE, SEEN_BY_REFLECTIONS};
use super::textures::TextureRequests;
use crate::assets::shader_script::ShaderLibrary;
use crate::assets::vfs::{FileSource, VfsError};
use glam::Affine3A;

/// Who plays, and with what.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Player {
    /// Folder under `models/players`.
    pub model: String,
    /// Suffix of its skin files.
    pub skin: String,
    /// Folder under `models/weapons2`.
    pub weapon: String,
}

impl Default for Player {
    fn default() -> Self {
        Self {
            model: "sarge".to_owned(),
            skin: "default".to_owned(),
            weapon: "machinegun".to_owned(),
        }
    }
}

/// A part of the player.
pub struct Part {
    /// Number of its first step among the models; its other steps follow.
    pub model: u32,
    pub steps: u32,
    /// Rounds of all steps: [`super::clock`].
    pub rate: u32,
    pub motion: Motion,
    /// Which rays see it.
    pub seen_by: u32,
}

/// Where models and materials are found and kept.
pub struct Shelf<'a> {
    pub files: &'a dyn FileSource,
    pub scripts: &'a ShaderLibrary,
    pub models: &'a mut Models,
    pub materials: &'a mut Vec<MaterialSource>,
    pub requests: &'a mut TextureRequests,
}

/// Frames of an animation.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Animation {
    first: u32,
    count: u32,
    frames_a_second: f32,
}

/// Places of animations in `animation.cfg`.
const TORSO_GESTURE: usize = 6;
const TORSO_STAND: usize = 11;
const LEGS_WALK_CROUCHED: usize = 13;
const LEGS_IDLE: usize = 22;

/// The standing animations of an `animation.cfg`, legs and torso; still ones where the file says nothing usable.
fn standing(text: &str) -> [Animation; 2] {
    let rows: Vec<Animation> = text
        .lines()
        .filter_map(|line| {
            let numbers: Vec<f32> = line.split_whitespace().map_while(|w| w.parse().ok()).take(4).collect();
            match numbers[..] {
                [first, count, _, fps] if first >= 0.0 && count >= 1.0 => Some(Animation {
                    first: first as u32,
                    count: count as u32,
                    frames_a_second: if fps > 0.0 { fps } else { 1.0 },
                }),
                _ => None,
            }
        })
        .collect();
    let still = Animation {
        first: 0,
        count: 1,
        frames_a_second: 1.0,
    };
    let row = |i: usize| rows.get(i).copied().unwrap_or(still);
    // Legs are numbered on after the torso's frames, which their model lacks.
    let skipped = match (rows.get(LEGS_WALK_CROUCHED), rows.get(TORSO_GESTURE)) {
        (Some(legs), Some(torso)) => legs.first.saturating_sub(torso.first),
        _ => 0,
    };
    let mut legs = row(LEGS_IDLE);
    legs.first = legs.first.saturating_sub(skipped);
    [legs, row(TORSO_STAND)]
}

/// A model in an animation.
struct Animated {
    model: u32,
    steps: u32,
    rate: u32,
}

impl Shelf<'_> {
    fn text(&self, path: &str) -> Result<String, VfsError> {
        let bytes = self.files.read(path)?.unwrap_or_default();
        Ok(String::from_utf8_lossy(&bytes).into_owned())
    }

    fn animated(&mut self, path: &str, skin: &Skin, a: Animation) -> Result<Option<Animated>, VfsError> {
        let found = self.models.animated(
            path,
            skin,
            a.first..a.first + a.count,
            self.files,
            self.scripts,
            self.materials,
            self.requests,
        )?;
        Ok(found.map(|(model, steps)| Animated {
            model,
            steps,
            rate: rate(a.frames_a_second / a.count as f32),
        }))
    }

    /// Places of a tag, by step.
    fn tag(&self, of: &Animated, name: &str) -> Option<Steps> {
        let poses: Option<Vec<Affine3A>> = (of.model..of.model + of.steps)
            .map(|m| self.models.tag(m, name))
            .collect();
        Some(Steps {
            poses: poses?,
            rate: of.rate,
        })
    }
}

/// All parts of a player; what is missing is left out, and told in the models' warnings.
///
/// # Errors
/// [`VfsError`] where a file exists and cannot be read.
pub fn parts(player: &Player, shelf: &mut Shelf<'_>) -> Result<Vec<Part>, VfsError> {
    let mut out = Vec::new();
    let folder = format!("models/players/{}", player.model);
    let [legs, torso] = standing(&shelf.text(&format!("{folder}/animation.cfg"))?);
    let still = Animation {
        count: 1,
        first: 0,
        ..legs
    };
    let mut chain = Vec::new();
    let mut hands = None;
    for (part, animation, tag) in [
        ("lower", legs, Some("tag_torso")),
        ("upper", torso, Some("tag_head")),
        ("head", still, None),
    ] {
        let skin = Skin::parse(&shelf.text(&format!("{folder}/{part}_{}.skin", player.skin))?);
        let Some(model) = shelf.animated(&format!("{folder}/{part}.md3"), &skin, animation)? else {
            break;
        };
        out.push(Part {
            model: model.model,
            steps: model.steps,
            rate: model.rate,
            motion: Motion::Body(chain.clone()),
            seen_by: SEEN_BY_REFLECTIONS,
        });
        if part == "upper" {
            hands = shelf
                .tag(&model, "tag_weapon")
                .map(|tag| [chain.clone(), vec![tag]].concat());
        }
        match tag.and_then(|tag| shelf.tag(&model, tag)) {
            Some(steps) => chain.push(steps),
            None => break,
        }
    }
    let weapon = format!("models/weapons2/{0}/{0}", player.weapon);
    let bare = Skin::default();
    let hand = shelf.animated(&format!("{weapon}_hand.md3"), &bare, still)?;
    let before_eye = hand
        .and_then(|hand| shelf.tag(&hand, "tag_weapon"))
        .map(|tag| vec![tag]);
    let Some(gun) = shelf.animated(&format!("{weapon}.md3"), &bare, still)? else {
        return Ok(out);
    };
    let barrel = match shelf.tag(&gun, "tag_barrel") {
        Some(tag) => shelf
            .animated(&format!("{weapon}_barrel.md3"), &bare, still)?
            .map(|model| (model, Some(tag))),
        None => None,
    };
    for (model, tag) in [(gun, None)].into_iter().chain(barrel) {
        let mut hold = |place: &Option<Vec<Steps>>, motion: fn(Vec<Steps>) -> Motion, seen_by| {
            if let Some(place) = place {
                out.push(Part {
                    model: model.model,
                    steps: model.steps,
                    rate: model.rate,
                    motion: motion([place.clone(), tag.iter().cloned().collect()].concat()),
                    seen_by,
                });
            }
        };
        hold(&hands, Motion::Body, SEEN_BY_REFLECTIONS);
        hold(&before_eye, Motion::View, SEEN_BY_EYE);
    }
    Ok(out)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn legs_count_on_after_the_torso() {
        let mut text = String::from("sex m\nheadoffset 0 0 0\n// 1 2 3 4\n");
        for i in 0..25 {
            text += &format!("{}\t2\t0\t15\t// row\n", 10 * i);
        }
        let [legs, torso] = standing(&text);
        assert_eq!((torso.first, torso.count), (110, 2));
        // Row 22 starts at 220; rows 6 to 12 take the 70 frames that the legs' model lacks.
        assert_eq!((legs.first, legs.frames_a_second), (150, 15.0));
        assert_eq!(standing("nothing")[0].count, 1);
    }
}
