//! How a map's luxels are encoded, and their decoding to luxel units.
//!
//! A linear value v (1 where E/π = 1) is stored as b = ⌊255·v^(1/γ)/c⌋, after a clamp that keeps the hue. γ and c stand in
//! worldspawn's `_q3map2_cmdline` or are found from the data: c from the largest byte, γ from the light grid, whose ambient
//! part is never less than a fixed share of its directed part *before* encoding, and whose sunlit cells have known light.

use crate::assets::bsp::Bsp;
use crate::assets::bsp::lumps::GridPoint;
use crate::assets::entities::Entity;
use crate::scene::lights::{LightSource, LightTable};
use glam::Vec3;
use std::collections::HashMap;
use std::f32::consts::PI;

/// What the exponent and divisor of an encoding were derived from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Evidence {
    /// `_q3map2_cmdline`, or a lights file.
    Stated,
    /// The light grid's floor of ambient over directed light.
    GridFloor,
    /// Light-grid cells that face the sun.
    Sun,
    /// Nothing speaks against the compiler's default.
    Default,
}

/// Encoding of luxels, vertex colours and grid colours of one map.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Encoding {
    /// γ of `-gamma`.
    pub gamma: f32,
    /// c of `-compensate`.
    pub compensate: f32,
    /// Where γ comes from.
    pub evidence: Evidence,
}

/// Least directed bytes at which the grid's floor is looked for.
const GRID_LEAST: [u8; 3] = [16, 32, 64];
/// Grid cells that a statement about the whole map needs.
const GRID_CELLS: usize = 200;
/// Share of grid cells that may lie below the floor, being damaged or rounded.
const FLOOR_OUTLIERS: f32 = 0.001;
/// Above this largest byte a map was not compensated.
const COMPENSATED_LARGEST: u8 = 128;

impl Encoding {
    /// The compiler's default: linear bytes.
    pub const LINEAR: Self = Self {
        gamma: 1.0,
        compensate: 1.0,
        evidence: Evidence::Default,
    };

    /// Linear value of a byte in luxel units; half a byte is added because the compiler truncates.
    pub fn decode_byte(&self, byte: u8) -> f32 {
        ((f32::from(byte) + 0.5) * self.compensate / 255.0).powf(self.gamma)
    }

    /// Byte of a linear value in luxel units without the hue-keeping clamp.
    pub fn encode_value(&self, value: f32) -> u8 {
        (255.0 * value.max(0.0).powf(1.0 / self.gamma).min(1.0) / self.compensate) as u8
    }

    /// Bytes of a linear colour as the compiler writes them: scaled down to 255 with its hue, then divided, then cut.
    pub fn encode(&self, value: Vec3) -> [u8; 3] {
        let mut v = value.max(Vec3::ZERO).to_array().map(|c| c.powf(1.0 / self.gamma));
        let largest = v[0].max(v[1]).max(v[2]);
        if largest > 1.0 {
            v = v.map(|c| c / largest);
        }
        v.map(|c| (255.0 * c / self.compensate) as u8)
    }

    /// The byte that clamped luxels have in their largest channel.
    pub fn clamp_byte(&self) -> u8 {
        // A hair more, so that 255/2.0 and the like don't fall below their whole number.
        (255.0 / self.compensate + 1e-3) as u8
    }

    /// Whether a luxel was clamped: all three of its channels are lower bounds then. One byte less than the clamp's counts
    /// too, because scaling 255/max·max is cut to 254 as often as not (whole maps have no 255).
    pub fn is_clamped(&self, bytes: [u8; 3]) -> bool {
        bytes.into_iter().max().unwrap_or(0).saturating_add(1) >= self.clamp_byte()
    }

    /// Finds a map's encoding.
    pub fn of(bsp: &Bsp, entities: &[Entity], lights: &LightTable) -> Self {
        let worldspawn = entities.iter().find(|e| e.class() == "worldspawn");
        let command = worldspawn.and_then(|w| w.get("_q3map2_cmdline")).unwrap_or("");
        let stated_gamma = option(command, "-gamma").filter(|g| *g > 0.0);
        let stated_compensate = option(command, "-compensate").filter(|c| *c > 0.0);
        let compensate = stated_compensate.unwrap_or_else(|| compensation(&bsp.lightmaps));
        if let Some(gamma) = stated_gamma {
            return Self {
                gamma,
                compensate,
                evidence: Evidence::Stated,
            };
        }
        if command.contains("-light") {
            return Self {
                gamma: 1.0,
                compensate,
                evidence: Evidence::Stated,
            };
        }
        let kept = lights_kept_unasked(entities, lights);
        let floor = floor_gamma(&bsp.light_grid, kept);
        let sun = sun_gamma(&bsp.light_grid, lights, compensate);
        let agree = |a: f32, b: f32| (a / b).ln().abs() < AGREEMENT;
        let (gamma, evidence) = match (floor, sun) {
            (_, Some((sun, true))) => (sun, Evidence::Sun),
            (Some(floor), Some((sun, false))) if agree(floor, sun) => (floor, Evidence::GridFloor),
            // Uncompensated maps are rarely gamma corrected, and their floor may be another compiler's.
            (Some(floor), _) if compensate > 1.0 => (floor, Evidence::GridFloor),
            _ => (1.0, Evidence::Default),
        };
        Self {
            gamma: snapped(gamma),
            compensate,
            evidence,
        }
    }
}

