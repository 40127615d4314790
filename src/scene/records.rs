//! Plain records that the CPU tracer and the shaders read alike. `shaders/include/scene.glsl` is their GLSL side; a test
//! compares member offsets by reflection of the compiled shaders.

use bytemuck::{Pod, Zeroable};
use glam::Affine3A;

/// "None" in an index field.
pub const NONE: u32 = u32::MAX;

/// What shading needs of a vertex beside its position.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct VertexAttributes {
    /// Unit shading normal, object space.
    pub normal: [f32; 3],
    /// Texture coordinates; (0, 0) is the image's top left corner.
    pub uv: [f32; 2],
    /// Lightmap coordinates, 0..1 of the surface's page.
    pub lightmap_uv: [f32; 2],
    /// Encoded vertex colour, RGBA8 with red in the lowest byte.
    pub color: u32,
}

/// A triangle of the scene, addressed by its global index.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Triangle {
    /// Global vertex indices.
    pub vertices: [u32; 3],
    pub material: u32,
    /// Surface of the map file, or [`NONE`] for MD3 models.
    pub surface: u32,
    /// Light-list row for receivers whose own position is in no cluster.
    pub fallback_row: u32,
}

/// `Material::flags`: keep a hit only where the alpha test passes.
pub const MATERIAL_ALPHA_TESTED: u32 = 1;
/// `Material::flags`: the surface is a window to the sky.
pub const MATERIAL_SKY: u32 = 2;
/// `Material::flags`: emits on both sides.
pub const MATERIAL_TWO_SIDED_EMISSION: u32 = 4;
/// `Material::flags`: texture coordinates clamp instead of repeating.
pub const MATERIAL_CLAMP: u32 = 8;
/// `Material::flags`: the six textures of a sky box are present.
pub const MATERIAL_SKY_BOX: u32 = 16;
/// `Material::flags`: the stages decide what is seen; else it is the texture, lit.
pub const MATERIAL_STAGES: u32 = 32;
/// `Material::flags`: what is behind shows through.
pub const MATERIAL_LAYER: u32 = 64;
/// `Material::flags`: a layer that takes something from the light passing through.
pub const MATERIAL_FILTER: u32 = 128;
/// `Material::flags`: drawn seen from behind.
pub const MATERIAL_BACK: u32 = 256;
/// `Material::flags`: not drawn seen from the front.
pub const MATERIAL_NO_FRONT: u32 = 512;
/// `Material::flags`: a mirror or portal: a layer before what is seen in it.
pub const MATERIAL_PORTAL: u32 = 2048;
/// `Material::flags`: emission is that of its stages as the clock has them.
pub const MATERIAL_MOVING_EMISSION: u32 = 1024;
/// `Material::flags`: a smooth interface that reflects by Fresnel's equations and bends what goes through.
pub const MATERIAL_DIELECTRIC: u32 = 4096;
/// `Material::flags`: of a dielectric: both sides of a pane in one surface; nothing bends.
pub const MATERIAL_PANE: u32 = 8192;
/// `Material::flags`: some stage is a glossy reflection.
pub const MATERIAL_GLOSSY: u32 = 16384;

/// Surface appearance as the tracer sees it.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Material {
    /// Texture of the albedo.
    pub texture: u32,
    pub flags: u32,
    /// Alpha test: passes where alpha·`alpha_scale` + `alpha_offset` > 0 (alpha in 0..1).
    pub alpha_scale: f32,
    pub alpha_offset: f32,
    /// Emitted radiance (luxel units) where the emission texture is 1 (linear), or everywhere without one.
    pub emission: [f32; 3],
    /// The same as the game would show it, in place of what it lights with.
    pub shown: [f32; 3],
    /// Texture that modulates emission, or [`NONE`].
    pub emission_texture: u32,
    /// Sky box images, or [`NONE`]: right (+x of the box), left, back, front, up, down in id's naming.
    pub sky: [u32; 6],
    /// Stages in drawing order.
    pub first_stage: u32,
    pub stage_count: u32,
    /// Stage whose alpha the alpha test looks at, or [`NONE`]: the texture's own.
    pub alpha_stage: u32,
    /// Radiance of a sky where its picture is 1 (linear).
    pub sky_scale: [f32; 3],
    /// Height of a sky's clouds, units.
    pub cloud_height: f32,
    /// Deformations in their order.
    pub first_deform: u32,
    pub deform_count: u32,
    /// Index of refraction of a dielectric: behind its front over before it.
    pub ior: f32,
    /// Width of the lobe of glossy stages: the square of their roughness.
    pub lobe: f32,
}

