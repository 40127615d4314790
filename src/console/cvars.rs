//! Console variables: one table that the console, the command line, the settings window and the docs are made from.

use thiserror::Error;

/// Default and limits of a variable.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Kind {
    /// Whole number in a range, both ends included.
    Int { default: i64, min: i64, max: i64 },
    /// Real number in a range, both ends included.
    Float { default: f64, min: f64, max: f64 },
    /// One of a list of words; the first is the default.
    Choice(&'static [&'static str]),
}

/// A row of the table.
#[derive(Clone, Copy, Debug)]
pub struct Cvar {
    pub name: &'static str,
    pub kind: Kind,
    /// What it does, with units, in one line.
    pub help: &'static str,
}

const fn int(name: &'static str, default: i64, min: i64, max: i64, help: &'static str) -> Cvar {
    Cvar {
        name,
        kind: Kind::Int { default, min, max },
        help,
    }
}

const fn float(name: &'static str, default: f64, min: f64, max: f64, help: &'static str) -> Cvar {
    Cvar {
        name,
        kind: Kind::Float { default, min, max },
        help,
    }
}

const fn choice(name: &'static str, words: &'static [&'static str], help: &'static str) -> Cvar {
    Cvar {
        name,
        kind: Kind::Choice(words),
        help,
    }
}

/// Views of the frame's intermediate images, by `rt_view`; the shader's numbering is the order here.
pub const VIEWS: [&str; 24] = [
    "final",
    "albedo",
    "normal",
    "geo_normal",
    "depth",
    "position",
    "cluster",
    "material",
    "direct",
    "emission",
    "ambient",
    "denoised",
    "alpha",
    "history",
    "variance",
    "moments",
    "gradient",
    "motion",
    "atrous0",
    "atrous1",
    "atrous2",
    "atrous3",
    "atrous4",
    "secondary",
];

/// Every console variable.
pub const CVARS: &[Cvar] = &[
    choice(
        "rt_backend",
        &["auto", "rayquery", "bvh", "cpu"],
        "how rays are traced; auto picks ray queries on GPUs that have them, own traversal elsewhere, the CPU last",
    ),
    int(
        "rt_illumination",
        1,
        0,
        1,
        "0 shows albedo and stage colours unlit, 1 lights the scene",
    ),
    int(
        "rt_cullLights",
        1,
        0,
        2,
        "0 considers every light, 1 those the PVS lets through, 2 also drops lights that face away from the whole cluster",
    ),
    int(
        "rt_numRandomDL",
        1,
        0,
        64,
        "lights sampled at random per hit for direct light; 0 samples all of them",
    ),
    int(
        "rt_softshadows",
        1,
        0,
        1,
        "1 samples the area of lights, 0 their centre only (an approximation with hard shadows)",
    ),
    int(
        "rt_maxDepth",
        5,
        1,
        16,
        "mirrors, portals, glass and water that a ray is followed through at most",
    ),
    choice(
        "rt_secondary",
        &["both", "one", "off"],
        "where glass or water both reflects and lets through: follows both, one at random, or neither and shows the stages alone",
    ),
    int(
        "rt_glossy",
        1,
        0,
        1,
        "environment-mapped stages reflect what is around; 0 shows the picture that the game puts there",
    ),
    int("rt_antialiasing", 1, 0, 1, "jitters the ray within the pixel"),
    float(
        "rt_motionblur",
        0.0,
        0.0,
        1.0,
        "share of a frame that the shutter is open where samples are averaged: --spp and rt_accumulate; a frame lasts as --fps \
         says, else 1/60 s",
    ),
    int("rt_dof", 0, 0, 1, "depth of field through a thin lens"),
    float("rt_aperture", 1.0, 0.0, 64.0, "lens radius for rt_dof, units"),
    float(
        "rt_focallength",
        0.0,
        0.0,
        65536.0,
        "distance to the plane in focus, units; 0 focuses on what is under the crosshair",
    ),
    int(
        "rt_accumulate",
        0,
        0,
        1,
        "refines the still image by averaging frames; implies rt_pause",
    ),
    int(
        "rt_refine",
        0,
        0,
        1,
        "averages frames in the window while nothing moves, in place of denoising them",
    ),
    int("rt_pause", 0, 0, 1, "stops the scene's clock"),
    float("timescale", 1.0, 0.0, 100.0, "speed of the scene's clock"),
    float(
        "rt_exposure",
        0.0,
        0.0,
        1e6,
        "linear multiplier on radiance before the tone map; 0 chooses it from the image",
    ),
    choice(
        "rt_emission",
        &["game", "radiance"],
        "how bright lamps and skies are to the eye: as the game shows them, or with the radiance they light with",
    ),
    choice(
        "rt_tonemap",
        &["aces", "reinhard", "clamp"],
        "curve from exposed radiance to the display",
    ),
    choice("rt_view", &VIEWS, "shows an intermediate image of the frame"),
    choice(
        "rt_sequence",
        &["sobol", "random"],
        "random numbers: Owen-scrambled Sobol points, or independent white noise",
    ),
    choice(
        "rt_lights",
        &["all", "known", "recovered"],
        "which lights a map gets when it is loaded: those its files describe and those found in its lightmaps, both at the \
         strength that the lightmaps show, those its files describe as they describe them, or those found alone",
    ),
    choice(
        "rt_ambient",
        &["grid", "constant", "off"],
        "what stands for light that no light of the map explains: what is left over of the map's light grid, a constant, or \
         nothing",
    ),
    choice(
        "rt_lightSampling",
        &["reservoir", "uniform", "power", "bvh", "cells"],
        "how a random light is chosen: candidates of `cells` resampled by what they would contribute, every light in the \
         receiver's list alike, by power, by a tree with an eye to distance and angle, or by what the receiver's \
         surroundings were found to get from each light",
    ),
    int(
        "rt_lightCandidates",
        2,
        1,
        32,
        "candidates per random light with rt_lightSampling reservoir",
    ),
    int(
        "rt_lightReuse",
        1,
        0,
        2,
        "reuses light samples between frames and pixels, with rt_lightSampling reservoir and rt_numRandomDL 1: 1 in frames that \
         are not denoised, 2 in all; the denoiser does better with samples that do not depend on each other",
    ),
    int(
        "rt_reuseHistory",
        20,
        0,
        100,
        "frames whose light samples a pixel's history counts for at most",
    ),
    int(
        "rt_reuseNeighbours",
        1,
        0,
        4,
        "neighbours whose light samples a pixel reuses",
    ),
    int(
        "rt_denoiser",
        1,
        0,
        1,
        "denoises frames that are shown as they come (A-SVGF); averaged frames are never denoised",
    ),
    int(
        "rt_gradients",
        1,
        0,
        1,
        "lets the denoiser forget at once where the light has changed since the frame before",
    ),
    int("rt_atrousLevels", 5, 0, 5, "levels of the denoiser's spatial filter"),
    float(
        "rt_leastAlpha",
        0.05,
        0.05,
        1.0,
        "least weight of a new frame in the denoiser's history",
    ),
    float(
        "rt_fireflies",
        0.0,
        0.0,
        100.0,
        "clamps light samples to so many standard deviations over the mean of their surroundings before they are denoised, \
         which darkens; 0 clamps nothing",
    ),
    int(
        "rt_taa",
        1,
        0,
        1,
        "temporal anti-aliasing of frames that are shown as they come, with rt_antialiasing",
    ),
    float(
        "rt_taaGamma",
        2.0,
        0.25,
        16.0,
        "half width of the colours that temporal anti-aliasing lets history have, standard deviations",
    ),
    int("rt_seed", 0, 0, 0xffff_ffff, "seed of all random numbers"),
    int("rt_printPerfStats", 0, 0, 1, "prints times per pass every second"),
    int(
        "cg_drawGun",
        1,
        0,
        1,
        "shows the weapon before the eye, where there is a player",
    ),
    int(
        "r_drawSun",
        0,
        0,
        1,
        "shows the discs of suns: most skies have one in their picture already",
    ),
    float(
        "rt_flashlight",
        0.0,
        0.0,
        10000.0,
        "brightness of a lamp in the player's hand, as of a light entity (300 is usual); 0: off",
    ),
    int(
        "r_lodbias",
        0,
        -2,
        2,
        "levels by which models have less detail than their size calls for; -2 always shows all there is",
    ),
    float("cg_fov", 90.0, 1.0, 179.0, "horizontal field of view, degrees"),
    float("sensitivity", 5.0, 0.01, 100.0, "mouse sensitivity"),
    int(
        "com_maxfps",
        0,
        0,
        1000,
        "frame-rate limit, frames per second; 0 is none",
    ),
    int(
        "r_swapInterval",
        0,
        0,
        1,
        "1 waits for the display's refresh before showing a frame",
    ),
    int("r_fullscreen", 0, 0, 1, "1 covers the whole screen"),
];

/// A set of a variable that did not go as asked.
#[derive(Debug, Error, PartialEq)]
pub enum CvarError {
    #[error("unknown variable \"{name}\"{}", .nearest.map(|n| format!(" (did you mean {n}?)")).unwrap_or_default())]
    Unknown {
        name: String,
        nearest: Option<&'static str>,
    },
    #[error("{name} takes {expected}, not \"{value}\"")]
    Value {
        name: &'static str,
        value: String,
        expected: String,
    },
}

/// Value of a variable.
#[derive(Clone, Debug, PartialEq)]
enum Value {
    Int(i64),
    Float(f64),
    /// Index into the list of words.
    Choice(usize),
}

/// Current values of all variables.
#[derive(Clone, Debug, PartialEq)]
pub struct Cvars {
    values: Vec<Value>,
}

impl Default for Cvars {
    fn default() -> Self {
        Self {
            values: CVARS
                .iter()
                .map(|c| match c.kind {
                    Kind::Int { default, .. } => Value::Int(default),
                    Kind::Float { default, .. } => Value::Float(default),
                    Kind::Choice(_) => Value::Choice(0),
                })
                .collect(),
        }
    }
}

fn find(name: &str) -> Option<usize> {
    CVARS.iter().position(|c| c.name.eq_ignore_ascii_case(name))
}

/// Number of single-character edits between two words (Levenshtein).
fn edits(a: &str, b: &str) -> usize {
    let b: Vec<char> = b.chars().collect();
    let mut row: Vec<usize> = (0..=b.len()).collect();
    for (i, ca) in a.chars().enumerate() {
        let mut diagonal = std::mem::replace(&mut row[0], i + 1);
        for (j, cb) in b.iter().enumerate() {
            let substitute = diagonal + usize::from(ca != *cb);
            diagonal = row[j + 1];
            row[j + 1] = substitute.min(diagonal + 1).min(row[j] + 1);
        }
    }
    row[b.len()]
}

impl Cvars {
    /// Sets a variable from text. Out-of-range numbers are clamped; the message says so.
    ///
    /// # Errors
    /// [`CvarError`] for an unknown name (with the nearest one) or a value of the wrong kind.
    pub fn set(&mut self, name: &str, text: &str) -> Result<Option<String>, CvarError> {
        let Some(at) = find(name) else {
            let lower = name.to_ascii_lowercase();
            let nearest = CVARS
                .iter()
                .map(|c| (edits(&lower, &c.name.to_ascii_lowercase()), c.name))
                .min();
            return Err(CvarError::Unknown {
                name: name.to_owned(),
                nearest: nearest.filter(|(n, _)| *n <= name.len() / 2).map(|(_, name)| name),
            });
        };
        let cvar = &CVARS[at];
        let wrong = |expected: String| CvarError::Value {
            name: cvar.name,
            value: text.to_owned(),
            expected,
        };
        let (value, message) = match cvar.kind {
            Kind::Int { min, max, .. } => {
                let number: f64 = text.parse().map_err(|_| wrong("a whole number".into()))?;
                if !number.is_finite() || number.fract() != 0.0 {
                    return Err(wrong("a whole number".into()));
                }
                let clamped = (number as i64).clamp(min, max);
                let note = (clamped as f64 != number).then(|| format!("{} clamped to {clamped}", cvar.name));
                (Value::Int(clamped), note)
            }
            Kind::Float { min, max, .. } => {
                let number: f64 = text.parse().map_err(|_| wrong("a number".into()))?;
                if number.is_nan() {
                    return Err(wrong("a number".into()));
                }
                let clamped = number.clamp(min, max);
                let note = (clamped != number).then(|| format!("{} clamped to {clamped}", cvar.name));
                (Value::Float(clamped), note)
            }
            Kind::Choice(words) => {
                let word = words
                    .iter()
                    .position(|w| w.eq_ignore_ascii_case(text))
                    .or_else(|| text.parse::<usize>().ok().filter(|&i| i < words.len()));
                (
                    Value::Choice(word.ok_or_else(|| wrong(format!("one of: {}", words.join(", "))))?),
                    None,
                )
            }
        };
        self.values[at] = value;
        Ok(message)
    }

    /// Text of a variable's value; `None` for an unknown name.
    pub fn get(&self, name: &str) -> Option<String> {
        let at = find(name)?;
        Some(match (&self.values[at], CVARS[at].kind) {
            (Value::Choice(i), Kind::Choice(words)) => words[*i].to_owned(),
            (Value::Int(i), _) => i.to_string(),
            (Value::Float(f), _) => f.to_string(),
            (Value::Choice(i), _) => i.to_string(),
        })
    }

    /// A number of the table, by its exact name. Names are literals of this program; one that is not in the table reads
    /// as 0 and fails the test that reads all of [`crate::render::settings::Settings`].
    pub fn number(&self, name: &str) -> f64 {
        match find(name).map(|at| &self.values[at]) {
            Some(Value::Int(i)) => *i as f64,
            Some(Value::Float(f)) => *f,
            Some(Value::Choice(i)) => *i as f64,
            None => 0.0,
        }
    }

    /// Name and value of every variable, in table order.
    pub fn all(&self) -> serde_json::Map<String, serde_json::Value> {
        CVARS
            .iter()
            .zip(&self.values)
            .map(|(c, v)| {
                let value = match (v, c.kind) {
                    (Value::Int(i), _) => (*i).into(),
                    (Value::Float(f), _) => (*f).into(),
                    (Value::Choice(i), Kind::Choice(words)) => words[*i].into(),
                    (Value::Choice(i), _) => (*i).into(),
                };
                (c.name.to_owned(), value)
            })
            .collect()
    }
}

/// The table as Markdown, for `docs/cvars.md`.
pub fn markdown() -> String {
    let mut out = String::from(
        "# Console variables\n\nMade from the table in `src/console/cvars.rs` (`tests/docs.rs` checks that it is up to date). \
         Set one on the command line with `+set NAME VALUE`.\n\n| variable | default | range | what it does |\n|---|---|---|---|\n",
    );
    for c in CVARS {
        let (default, range) = match c.kind {
            Kind::Int { default, min, max } => (default.to_string(), format!("{min}..{max}")),
            Kind::Float { default, min, max } => (default.to_string(), format!("{min}..{max}")),
            Kind::Choice(words) => (words[0].to_owned(), words.join(", ")),
        };
        out.push_str(&format!("| `{}` | {default} | {range} | {} |\n", c.name, c.help));
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_are_checked_clamped_and_read_back() {
        let mut cvars = Cvars::default();
        assert_eq!(cvars.set("RT_cullLights", "2"), Ok(None));
        assert_eq!(cvars.get("rt_cullLights").as_deref(), Some("2"));
        assert!(cvars.set("rt_numRandomDL", "1000").is_ok_and(|note| note.is_some()));
        assert_eq!(cvars.number("rt_numRandomDL"), 64.0);
        assert!(cvars.set("rt_exposure", "nan").is_err());
        assert!(cvars.set("rt_tonemap", "sepia").is_err());
        assert_eq!(
            cvars.set("rt_culllight", "1"),
            Err(CvarError::Unknown {
                name: "rt_culllight".into(),
                nearest: Some("rt_cullLights")
            })
        );
    }

    #[test]
    fn names_are_unique_and_defaults_in_range() {
        for (i, c) in CVARS.iter().enumerate() {
            assert_eq!(find(c.name), Some(i));
            match c.kind {
                Kind::Int { default, min, max } => assert!((min..=max).contains(&default)),
                Kind::Float { default, min, max } => assert!((min..=max).contains(&default)),
                Kind::Choice(words) => assert!(!words.is_empty()),
            }
        }
    }
}
