//! What stays the same for one frame, as the shaders read it. `shaders/include/scene.glsl` is the GLSL side; a test compares
//! member offsets.

use crate::scene::records::NONE;
use bytemuck::{Pod, Zeroable};

/// `struct FrameConstants`: addresses first, then the view, then settings.
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
#[repr(C)]
pub struct FrameConstants {
    pub positions: u64,
    pub attributes: u64,
    pub triangles: u64,
    pub materials: u64,
    pub stages: u64,
    pub tc_mods: u64,
    pub deforms: u64,
    pub rest_vertices: u64,
    pub fogs: u64,
    pub fog_planes: u64,
    pub portals: u64,
    pub dynamic_triangles: u64,
    pub instances: u64,
    pub lights: u64,
    /// The frame's own lights.
    pub guest_lights: u64,
    pub bsp_nodes: u64,
    pub light_rows: u64,
    pub light_runs: u64,
    pub light_nodes: u64,
    /// Prefix sums of the lights' weights.
    pub light_weights: u64,
    pub light_cells: u64,
    pub cell_entries: u64,
    pub cell_bounds: u64,
    pub ambient_cubes: u64,
    pub textures: u64,
    pub mesh_trees: u64,
    pub cwbvh_nodes: u64,
    pub cwbvh_triangles: u64,
    pub bvh2_nodes: u64,
    pub bvh2_triangles: u64,
    pub instance_nodes: u64,
    /// Reservoirs of this frame, and those that the frame before left and this one leaves; 0 where samples are not reused.
    pub reservoirs: u64,
    pub reservoir_history: u64,
    /// Samples that the denoiser's gradients are taken of.
    pub strata: u64,
    pub counters: u64,
    /// Pixels of which something branches off.
    pub secondary_pixels: u64,
    /// Light of each triangle, or NONE.
    pub triangle_lights: u64,
    pub exposure: u64,
    pub focus: u64,
    pub srgb: u64,
    pub eye: [f32; 3],
    /// Half width of the image plane at distance 1.
    pub half_width: f32,
    pub forward: [f32; 3],
    pub half_height: f32,
    pub right: [f32; 3],
    /// Lens radius, units; 0 for a pinhole.
    pub aperture: f32,
    pub up: [f32; 3],
    /// Width of a pixel's cone at distance 1; 0 reads textures at full resolution.
    pub cone: f32,
    /// Where the frame before was seen from, which all histories belong to.
    pub old_eye: [f32; 3],
    pub old_half_width: f32,
    pub old_forward: [f32; 3],
    pub old_half_height: f32,
    pub old_right: [f32; 3],
    /// Frames' worth of candidates that history counts at most; 0 without history.
    pub reuse_history: u32,
    pub old_up: [f32; 3],
    /// Neighbours whose samples a pixel reuses.
    pub reuse_neighbours: u32,
    /// The volume of unexplained light.
    pub ambient_origin: [f32; 3],
    /// 0: none, 1: the constant, 2: the volume.
    pub ambient: u32,
    pub ambient_step: [f32; 3],
    pub ambient_width: u32,
    pub ambient_constant: [f32; 3],
    pub ambient_height: u32,
    pub size: [u32; 2],
    pub seed: u32,
    pub sequence: u32,
    pub instance_count: u32,
    pub instance_root: u32,
    pub all_row: u32,
    pub cull_lights: u32,
    pub random_lights: u32,
    pub light_sampling: u32,
    /// Candidates per random light where they are resampled.
    pub light_candidates: u32,
    /// Fewest of them: more than that where histories have just begun. And the same of the frame before.
    pub least_candidates: u32,
    pub old_least_candidates: u32,
    /// Lights in the tree; suns follow.
    pub finite_lights: u32,
    pub soft_shadows: u32,
    pub antialiasing: u32,
    pub illumination: u32,
    pub tonemap: u32,
    pub view: u32,
    /// Multiplier before the tone map; 0: the automatic one.
    pub fixed_exposure: f32,
    /// Share of the way to the wanted exposure that one frame goes, in the logarithm.
    pub exposure_blend: f32,
    /// Slots of the hash table of light cells, a power of two, less one.
    pub cell_mask: u32,
    pub ambient_depth: u32,
    /// Where in its pixel every ray of this frame goes, pixels; negative: each sample elsewhere.
    pub jitter: [f32; 2],
    /// The same of the frame before.
    pub old_jitter: [f32; 2],
    /// Where the denoised irradiance is: 0 nowhere (it is off), 1 and 2 the images `filter_a` and `filter_b`.
    pub denoised: u32,
    pub taa: u32,
    /// The view's histories are those of the frame before.
    pub history: u32,
    /// 0: view or scene have changed since the frame before, 1: they have not, 2: nor had they before it.
    pub still: u32,
    /// Least weight of a new frame in the denoiser's history.
    pub least_alpha: f32,
    /// Half width of the TAA clip in standard deviations.
    pub taa_gamma: f32,
    /// Most that a sample may exceed its surroundings by, in standard deviations; 0: anything.
    pub fireflies: f32,
    /// This frame reuses light samples: `reservoirs` are there.
    pub reservoirs_used: u32,
    /// The lights are not those of the frame before: gradients tell where that matters.
    pub changed: u32,
    pub filter_levels: u32,
    /// The scene's time: [`crate::scene::clock`].
    pub clock: u32,
    /// Lit layers may be shaded instead of what is behind them.
    pub choose_layers: u32,
    /// The scene has layers that tint light.
    pub light_filters: u32,
    /// What emits is seen as 0: the game shows it, 1: it lights.
    pub shown_emission: u32,
    /// Instances move: where a surface was is in the image `motion`.
    pub moving: u32,
    /// Time of the frame before.
    pub old_clock: u32,
    pub first_dynamic_vertex: u32,
    pub dynamic_triangles_count: u32,
    pub fog_count: u32,
    pub portal_count: u32,
    /// Mirrors, portals and interfaces that a ray is followed through at most.
    pub max_depth: u32,
    /// What is followed at interfaces: [`super::settings::Secondary`].
    pub secondary: u32,
    /// Glossy stages reflect.
    pub glossy: u32,
    /// The scene has surfaces that something branches off at, and this frame follows it.
    pub branches_off: u32,
    /// A branch of less than this share is followed now and then; 0: always.
    pub branch_share: f32,
    pub guest_count: u32,
    /// Suns are seen.
    pub draw_sun: u32,
    /// Levels of the denoiser's filter over what branches off.
    pub secondary_levels: u32,
    /// Surfaces are white, and what is see-through is not there to the eye.
    pub white: u32,
    /// The one light that lights; [`NONE`] for all, [`NO_SUCH_LIGHT`] where the map has none of its number.
    pub solo_light: u32,
    /// [`crate::render::settings::LightTerm`].
    pub light_term: u32,
}

/// [`FrameConstants::solo_light`] of a number that no light has.
pub const NO_SUCH_LIGHT: u32 = NONE - 1;

/// Push constants of every pass.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub struct Push {
    /// Address of the [`FrameConstants`].
    pub frame: u64,
    pub sample_index: u32,
    /// Samples in the accumulation, this one included; 0 where nothing is accumulated.
    pub accumulated: u32,
    /// Number of the filter level, from 0.
    pub level: u32,
    pub padding: u32,
}