/// `Deform::kind`: along the normal by `wave`, its phase growing by `a` periods a unit of x + y + z.
pub const DEFORM_WAVE: u32 = 0;
/// `Deform::kind`: normals wobble by `a`.
pub const DEFORM_NORMAL: u32 = 1;
/// `Deform::kind`: along the normal by `b` times a sine whose phase grows by `a` periods over a texture's width.
pub const DEFORM_BULGE: u32 = 2;
/// `Deform::kind`: by `direction` times `wave`.
pub const DEFORM_MOVE: u32 = 3;
/// `Deform::kind`: quads face the eye.
pub const DEFORM_AUTOSPRITE: u32 = 4;
/// `Deform::kind`: quads turn about their long axis to face the eye.
pub const DEFORM_AUTOSPRITE2: u32 = 5;

/// A change of the geometry.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Deform {
    pub kind: u32,
    pub rate: u32,
    pub a: f32,
    pub b: f32,
    pub direction: [f32; 3],
    pub wave: Wave,
}

/// A surface of a mirror or portal.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Portal {
    /// Surface of the map file.
    pub surface: u32,
    /// 1: a mirror; the maps are not used.
    pub mirror: u32,
    /// World before the portal to world at its camera, three rows of four.
    pub there: [[f32; 4]; 3],
    /// The other way.
    pub back: [[f32; 4]; 3],
}

/// A volume of fog.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Fog {
    /// Radiance where it hides everything.
    pub colour: [f32; 3],
    /// Inverse of the way through it that hides everything, 1/units.
    pub density: f32,
    pub first_plane: u32,
    pub plane_count: u32,
}

/// A vertex of dynamic geometry as modelled.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct RestVertex {
    pub position: [f32; 3],
    pub normal: [f32; 3],
    /// First global vertex of its quad, for sprites; else [`NONE`].
    pub quad: u32,
    pub material: u32,
    /// That carries it: in its space sprites look at the eye.
    pub instance: u32,
}

/// Where a dynamic triangle stands in the trees' own orders.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct DynamicTriangle {
    pub triangle: u32,
    pub cwbvh: u32,
    pub bvh2: u32,
}

/// `Wave::function`: see [`crate::assets::shader_script::WaveFunction`].
pub const WAVE_SINE: u32 = 0;
pub const WAVE_TRIANGLE: u32 = 1;
pub const WAVE_SQUARE: u32 = 2;
pub const WAVE_SAWTOOTH: u32 = 3;
pub const WAVE_INVERSE_SAWTOOTH: u32 = 4;
pub const WAVE_NOISE: u32 = 5;

/// `base + amplitude · function(phase + clock · rate)`; rates are [`super::clock`]'s.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Wave {
    pub function: u32,
    pub base: f32,
    pub amplitude: f32,
    /// Periods; of noise, steps over [`super::clock::NOISE_STEPS`].
    pub phase: f32,
    pub rate: u32,
}

/// `TcMod::kind`: `matrix` times the coordinates, plus `offset`.
pub const TC_AFFINE: u32 = 0;
/// `TcMod::kind`: plus the fractions of the clock at both `rates`.
pub const TC_SCROLL: u32 = 1;
/// `TcMod::kind`: wobbles by the place of the point.
pub const TC_TURBULENCE: u32 = 2;
/// `TcMod::kind`: divides by the wave around the middle.
pub const TC_STRETCH: u32 = 3;
/// `TcMod::kind`: turns around the middle at the first of `rates`.
pub const TC_ROTATE: u32 = 4;

/// A change of texture coordinates.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct TcMod {
    pub kind: u32,
    pub rates: [u32; 2],
    /// Columns.
    pub matrix: [f32; 4],
    pub offset: [f32; 2],
    pub wave: Wave,
}

/// `Stage::flags`: what it adds is lit.
pub const STAGE_LIT: u32 = 1;
/// `Stage::flags`: texture coordinates clamp instead of repeating.
pub const STAGE_CLAMP: u32 = 2;
/// `Stage::flags`: what it shows is left to the material's emission.
pub const STAGE_EMISSION: u32 = 4;
/// `Stage::flags`: its texture is plain white.
pub const STAGE_WHITE: u32 = 8;
/// `Stage::flags`: its image stands for what the surface reflects: its mean is the reflectance of a glossy lobe.
pub const STAGE_GLOSSY: u32 = 16;

