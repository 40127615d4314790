//! The settings whose time and error are held against each other.

use super::lights::{Config as Lights, Mode};
use crate::render::settings::Settings;
use serde::{Deserialize, Serialize};

/// One choice of settings.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Config {
    pub mode: Mode,
    /// Lights sampled at each hit; 0: all of them.
    pub lights: u32,
    pub candidates: u32,
    /// Traditional samples: whole images that are averaged.
    pub samples: u32,
    pub culling: u32,
    pub denoiser: bool,
    pub taa: bool,
    /// Edge of the traced image over that of the shown one.
    pub scale: f32,
}

/// What families of settings are called in plots, in this order.
pub const FAMILIES: [&str; 9] = [
    "uniform",
    "power",
    "bvh",
    "cells",
    "resampled",
    "reservoir",
    "denoised",
    "denoised + TAA",
    "all lights",
];

const RAW: Config = Config {
    mode: Mode::Resampled,
    lights: 1,
    candidates: 2,
    samples: 1,
    culling: 1,
    denoiser: false,
    taa: false,
    scale: 1.0,
};

impl Config {
    /// The settings that it means.
    pub fn settings(&self, base: &Settings) -> Settings {
        let lights = Lights {
            mode: self.mode,
            lights: self.lights,
            candidates: self.candidates,
            neighbours: 1,
        };
        Settings {
            cull_lights: self.culling,
            denoiser: self.denoiser,
            taa: self.taa,
            ..lights.settings(base)
        }
    }

    /// Frames before it shows what it can.
    pub fn has_history(&self) -> bool {
        self.denoiser || self.taa || self.mode == Mode::Reservoir
    }

    /// Size of the traced image.
    pub fn traced(&self, size: (u32, u32)) -> (u32, u32) {
        let edge = |n: u32| ((n as f32 * self.scale).round() as u32).max(1);
        (edge(size.0), edge(size.1))
    }

    /// Which of [`FAMILIES`] it belongs to.
    pub fn family(&self) -> &'static str {
        match (self.denoiser, self.taa) {
            (true, true) => FAMILIES[7],
            (true, false) => FAMILIES[6],
            _ if self.lights == 0 => FAMILIES[8],
            _ => self.mode.name(),
        }
    }

    /// In a few words.
    pub fn name(&self) -> String {
        let mut words = vec![match self.lights {
            0 => "all lights".to_owned(),
            n => format!("{} {n}", self.mode.name()),
        }];
        if self.samples > 1 {
            words.push(format!("{} samples", self.samples));
        }
        if self.candidates != 2 {
            words.push(format!("{} candidates", self.candidates));
        }
        if self.culling != 1 {
            words.push(format!("culling {}", self.culling));
        }
        words.extend(self.denoiser.then(|| "denoiser".to_owned()));
        words.extend(self.taa.then(|| "TAA".to_owned()));
        if self.scale != 1.0 {
            words.push(format!("scale {}", self.scale));
        }
        words.join(", ")
    }
}

/// All of them.
pub fn sweep() -> Vec<Config> {
    let with = |mode, lights| Config { mode, lights, ..RAW };
    let mut out = Vec::new();
    for mode in [Mode::Uniform, Mode::Power, Mode::Bvh, Mode::Cells, Mode::Resampled] {
        out.extend([1, 4, 16].map(|lights| with(mode, lights)));
    }
    out.push(with(Mode::Uniform, 0));
    out.extend([2, 8].map(|candidates| Config {
        candidates,
        ..with(Mode::Reservoir, 1)
    }));
    for mode in [Mode::Uniform, Mode::Resampled] {
        out.extend([4, 16].map(|samples| Config {
            samples,
            ..with(mode, 1)
        }));
    }
    for culling in [0, 2] {
        let culled = [
            (Mode::Uniform, 1),
            (Mode::Uniform, 4),
            (Mode::Uniform, 0),
            (Mode::Resampled, 1),
        ];
        out.extend(culled.map(|(mode, lights)| Config {
            culling,
            ..with(mode, lights)
        }));
    }
    for mode in [Mode::Uniform, Mode::Cells, Mode::Resampled] {
        out.extend([false, true].map(|taa| Config {
            denoiser: true,
            taa,
            ..with(mode, 1)
        }));
    }
    out.push(Config {
        denoiser: true,
        taa: true,
        ..with(Mode::Resampled, 4)
    });
    out.push(Config {
        denoiser: true,
        taa: true,
        culling: 0,
        ..with(Mode::Uniform, 1)
    });
    out.push(Config {
        taa: true,
        ..with(Mode::Uniform, 0)
    });
    out.push(Config { taa: true, ..RAW });
    out.extend([0.5, 0.75].map(|scale| Config {
        denoiser: true,
        taa: true,
        scale,
        ..RAW
    }));
    out.push(Config { scale: 0.5, ..RAW });
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_choice_is_another_one() {
        let all = sweep();
        for (i, c) in all.iter().enumerate() {
            assert!(all[..i].iter().all(|d| d.name() != c.name()), "{}", c.name());
            assert!(FAMILIES.contains(&c.family()));
        }
    }
}
