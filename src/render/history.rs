//! What a frame knows of the one before: where it was seen from, whether its histories are still good, and where in the
//! pixels its rays go.

use super::frame::FrameInput;
use super::frame_constants::FrameConstants;
use super::settings::{Settings, Tonemap};
use crate::scene::clock::Clock;
use glam::Vec3;

/// Frames that nothing must have changed for until temporal anti-aliasing takes the image for a still one.
const SETTLED: u32 = 1;
/// An eye that goes farther than this from one frame to the next, or turns by more than the angle with this cosine, sees another
/// view, of which histories know nothing. Units; falls and jump pads are below 20 at 60 frames per second.
const CUT_DISTANCE: f32 = 64.0;
const CUT_COSINE: f32 = 0.866;
/// Frames after such a cut, or a new beginning, whose light is sampled from more candidates, and from how many at least: what is
/// seen then has no history to be quiet by.
const FRESH_FRAMES: u32 = 8;
const FRESH_CANDIDATES: u32 = 8;

/// What histories depend on besides view and scene: when it changes they start anew.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Key {
    settings: Settings,
    /// A view of a level of the filter ends there, and what it shows is averaged.
    levels: u32,
    reuses: bool,
    /// Averaged frames leave no histories.
    filtered: bool,
}

/// What of a scene changes with its clock.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Moving {
    /// What is seen.
    pub picture: bool,
    /// What lights give.
    pub lights: bool,
    /// Where things stand.
    pub geometry: bool,
}

/// The frame before, as one view remembers it.
#[derive(Default)]
pub struct FrameHistory {
    before: Option<(FrameConstants, Key)>,
    revision: u32,
    unchanged: u32,
    /// Frames since histories began or the view was cut.
    since_cut: u32,
}

/// Whether a frame shows another place than the one before.
fn cut(old: &FrameConstants, new: &FrameConstants) -> bool {
    let away = Vec3::from(old.eye).distance(new.eye.into());
    let turned = |a: [f32; 3], b: [f32; 3]| Vec3::from(a).dot(b.into()) < CUT_COSINE;
    away > CUT_DISTANCE || turned(old.forward, new.forward) || turned(old.right, new.right)
}

/// The settings that decide what is in the histories: not how they are shown.
fn key(input: &FrameInput) -> Key {
    let shown = Settings {
        exposure: 0.0,
        tonemap: Tonemap::Aces,
        view: 0,
        clock: Clock::default(),
        ..input.settings
    };
    Key {
        settings: shown,
        levels: input.settings.shown_levels(),
        reuses: input.reuses(),
        filtered: input.denoises() || input.anti_aliases(),
    }
}

/// Points that fill the pixel evenly however many are taken (Roberts 2018, the R2 sequence).
fn jitter(index: u32) -> [f32; 2] {
    const STEPS: [f64; 2] = [0.754_877_666_246_692_8, 0.569_840_290_998_053_3];
    STEPS.map(|step| (0.5 + f64::from(index) * step).fract() as f32)
}

impl FrameHistory {
    /// Completes a frame's constants with what it needs of the frame before, and remembers it. `revision` counts changes of
    /// the scene, `moving` says what its clock does to it.
    pub fn advance(
        &mut self,
        constants: FrameConstants,
        input: &FrameInput,
        revision: u32,
        moving: Moving,
    ) -> FrameConstants {
        let key = key(input);
        let (view, good) = match &self.before {
            Some((before, old)) => (*before, key.filtered && *old == key),
            None => (constants, false),
        };
        let same_view = good
            && view.eye == constants.eye
            && view.forward == constants.forward
            && view.right == constants.right
            && view.half_width == constants.half_width
            && view.half_height == constants.half_height;
        let later = view.clock != constants.clock;
        self.unchanged = if same_view && revision == self.revision && !(later && (moving.picture || moving.geometry)) {
            self.unchanged.saturating_add(1)
        } else {
            0
        };
        let changed = revision != self.revision || (later && (moving.lights || moving.geometry));
        self.revision = revision;
        let jitter = match (input.anti_aliases(), input.denoises()) {
            (true, _) if input.settings.antialiasing => jitter(input.sample_index),
            (false, false) => [-1.0; 2],
            _ => [0.5; 2],
        };
        self.since_cut = if good && !cut(&view, &constants) {
            self.since_cut.saturating_add(1)
        } else {
            0
        };
        let least_candidates = if input.denoises() && self.since_cut < FRESH_FRAMES {
            FRESH_CANDIDATES
        } else {
            1
        };
        let complete = FrameConstants {
            least_candidates,
            old_least_candidates: view.least_candidates,
            old_eye: view.eye,
            old_half_width: view.half_width,
            old_forward: view.forward,
            old_half_height: view.half_height,
            old_right: view.right,
            old_up: view.up,
            old_clock: view.clock,
            jitter,
            old_jitter: if good { view.jitter } else { jitter },
            history: u32::from(good),
            changed: u32::from(good && changed && input.denoises() && input.settings.gradients),
            still: match (self.unchanged >= SETTLED, view.still) {
                (false, _) => 0,
                (true, 0) => 1,
                (true, _) => 2,
            },
            ..constants
        };
        self.before = Some((complete, key));
        complete
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use bytemuck::Zeroable;

    #[test]
    fn a_cut_is_told_from_a_motion() {
        let at = |x: f32, degrees: f32| {
            let (s, c) = degrees.to_radians().sin_cos();
            FrameConstants {
                eye: [x, 0.0, 0.0],
                forward: [c, s, 0.0],
                right: [s, -c, 0.0],
                ..FrameConstants::zeroed()
            }
        };
        assert!(!cut(&at(0.0, 0.0), &at(17.0, 20.0)));
        assert!(cut(&at(0.0, 0.0), &at(65.0, 0.0)));
        assert!(cut(&at(0.0, 0.0), &at(0.0, 90.0)));
    }

    #[test]
    fn jitter_fills_the_pixel() {
        let mut cells = [0; 16];
        for i in 0..64 {
            let [x, y] = jitter(i);
            assert!((0.0..1.0).contains(&x) && (0.0..1.0).contains(&y));
            cells[(x * 4.0) as usize + 4 * (y * 4.0) as usize] += 1;
        }
        assert!(cells.iter().all(|n| (2..=6).contains(n)), "{cells:?}");
    }
}
