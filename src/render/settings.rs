//! Settings of a frame, independent of where they come from.

use crate::scene::camera::Camera;
use crate::scene::clock::Clock;
use crate::scene::motion::Moment;
use crate::scene::sampling::{DIM_SHUTTER, Sequence, key, sample2};

/// Curve from exposed radiance to the display.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u32)]
pub enum Tonemap {
    Aces = 0,
    Reinhard = 1,
    Clamp = 2,
}

/// How a random light is chosen from the receiver's row.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u32)]
pub enum LightSampling {
    /// Every light alike.
    Uniform = 0,
    /// In proportion to power.
    Power = 1,
    /// By a tree over the lights, with an eye to distance and both cosines.
    Bvh = 2,
    /// By the light cell of the receiver: by what its surroundings get from each light, as traced when the map was loaded.
    Cells = 3,
    /// Candidates by light cell, resampled by what each would contribute.
    Reservoir = 4,
}

/// What stands for the light that no light of the scene explains.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u32)]
pub enum AmbientLight {
    Off = 0,
    /// The same everywhere.
    Constant = 1,
    /// What is left over of the light grid.
    Grid = 2,
}

/// How bright what emits is to the eye. It lights the same in either case.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u32)]
pub enum ShownEmission {
    /// As the game shows it: a picture at display brightness.
    Game = 0,
    /// With the radiance that it lights with, often a hundred times what is around it.
    Radiance = 1,
}

/// Which ways light takes at a smooth interface are followed, where it is both reflected and refracted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u32)]
pub enum Secondary {
    /// Neither: surfaces are what their stages show.
    Off = 0,
    /// One at random: noise, and no more rays than without.
    One = 1,
    /// Both.
    Both = 2,
}

/// What a light sample is shown by. Its contribution to irradiance/π is the product of the three terms.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LightTerm {
    /// Its contribution.
    All = 0,
    /// The share of its light that arrives.
    Visibility = 1,
    /// Cosines and distance, over π and the pdf of its position.
    Geometry = 2,
    /// The radiance that leaves the light.
    Emission = 3,
}

/// What the estimators and the output stage are asked to do.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// Light the scene; else show albedo.
    pub illumination: bool,
    /// Show light alone: surfaces are white, and what is see-through is not there to the eye.
    pub white: bool,
    /// The one light that lights, by its number; `None`: all of them.
    pub solo_light: Option<u32>,
    pub light_term: LightTerm,
    /// 0 all lights, 1 the PVS row, 2 the tight row.
    pub cull_lights: u32,
    /// Lights sampled at random per hit; 0: every light of the row.
    pub random_lights: u32,
    pub light_sampling: LightSampling,
    /// Candidates per random light where they are resampled.
    pub candidates: u32,
    /// Reuse light samples between pixels and frames, where they are resampled and frames are shown as they come.
    pub light_reuse: bool,
    /// Reuse them where frames are denoised, too.
    pub reuse_denoised: bool,
    /// Frames' worth of candidates that the history of reuse counts at most.
    pub reuse_history: u32,
    /// Neighbours whose samples a pixel reuses.
    pub reuse_neighbours: u32,
    pub ambient: AmbientLight,
    /// Sample the lights' area; else their centre.
    pub soft_shadows: bool,
    /// Jitter inside the pixel.
    pub antialiasing: bool,
    /// Lens radius in units; 0: pinhole.
    pub aperture: f32,
    /// Distance to the plane in focus in units; 0: under the crosshair.
    pub focus_distance: f32,
    pub sequence: Sequence,
    pub seed: u32,
    /// Multiplier before the tone map; 0: automatic.
    pub exposure: f32,
    pub tonemap: Tonemap,
    /// Index into [`crate::console::table::VIEWS`].
    pub view: u32,
    /// Denoise frames that are shown as they come.
    pub denoiser: bool,
    /// Let the denoiser see where the light has changed since the frame before.
    pub gradients: bool,
    /// Levels of the denoiser's filter.
    pub atrous_levels: u32,
    /// Least weight of a new frame in the denoiser's history.
    pub least_alpha: f32,
    /// Most that a light sample may exceed its surroundings by, standard deviations; 0: anything.
    pub fireflies: f32,
    /// Temporal anti-aliasing of frames that are shown as they come.
    pub taa: bool,
    /// Half width of the TAA clip in standard deviations.
    pub taa_gamma: f32,
    /// Select texture levels by the ray's footprint; else level 0.
    pub filter_textures: bool,
    pub shown_emission: ShownEmission,
    /// Mirrors, portals and interfaces that a ray is followed through at most.
    pub max_depth: u32,
    pub secondary: Secondary,
    /// Environment-mapped stages reflect; else they show their picture.
    pub glossy: bool,
    /// Shade lit layers, one of them and what is behind at random; else only what is behind.
    pub choose_layers: bool,
    /// Draw the weapon before the eye, where the scene has a player.
    pub draw_gun: bool,
    /// Levels by which models have less detail than their size calls for.
    pub lod_bias: i32,
    /// Brightness of the lamp that the player holds, as of a light entity; 0: off.
    pub flashlight: f32,
    /// Show the discs of suns.
    pub draw_sun: bool,
    /// The scene's time; where the shutter is open longer, when it opens.
    pub clock: Clock,
    /// How long the shutter is open for samples that are averaged, seconds.
    pub shutter: f32,
}