/// Largest difference of logarithms at which two estimates of γ count as one.
const AGREEMENT: f32 = 0.2;
/// Exponents that people type.
const USUAL: [f32; 6] = [1.0, 1.3, 1.5, 2.0, 2.5, 3.0];
/// Relative distance within which a usual exponent is meant.
const NEAR_USUAL: f32 = 0.07;
/// Below this an exponent is taken for the default: light from elsewhere makes sunlit cells brighter than the sun.
const NEAR_LINEAR: f32 = 1.2;

fn snapped(gamma: f32) -> f32 {
    if gamma < NEAR_LINEAR {
        return 1.0;
    }
    let distance = |u: &f32| (gamma / u - 1.0).abs();
    USUAL
        .into_iter()
        .filter(|u| distance(u) < NEAR_USUAL)
        .min_by(|a, b| distance(a).total_cmp(&distance(b)))
        .unwrap_or(gamma)
}

/// Whether light entities are in the file though worldspawn did not ask for it, as id's own compiler leaves them.
pub fn lights_kept_unasked(entities: &[Entity], lights: &LightTable) -> bool {
    let worldspawn = entities.iter().find(|e| e.class() == "worldspawn");
    let asked = worldspawn.is_some_and(|w| w.number("_keeplights").is_some_and(|n| n != 0.0));
    let kept = lights.count(LightSource::PointEntity) + lights.count(LightSource::SpotEntity) > 0;
    kept && !asked
}

/// The number after a switch of the recorded command line; the last one counts.
fn option(command: &str, switch: &str) -> Option<f32> {
    let words: Vec<&str> = command.split([' ', ';', '\t']).filter(|w| !w.is_empty()).collect();
    words
        .windows(2)
        .rev()
        .find(|w| w[0].eq_ignore_ascii_case(switch))
        .and_then(|w| w[1].parse().ok())
}

/// c from the largest byte of the lightmaps.
fn compensation(lightmaps: &[u8]) -> f32 {
    let largest = lightmaps.iter().copied().max().unwrap_or(255);
    if largest > COMPENSATED_LARGEST || largest == 0 {
        return 1.0;
    }
    let whole = (255.0 / (f32::from(largest) + 0.5)).round();
    if (255.0 / whole) as u8 == largest {
        whole
    } else {
        255.0 / (f32::from(largest) + 0.5)
    }
}

/// γ from the least ambient over directed light: q3map2 keeps ambient at an eighth, id's compiler (which left light
/// entities in the file) at a quarter. `None` where the grid has no such floor.
fn floor_gamma(grid: &[GridPoint], kept: bool) -> Option<f32> {
    // Small bytes round coarsely and large ones are few: of three thresholds the middle estimate counts.
    let mut floors: Vec<f32> = GRID_LEAST
        .iter()
        .filter_map(|&least| {
            let mut ratios: Vec<f32> = grid
                .iter()
                .flat_map(|p| (0..3).map(|c| (p.ambient[c], p.directed[c])))
                .filter(|(_, directed)| *directed >= least)
                .map(|(ambient, directed)| (f32::from(ambient) + 0.5) / (f32::from(directed) + 0.5))
                .collect();
            ratios.sort_by(f32::total_cmp);
            (ratios.len() >= GRID_CELLS).then(|| ratios[(ratios.len() as f32 * FLOOR_OUTLIERS) as usize])
        })
        .collect();
    floors.sort_by(f32::total_cmp);
    let floor = *floors.get(floors.len() / 2)?;
    let share: f32 = if kept { 0.25 } else { 0.125 };
    // Below: the grid of a compiler without a floor. Above: ambient light hides it.
    if floor < share * 0.9 || floor > 0.6 {
        return None;
    }
    Some(share.ln() / floor.ln())
}

