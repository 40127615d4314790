//! From console variables to the settings of a frame.

use super::Cvars;
use crate::render::settings::{LightSampling, Settings, Tonemap};
use crate::scene::sampling::Sequence;

/// The frame settings that the variables ask for.
pub fn settings(cvars: &Cvars) -> Settings {
    let number = |name| cvars.number(name);
    let on = |name| number(name) != 0.0;
    Settings {
        illumination: on("rt_illumination"),
        cull_lights: number("rt_cullLights") as u32,
        random_lights: number("rt_numRandomDL") as u32,
        light_sampling: match number("rt_lightSampling") as u32 {
            0 => LightSampling::Uniform,
            1 => LightSampling::Power,
            2 => LightSampling::Bvh,
            _ => LightSampling::Reservoir,
        },
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
        filter_textures: true,
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
