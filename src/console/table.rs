//! Console variables: one table that the console, the command line, the settings window and the docs are made from.

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
    /// Kept in the configuration file.
    pub kept: bool,
    /// Read when a map is loaded: a change shows with the next one.
    pub on_load: bool,
}

impl Cvar {
    /// Text of its default.
    pub fn default_text(&self) -> String {
        match self.kind {
            Kind::Int { default, .. } => default.to_string(),
            Kind::Float { default, .. } => default.to_string(),
            Kind::Choice(words) => words[0].to_owned(),
        }
    }

    /// Its range as it is told to the user.
    pub fn range(&self) -> String {
        match self.kind {
            Kind::Int { min, max, .. } => format!("{min}..{max}"),
            Kind::Float { min, max, .. } => format!("{min}..{max}"),
            Kind::Choice(words) => words.join(", "),
        }
    }

    /// Of this run alone: not kept in the configuration file.
    const fn momentary(mut self) -> Self {
        self.kept = false;
        self
    }

    /// Read when a map is loaded.
    const fn on_load(mut self) -> Self {
        self.on_load = true;
        self
    }
}

const fn int(name: &'static str, default: i64, min: i64, max: i64, help: &'static str) -> Cvar {
    Cvar {
        name,
        kind: Kind::Int { default, min, max },
        help,
        kept: true,
        on_load: false,
    }
}

const fn float(name: &'static str, default: f64, min: f64, max: f64, help: &'static str) -> Cvar {
    Cvar {
        name,
        kind: Kind::Float { default, min, max },
        help,
        kept: true,
        on_load: false,
    }
}

const fn choice(name: &'static str, words: &'static [&'static str], help: &'static str) -> Cvar {
    Cvar {
        name,
        kind: Kind::Choice(words),
        help,
        kept: true,
        on_load: false,
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

/// Window sizes, by `r_mode`; free first.
pub const R_MODES: [&str; 10] = [
    "free",
    "640x360",
    "640x480",
    "800x600",
    "1024x768",
    "1280x720",
    "1600x900",
    "1920x1080",
    "2560x1440",
    "3840x2160",
];

/// Every console variable.
pub const CVARS: &[Cvar] = &[
    choice(
        "rt_backend",
        &["auto", "rayquery", "bvh", "cpu"],
        "how rays are traced; auto picks ray queries on GPUs that have them, own traversal elsewhere, the CPU last",
    ).on_load(),
    int(
        "rt_illumination",
        1,
        0,
        1,
        "0 shows albedo and stage colours unlit, 1 lights the scene",
    ).momentary(),
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
        "rt_soloLight",
        -1,
        -1,
        1_000_000,
        "the number of the one light that lights; -1: all of them",
    ).momentary(),
    choice(
        "rt_lightTerm",
        &["all", "visibility", "geometry", "emission"],
        "shows light by one of the terms whose product it is: the share that arrives, cosines and distance, what leaves the light",
    ).momentary(),
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
    ).momentary(),
    int(
        "rt_refine",
        0,
        0,
        1,
        "averages frames in the window while nothing moves, in place of denoising them",
    ).momentary(),
    int("rt_pause", 0, 0, 1, "stops the scene's clock").momentary(),
    float("timescale", 1.0, 0.0, 100.0, "speed of the scene's clock").momentary(),
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
    choice("rt_view", &VIEWS, "shows an intermediate image of the frame").momentary(),
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
    ).on_load(),
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
        "candidates per random light with rt_lightSampling reservoir; twice as many where more than 64 lights or groups of them compete, \
         and 8 at least in the first frames of a denoised view",
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
    int("rt_atrousLevels", 4, 0, 5, "levels of the denoiser's spatial filter; reflections take three at most"),
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
    int("rt_seed", 0, 0, 0xffff_ffff, "seed of all random numbers").momentary(),
    int(
        "rt_printPerfStats",
        0,
        0,
        2, "shows times per pass, rays, lights and a graph of frame times over the picture; 2 prints them every second, too"),
    int(
        "cg_drawGun",
        1,
        0,
        1,
        "shows the weapon before the eye, where there is a player",
    ),
    int(
        "r_lightmap",
        0,
        0,
        1,
        "shows light alone: surfaces are white, and nothing see-through is drawn",
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
    ).momentary(),
    int(
        "r_lodbias",
        0,
        -2,
        2,
        "levels by which models have less detail than their size calls for; -2 always shows all there is",
    ),
    float("cg_fov", 90.0, 1.0, 179.0, "horizontal field of view, degrees"),
    float(
        "rt_scale",
        1.0,
        0.25,
        2.0,
        "edge of the traced image as a share of the window's; below 1 is faster, above 1 finer",
    ),
    float("sensitivity", 5.0, 0.01, 100.0, "mouse sensitivity"),
    float(
        "m_pitch",
        0.022,
        -1.0,
        1.0,
        "degrees of pitch a mouse count, times sensitivity; negative turns up and down about",
    ),
    float("m_yaw", 0.022, -1.0, 1.0, "degrees of yaw a mouse count, times sensitivity"),
    float(
        "joy_sensitivity",
        180.0,
        1.0,
        1000.0,
        "turn of a gamepad's stick held to the side, degrees a second (builds with the feature `gamepad`)",
    ),
    float(
        "joy_threshold",
        0.15,
        0.0,
        0.9,
        "share of a gamepad stick's way that counts as its middle",
    ),
    int("cg_drawFPS", 0, 0, 1, "shows frames per second in the corner"),
    int("cg_drawCrosshair", 1, 0, 1, "shows where one aims"),
    float("cg_crosshairSize", 24.0, 2.0, 200.0, "width of the crosshair, points"),
    int(
        "cg_drawPosition",
        0,
        0,
        1,
        "shows position, angles, speed and PVS cluster in the corner",
    ),
    int("cg_drawStatus", 1, 0, 1, "shows health"),
    float("con_scale", 1.0, 0.5, 4.0, "size of console, menus and overlays"),
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
    int("r_fullscreen", 0, 0, 1, "1 covers the whole screen; Alt+Enter changes it, too"),
    choice(
        "r_mode",
        &R_MODES,
        "size of the window, pixels; free leaves it as it was opened or dragged",
    ),
];

/// The table as Markdown, for `docs/cvars.md`.
pub fn markdown() -> String {
    let mut out = String::from(
        "# Console variables\n\nMade from the table in `src/console/table.rs` (`tests/docs.rs` checks that it is up to date). \
         Set one in the console with `NAME VALUE`, on the command line with `+set NAME VALUE`.\n\n| variable | default | range | what it does |\n|---|---|---|---|\n",
    );
    for c in CVARS {
        let mut help = c.help.to_owned();
        if c.on_load {
            help.push_str(" (read when a map is loaded)");
        }
        if !c.kept {
            help.push_str(" (not kept in the configuration)");
        }
        out.push_str(&format!(
            "| `{}` | {} | {} | {help} |\n",
            c.name,
            c.default_text(),
            c.range()
        ));
    }
    out
}