/// `Stage::rgb_source` and `alpha_source`: `rgb` and `alpha` as they are.
pub const SOURCE_CONSTANT: u32 = 0;
/// The wave, held to 0..1.
pub const SOURCE_WAVE: u32 = 1;
pub const SOURCE_VERTEX: u32 = 2;
pub const SOURCE_ONE_MINUS_VERTEX: u32 = 3;
/// Alpha: highlight of a light at a fixed place.
pub const SOURCE_SPECULAR: u32 = 4;
/// Alpha: distance to the viewer over `alpha`.
pub const SOURCE_PORTAL: u32 = 5;

/// `Stage::tc_gen`
pub const TC_TEXTURE: u32 = 0;
pub const TC_LIGHTMAP: u32 = 1;
pub const TC_ENVIRONMENT: u32 = 2;
pub const TC_VECTOR: u32 = 3;

/// `Stage::source` and `destination`: factors of the blend function.
pub const BLEND_ZERO: u32 = 0;
pub const BLEND_ONE: u32 = 1;
pub const BLEND_SRC_COLOR: u32 = 2;
pub const BLEND_ONE_MINUS_SRC_COLOR: u32 = 3;
pub const BLEND_DST_COLOR: u32 = 4;
pub const BLEND_ONE_MINUS_DST_COLOR: u32 = 5;
pub const BLEND_SRC_ALPHA: u32 = 6;
pub const BLEND_ONE_MINUS_SRC_ALPHA: u32 = 7;

/// Most images of a stage.
pub const STAGE_TEXTURES: usize = 8;

/// One pass of a material: see [`super::program`].
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Stage {
    pub textures: [u32; STAGE_TEXTURES],
    /// Images shown in turn, 1 to 8.
    pub frames: u32,
    /// Rounds of all images.
    pub frame_rate: u32,
    pub flags: u32,
    pub source: u32,
    pub destination: u32,
    pub rgb_source: u32,
    pub alpha_source: u32,
    pub tc_gen: u32,
    /// Encoded colour.
    pub rgb: [f32; 3],
    pub alpha: f32,
    pub rgb_wave: Wave,
    pub alpha_wave: Wave,
    /// Of `tcGen vector`.
    pub tc_vectors: [[f32; 3]; 2],
    pub first_mod: u32,
    pub mod_count: u32,
}

/// `Instance::seen_by`: rays from the eye, through water and glass too.
pub const SEEN_BY_EYE: u32 = 1;
/// `Instance::seen_by`: rays that a mirror or another surface has turned back.
pub const SEEN_BY_REFLECTIONS: u32 = 2;
/// `Instance::seen_by`: rays to lights, and all others.
pub const SEEN_BY_SHADOWS: u32 = 4;
/// `Instance::seen_by`: all rays.
pub const SEEN_BY_ALL: u32 = 7;

/// A placed mesh.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Instance {
    /// Object to world, three rows of four.
    pub object_to_world: [[f32; 4]; 3],
    /// World to object, three rows of four.
    pub world_to_object: [[f32; 4]; 3],
    /// Object to world in the frame before.
    pub old_object_to_world: [[f32; 4]; 3],
    /// First global triangle of the mesh.
    pub first_triangle: u32,
    pub mesh: u32,
    /// 1 where the transform is exactly the identity.
    pub identity: u32,
    /// 1 where the transform may change.
    pub moves: u32,
    /// Rays that meet it.
    pub seen_by: u32,
}

/// `Light::kind`: a triangle of an emissive surface.
pub const LIGHT_TRIANGLE: u32 = 0;
/// `Light::kind`: a small sphere (light entities).
pub const LIGHT_SPHERE: u32 = 1;
/// `Light::kind`: a sun of a given angular radius, seen through sky surfaces.
pub const LIGHT_SUN: u32 = 2;
/// `Light::kind`: the compiler's sky dome (`q3map_skylight`) seen through a triangle of a sky surface.
pub const LIGHT_DOME: u32 = 3;

/// `Light::flags`: a triangle that emits on both sides.
pub const LIGHT_TWO_SIDED: u32 = 1;
/// `Light::flags`: a sphere with linear fall-off (see `p2`).
pub const LIGHT_LINEAR: u32 = 2;
/// `Light::flags`: a sphere limited to a cone (see `p1`, `p2`).
pub const LIGHT_SPOT: u32 = 4;
/// `Light::flags`: no cosine at the receiver (light entities with the respective spawn flag).
pub const LIGHT_NO_COSINE: u32 = 8;
/// A dome of the same radiance in all directions, below the horizon too.
pub const LIGHT_EVEN: u32 = 16;