impl Settings {
    /// What is followed at interfaces: nothing where light is not asked for.
    pub fn branches(&self) -> Secondary {
        if self.illumination && !self.white {
            self.secondary
        } else {
            Secondary::Off
        }
    }

    /// The same for light that branches off, which is followed now and then only: more candidates for each light sample.
    pub fn of_branches(&self) -> Self {
        Self {
            candidates: self.candidates * BRANCH_CANDIDATES,
            ..*self
        }
    }

    /// Share 0..1 of the time that the shutter is open at which sample `index` is taken, the same for all pixels; 0 where it
    /// is not open.
    pub fn shutter_share(&self, index: u32) -> f32 {
        if self.shutter > 0.0 {
            sample2(self.sequence, key(self.seed, 0, DIM_SHUTTER), index)[0]
        } else {
            0.0
        }
    }

    /// What poses depend on.
    pub fn moment(&self, camera: &Camera) -> Moment {
        Moment {
            clock: self.clock,
            camera: *camera,
            draw_gun: self.draw_gun,
            lod_bias: Some(self.lod_bias),
        }
    }

    /// Settings at the moment of sample `index`.
    pub fn at_sample(&self, index: u32) -> Self {
        let seconds = f64::from(self.shutter) * f64::from(self.shutter_share(index));
        Self {
            clock: self.clock.after(seconds),
            shutter: 0.0,
            ..*self
        }
    }

    /// Whether environment-mapped stages reflect.
    pub fn reflects(&self) -> bool {
        self.glossy && self.branches() != Secondary::Off
    }

    /// Whether a frame that is shown as it comes reuses light samples: it takes one random light by resampling.
    pub fn reuses(&self) -> bool {
        self.light_reuse
            && self.light_sampling == LightSampling::Reservoir
            && self.random_lights == 1
            && self.illumination
            && self.solo_light.is_none()
            && self.light_term == LightTerm::All
    }
}

/// Candidates of light that branches off, as a multiple.
pub const BRANCH_CANDIDATES: u32 = 2;
/// Most levels of the denoiser's filter.
const MOST_LEVELS: u32 = 5;
/// Most levels of that over what branches off: reflections are to stay sharp.
const MOST_SECONDARY_LEVELS: u32 = 3;
/// First of the views of the denoiser's filter levels in [`crate::console::table::VIEWS`].
const FIRST_LEVEL_VIEW: u32 = 18;

impl Settings {
    /// Levels of the denoiser's filter that a frame runs: a view of a level ends there.
    pub fn shown_levels(&self) -> u32 {
        let levels = self.atrous_levels.min(MOST_LEVELS);
        match self.view.checked_sub(FIRST_LEVEL_VIEW) {
            Some(level) if level < MOST_LEVELS => (level + 1).min(levels),
            _ => levels,
        }
    }
}

impl Settings {
    /// Levels of the denoiser's filter over what branches off.
    pub fn secondary_levels(&self) -> u32 {
        self.atrous_levels.min(MOST_SECONDARY_LEVELS)
    }
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            illumination: true,
            white: false,
            solo_light: None,
            light_term: LightTerm::All,
            cull_lights: 1,
            random_lights: 1,
            light_sampling: LightSampling::Reservoir,
            candidates: 2,
            light_reuse: true,
            reuse_denoised: false,
            reuse_history: 20,
            reuse_neighbours: 1,
            ambient: AmbientLight::Grid,
            soft_shadows: true,
            antialiasing: true,
            aperture: 0.0,
            focus_distance: 0.0,
            sequence: Sequence::Sobol,
            seed: 0,
            exposure: 0.0,
            tonemap: Tonemap::Aces,
            view: 0,
            denoiser: true,
            gradients: true,
            atrous_levels: 4,
            least_alpha: 0.05,
            fireflies: 0.0,
            taa: true,
            taa_gamma: 2.0,
            filter_textures: true,
            shown_emission: ShownEmission::Game,
            max_depth: 5,
            secondary: Secondary::Both,
            glossy: true,
            choose_layers: true,
            draw_gun: true,
            lod_bias: 0,
            flashlight: 0.0,
            draw_sun: false,
            clock: Clock::default(),
            shutter: 0.0,
        }
    }
}
