//! From console variables to the settings of a frame.

use super::Cvars;
use crate::lighting::Lights;
use crate::render::settings::{AmbientLight, LightSampling, LightTerm, Secondary, Settings, ShownEmission, Tonemap};
use crate::scene::clock::Clock;
use crate::scene::sampling::Sequence;

/// Which lights a map gets.
pub fn lights(cvars: &Cvars) -> Lights {
    match cvars.number("rt_lights") as u32 {
        0 => Lights::All,
        1 => Lights::Known,
        _ => Lights::Recovered,
    }
}

/// Frames a second that a shutter's share of a frame is reckoned by where nothing else is said.
pub const FRAME_RATE: f32 = 60.0;

/// The frame settings that the variables ask for.
pub fn settings(cvars: &Cvars) -> Settings {
    let number = |name| cvars.number(name);
    let on = |name| number(name) != 0.0;
    Settings {
        illumination: on("rt_illumination"),
        solo_light: (number("rt_soloLight") >= 0.0).then(|| number("rt_soloLight") as u32),
        light_term: match number("rt_lightTerm") as u32 {
            0 => LightTerm::All,
            1 => LightTerm::Visibility,
            2 => LightTerm::Geometry,
            _ => LightTerm::Emission,
        },
        cull_lights: number("rt_cullLights") as u32,
        random_lights: number("rt_numRandomDL") as u32,
        light_sampling: match number("rt_lightSampling") as u32 {
            0 => LightSampling::Reservoir,
            1 => LightSampling::Uniform,
            2 => LightSampling::Power,
            3 => LightSampling::Bvh,
            _ => LightSampling::Cells,
        },
        ambient: match number("rt_ambient") as u32 {
            0 => AmbientLight::Grid,
            1 => AmbientLight::Constant,
            _ => AmbientLight::Off,
        },
        light_reuse: on("rt_lightReuse"),
        reuse_denoised: number("rt_lightReuse") >= 2.0,
        reuse_history: number("rt_reuseHistory") as u32,
        reuse_neighbours: number("rt_reuseNeighbours") as u32,
        candidates: number("rt_lightCandidates") as u32,
        soft_shadows: on("rt_softshadows"),
        antialiasing: on("rt_antialiasing"),
        aperture: if on("rt_dof") {
            number("rt_aperture") as f32
        } else {
            0.0
        },
        focus_distance: number("rt_focallength") as f32,
        sequence: if on("rt_sequence") {
            Sequence::Random
        } else {
            Sequence::Sobol
        },
        seed: number("rt_seed") as u32,
        exposure: number("rt_exposure") as f32,
        tonemap: match number("rt_tonemap") as u32 {
            0 => Tonemap::Aces,
            1 => Tonemap::Reinhard,
            _ => Tonemap::Clamp,
        },
        view: number("rt_view") as u32,
        denoiser: on("rt_denoiser"),
        gradients: on("rt_gradients"),
        atrous_levels: number("rt_atrousLevels") as u32,
        least_alpha: number("rt_leastAlpha") as f32,
        fireflies: number("rt_fireflies") as f32,
        taa: on("rt_taa"),
        taa_gamma: number("rt_taaGamma") as f32,
        filter_textures: true,
        shown_emission: if on("rt_emission") {
            ShownEmission::Radiance
        } else {
            ShownEmission::Game
        },
        max_depth: number("rt_maxDepth") as u32,
        secondary: match number("rt_secondary") as u32 {
            0 => Secondary::Both,
            1 => Secondary::One,
            _ => Secondary::Off,
        },
        glossy: on("rt_glossy"),
        choose_layers: true,
        draw_gun: on("cg_drawGun"),
        lod_bias: number("r_lodbias") as i32,
        flashlight: number("rt_flashlight") as f32,
        draw_sun: on("r_drawSun"),
        white: on("r_lightmap"),
        clock: Clock::default(),
        shutter: number("rt_motionblur") as f32 / FRAME_RATE,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn defaults_of_the_table_are_the_defaults_of_a_frame() {
        assert_eq!(settings(&Cvars::default()), Settings::default());
    }
}