/// γ from the most common directed light among grid cells that face the only sun, and whether it is so common there that
/// the sun alone must have caused it.
fn sun_gamma(grid: &[GridPoint], lights: &LightTable, compensate: f32) -> Option<(f32, bool)> {
    let mut suns = (0..lights.lights.len()).filter(|&i| lights.sources[i] == LightSource::Sun);
    let (sun, None) = (suns.next()?, suns.next()) else {
        return None;
    };
    let sun = &lights.lights[sun];
    let direction = Vec3::from(sun.p0);
    let mut count: HashMap<[u8; 3], usize> = HashMap::new();
    let mut facing = 0;
    for p in grid.iter().filter(|p| p.directed.iter().max() >= Some(&GRID_LEAST[0])) {
        if grid_direction(p.direction).dot(direction) > FACING_SUN {
            *count.entry(p.directed).or_default() += 1;
            facing += 1;
        }
    }
    if facing < SUN_CELLS {
        return None;
    }
    let (bytes, n) = count.into_iter().max_by_key(|(bytes, n)| (*n, *bytes))?;
    let estimates = [0, 1, 2].map(|c| {
        let stored = ((f32::from(bytes[c]) + 0.5) * compensate / 255.0).ln();
        sun.radiance[c].ln() / stored
    });
    let mean = estimates.iter().sum::<f32>() / 3.0;
    let together = estimates.iter().all(|g| (g / mean - 1.0).abs() < CHANNELS_AGREE);
    let share = n as f32 / facing as f32;
    (together && SUN_GAMMAS.contains(&mean) && share > 0.1).then_some((mean, share > 0.3))
}

/// Grid cells that must face the sun before it says anything.
const SUN_CELLS: usize = 100;
/// Exponents that a sun may suggest.
const SUN_GAMMAS: std::ops::Range<f32> = 0.8..4.0;
/// Relative difference between channels beyond which cells are not lit by the sun alone.
const CHANNELS_AGREE: f32 = 0.05;

/// Cosine beyond which a grid cell's light comes from the sun.
const FACING_SUN: f32 = 0.999;

/// Direction to the light that a grid point stores: polar byte, then azimuth as a signed byte, both cut towards zero.
pub fn grid_direction([polar, azimuth]: [u8; 2]) -> Vec3 {
    let signed = f32::from(azimuth as i8);
    let half = if signed == 0.0 { 0.0 } else { 0.5f32.copysign(signed) };
    let (sin_polar, cos_polar) = ((f32::from(polar) + 0.5) * 2.0 * PI / 255.0).sin_cos();
    let (sin_azimuth, cos_azimuth) = ((signed + half) * 2.0 * PI / 255.0).sin_cos();
    Vec3::new(cos_azimuth * sin_polar, sin_azimuth * sin_polar, cos_polar)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn encoding(gamma: f32, compensate: f32) -> Encoding {
        Encoding {
            gamma,
            compensate,
            evidence: Evidence::Stated,
        }
    }

    #[test]
    fn decoding_meets_what_was_encoded_within_a_byte() {
        for (gamma, compensate) in [(1.0, 1.0), (1.5, 1.0), (1.3, 2.0), (2.0, 3.0), (2.25, 2.56)] {
            let e = encoding(gamma, compensate);
            for i in 1..200 {
                let v = i as f32 / 200.0;
                let [byte, ..] = e.encode(Vec3::splat(v));
                let (least, greatest) = (e.decode_byte(byte.saturating_sub(1)), e.decode_byte(byte + 1));
                assert!(least < v && v < greatest, "{v} at {gamma}, {compensate}");
            }
        }
    }

    #[test]
    fn the_clamp_keeps_the_hue_and_is_recognised() {
        let e = encoding(1.0, 2.0);
        let bytes = e.encode(Vec3::new(4.0, 2.0, 1.0));
        assert_eq!(bytes, [127, 63, 31]);
        assert!(e.is_clamped(bytes));
        assert!(!e.is_clamped([120, 63, 31]));
        assert_eq!(encoding(1.0, 3.0).clamp_byte(), 85);
    }

    #[test]
    fn the_largest_byte_tells_the_compensation() {
        for (largest, c) in [
            (255, 1.0),
            (200, 1.0),
            (127, 2.0),
            (85, 3.0),
            (99, 2.563),
            (80, 3.168),
            (89, 2.849),
        ] {
            assert!((compensation(&[3, largest, 7]) - c).abs() < 1e-3, "{largest}");
        }
        assert_eq!(compensation(&[]), 1.0);
    }

    #[test]
    fn command_lines_are_read_with_the_last_word_counting() {
        let line = "-meta; -vis; -light -fast -gamma 2 -compensate 3 -gamma 1.5";
        assert_eq!(option(line, "-gamma"), Some(1.5));
        assert_eq!(option(line, "-Compensate"), Some(3.0));
        assert_eq!(option(line, "-bounce"), None);
        assert_eq!(option("-gamma", "-gamma"), None);
    }

    #[test]
    fn grid_directions_are_unit_vectors_the_right_way_up() {
        assert!(grid_direction([0, 0]).dot(Vec3::Z) > 0.999);
        assert!(grid_direction([127, 0]).dot(-Vec3::Z) > 0.999);
        assert!(grid_direction([63, 63]).dot(Vec3::Y) > 0.99);
        assert!(grid_direction([63, 192]).dot(-Vec3::Y) > 0.99);
    }
}
