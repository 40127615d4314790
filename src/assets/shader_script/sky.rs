//! `skyParms`: what a sky surface shows.

/// Boxes and clouds of a sky.
#[derive(Clone, Debug, PartialEq)]
pub struct SkyParms {
    /// Image name without the `_rt`, `_bk`, `_lf`, `_ft`, `_up`, `_dn` of the six sides, drawn behind the clouds.
    /// None for `-`, and for `full`, which old scripts use for the same.
    pub outer_box: Option<String>,
    /// Height of the cloud dome in units; 512 where the script has none or zero.
    pub cloud_height: f32,
    /// Like `outer_box`, drawn before the clouds.
    pub inner_box: Option<String>,
}

impl SkyParms {
    /// Cloud height where the script gives none.
    pub const DEFAULT_CLOUD_HEIGHT: f32 = 512.0;
}