/// A light. Meaning of the vectors by kind:
///
/// | kind | `p0` | `p1` | `p2` | `radiance` |
/// |---|---|---|---|---|
/// | triangle | first vertex | edge to the second | edge to the third | as `Material::emission` |
/// | sphere | centre | unit axis of the spot | (cone radius at distance 1, fade, photons/255) | radiance of the sphere's surface |
/// | sun | unit direction to the sun | (azimuth, elevation, angular radius) in radians | 0 | irradiance/π at normal incidence |
/// | dome | first vertex | edge to the second | edge to the third | V/255 × colour |
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Light {
    pub kind: u32,
    pub flags: u32,
    /// Global triangle, or [`NONE`].
    pub triangle: u32,
    pub material: u32,
    pub p0: [f32; 3],
    /// Area in square units (triangle, dome), radius in units (sphere), else 0.
    pub size: f32,
    pub p1: [f32; 3],
    /// Instance that carries the light, or [`NONE`]. The scene has it in world space where it is at the start, the GPU in the
    /// instance's space.
    pub instance: u32,
    pub p2: [f32; 3],
    pub padding: u32,
    pub radiance: [f32; 3],
    /// What the material's emission is multiplied by; triangles only.
    pub scale: f32,
}

impl Light {
    /// The light after a rigid motion of what carries it.
    pub fn moved(mut self, by: Affine3A) -> Self {
        let turned = |v: [f32; 3]| by.transform_vector3(v.into()).into();
        self.p0 = by.transform_point3(self.p0.into()).into();
        if self.kind == LIGHT_TRIANGLE {
            (self.p1, self.p2) = (turned(self.p1), turned(self.p2));
        }
        self
    }
}

/// Inner node of the map's BSP for receiver classification.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct BspNode {
    pub normal: [f32; 3],
    pub dist: f32,
    /// ≥ 0: node; < 0: −1 − cluster − 1 of a leaf, so that −1 is solid and −2 is cluster 0.
    pub children: [i32; 2],
}

/// A row of light runs: lights visible from one cluster.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct LightRow {
    pub first_run: u32,
    pub run_count: u32,
    /// Lights in all runs of the row.
    pub light_count: u32,
    /// Weight of all lights of the row.
    pub weight: u32,
}

/// A run of consecutive lights in a row.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct LightRun {
    pub first_light: u32,
    pub count: u32,
    /// Lights in the row's earlier runs.
    pub before: u32,
    /// Weight of the lights in the row's earlier runs.
    pub weight_before: u32,
}

/// A node of the tree over lights; its left child stands right behind it.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct LightNode {
    /// Middle of the box around the node's lights.
    pub centre: [f32; 3],
    /// Cosine of the half angle of the cone that holds the normals of its emitters; −1 where some light emits in all
    /// directions.
    pub cos_cone: f32,
    /// Half the box's size.
    pub half_size: [f32; 3],
    /// Where all emitters face one way: the least coordinate along the cone's axis of any of them, at or below which no
    /// receiver gets light from the node; else −∞.
    pub front: f32,
    /// Axis of the cone.
    pub axis: [f32; 3],
    /// Its lights.
    pub first: u32,
    pub count: u32,
    /// The right child; 0 in a leaf, which holds one light.
    pub right: u32,
}

/// Irradiance/π by unexplained light at a point, luxel units: see [`super::ambient`].
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct AmbientCube {
    /// For normals along +x, −x, +y, −y, +z, −z.
    pub axes: [[f32; 3]; 6],
    /// 1 where the point is in the open, 0 in solid.
    pub open: f32,
}

/// A slot of the hash table of light cells: receivers of one light row, in one cube of space, that face one way.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub struct LightCell {
    /// Light row of the receivers.
    pub row: u32,
    /// Cube and facing.
    pub place: u32,
    /// Its entries; a slot without any is empty.
    pub first: u32,
    pub count: u32,
}

/// One choice of a light cell: a light, or a range of lights by power.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct CellEntry {
    pub first_light: u32,
    pub light_count: u32,
    /// Probability of the entry; of one of its lights, that times its share of `weight`.
    pub probability: f32,
    /// Weight of all its lights by power.
    pub weight: u32,
}

/// Size of a texture in pixels, and its number of mip levels.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct TextureInfo {
    pub width: u32,
    pub height: u32,
    pub levels: u32,
}
