// The scene and the frame as buffers behind addresses. Mirrors src/scene/records.rs and src/render/frame_constants.rs;
// a test compares member offsets.
#ifndef SCENE_GLSL
#define SCENE_GLSL

const uint NONE = 0xffffffffu;

struct VertexAttributes {
    vec3 normal;
    vec2 uv;
    vec2 lightmap_uv;
    uint color;
};

struct Triangle {
    uint vertices[3];
    uint material;
    uint surface;
    uint fallback_row;
};

const uint MATERIAL_ALPHA_TESTED = 1;
const uint MATERIAL_SKY = 2;
const uint MATERIAL_TWO_SIDED_EMISSION = 4;
const uint MATERIAL_CLAMP = 8;
const uint MATERIAL_SKY_BOX = 16;
const uint MATERIAL_STAGES = 32;
const uint MATERIAL_LAYER = 64;
const uint MATERIAL_FILTER = 128;
const uint MATERIAL_BACK = 256;
const uint MATERIAL_NO_FRONT = 512;
const uint MATERIAL_MOVING_EMISSION = 1024;
const uint MATERIAL_PORTAL = 2048;
const uint MATERIAL_DIELECTRIC = 4096;
const uint MATERIAL_PANE = 8192;
const uint MATERIAL_GLOSSY = 16384;

struct Material {
    uint texture_index;
    uint flags;
    float alpha_scale;
    float alpha_offset;
    vec3 emission;
    vec3 shown;
    uint emission_texture;
    uint sky[6];
    uint first_stage;
    uint stage_count;
    uint alpha_stage;
    vec3 sky_scale;
    float cloud_height;
    uint first_deform;
    uint deform_count;
    float ior;
    float lobe;
};

const uint WAVE_SINE = 0;
const uint WAVE_TRIANGLE = 1;
const uint WAVE_SQUARE = 2;
const uint WAVE_SAWTOOTH = 3;
const uint WAVE_INVERSE_SAWTOOTH = 4;
const uint WAVE_NOISE = 5;

struct Wave {
    uint function;
    float base;
    float amplitude;
    float phase;
    uint rate;
};

const uint DEFORM_WAVE = 0;
const uint DEFORM_NORMAL = 1;
const uint DEFORM_BULGE = 2;
const uint DEFORM_MOVE = 3;
const uint DEFORM_AUTOSPRITE = 4;

struct Deform {
    uint kind;
    uint rate;
    float a;
    float b;
    vec3 direction;
    Wave wave;
};

struct RestVertex {
    vec3 position;
    vec3 normal;
    uint quad;
    uint material;
    uint instance;
};

struct Portal {
    uint surface;
    uint mirror;
    vec4 there[3];
    vec4 back[3];
};

struct Fog {
    vec3 colour;
    float density;
    uint first_plane;
    uint plane_count;
};

struct DynamicTriangle {
    uint triangle;
    uint cwbvh;
    uint bvh2;
};

const uint TC_SCROLL = 1;
const uint TC_TURBULENCE = 2;
const uint TC_STRETCH = 3;
const uint TC_ROTATE = 4;

struct TcMod {
    uint kind;
    uint rates[2];
    vec4 matrix;
    vec2 offset;
    Wave wave;
};

const uint STAGE_LIT = 1;
const uint STAGE_CLAMP = 2;
const uint STAGE_EMISSION = 4;
const uint STAGE_WHITE = 8;
const uint STAGE_GLOSSY = 16;
const uint SOURCE_WAVE = 1;
const uint SOURCE_VERTEX = 2;
const uint SOURCE_ONE_MINUS_VERTEX = 3;
const uint SOURCE_SPECULAR = 4;
const uint SOURCE_PORTAL = 5;
const uint TC_LIGHTMAP = 1;
const uint TC_ENVIRONMENT = 2;
const uint TC_VECTOR = 3;
const uint BLEND_ZERO = 0;
const uint BLEND_ONE = 1;
const uint BLEND_SRC_COLOR = 2;
const uint BLEND_ONE_MINUS_SRC_COLOR = 3;
const uint BLEND_DST_COLOR = 4;
const uint BLEND_ONE_MINUS_DST_COLOR = 5;
const uint BLEND_SRC_ALPHA = 6;
const uint BLEND_ONE_MINUS_SRC_ALPHA = 7;

struct Stage {
    uint textures[8];
    uint frames;
    uint frame_rate;
    uint flags;
    uint source;
    uint destination;
    uint rgb_source;
    uint alpha_source;
    uint tc_gen;
    vec3 rgb;
    float alpha;
    Wave rgb_wave;
    Wave alpha_wave;
    vec3 tc_vectors[2];
    uint first_mod;
    uint mod_count;
};

const uint SEEN_BY_EYE = 1;
const uint SEEN_BY_REFLECTIONS = 2;
const uint SEEN_BY_SHADOWS = 4;

struct Instance {
    vec4 object_to_world[3];
    vec4 world_to_object[3];
    vec4 old_object_to_world[3];
    uint first_triangle;
    uint mesh;
    uint identity;
    uint moves;
    uint seen_by;
};

const uint LIGHT_TRIANGLE = 0;
const uint LIGHT_SPHERE = 1;
const uint LIGHT_SUN = 2;
const uint LIGHT_DOME = 3;
const uint LIGHT_TWO_SIDED = 1;
const uint LIGHT_LINEAR = 2;
const uint LIGHT_SPOT = 4;
const uint LIGHT_NO_COSINE = 8;
const uint LIGHT_EVEN = 16;

struct Light {
    uint kind;
    uint flags;
    uint triangle;
    uint material;
    vec3 p0;
    float size;
    vec3 p1;
    uint instance;
    vec3 p2;
    uint padding;
    vec3 radiance;
    float scale;
};

struct BspNode {
    vec3 normal;
    float dist;
    int children[2];
};

struct LightRow {
    uint first_run;
    uint run_count;
    uint light_count;
    uint weight;
};

struct LightRun {
    uint first_light;
    uint count;
    uint before;
    uint weight_before;
};

struct LightNode {
    vec3 centre;
    float cos_cone;
    vec3 half_size;
    float front;
    vec3 axis;
    uint first;
    uint count;
    uint right;
};

struct AmbientCube {
    vec3 axes[6];
    float open;
};

struct LightCell {
    uint row;
    uint place;
    uint first;
    uint count;
};

struct CellEntry {
    uint first_light;
    uint light_count;
    float probability;
    uint weight;
};

// A light sample kept for a pixel, with the receiver it was made for: see reservoir.glsl. The normals are packed.
struct Reservoir {
    vec3 position;
    uint shading_normal;
    uint geometric_normal;
    uint row;
    // NONE for no sample.
    uint light;
    // Estimate of the inverse of the sample's pdf in the measure of its random numbers, lights counted; 0 where the sample
    // is out of view.
    float weight;
    vec2 point;
    // Number of candidates behind it; 0 where the pixel shows no surface.
    float count;
    // Luminance of what the sample gives to the receiver.
    float target;
};

// What a pixel of a stratum was shaded with in the frame before, enough to shade it again. The normals are packed.
struct Stratum {
    vec3 position;
    uint shading_normal;
    uint geometric_normal;
    // Light row of the receiver; NONE where the pixel showed nothing that reflects.
    uint row;
    // What it lies on.
    uint instance;
    // Address and index of its random numbers.
    uint address;
    uint sample_index;
    // The sample that it kept where samples are reused, its weight, else NONE.
    uint light;
    vec2 point;
    float weight;
    // Luminance of what it got.
    float luminance;
};

// Size of a texture: queries of the texture itself cost more, and some drivers answer them wrongly for an index that
// differs between threads.
struct TextureInfo {
    uint width;
    uint height;
    uint levels;
};

// Where a mesh's trees begin.
struct MeshTree {
    uint cwbvh_node;
    uint cwbvh_triangle;
    uint bvh2_node;
    uint bvh2_triangle;
    uint bvh2_root;
    uint first_triangle;
    uint opaque_count;
    uint padding;
};

layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer Positions { vec3 at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer Attributes { VertexAttributes at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer Triangles { Triangle at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer Materials { Material at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer Deforms { Deform at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer RestVertices { RestVertex at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer DynamicTriangles { DynamicTriangle at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer Portals { Portal at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer Fogs { Fog at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer FogPlanes { vec4 at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer Stages { Stage at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer TcMods { TcMod at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer Instances { Instance at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer Lights { Light at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer BspNodes { BspNode at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer LightRows { LightRow at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer LightRuns { LightRun at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer LightNodes { LightNode at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer LightWeights { uint at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer AmbientCubes { AmbientCube at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer LightCells { LightCell at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer CellEntries { CellEntry at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer TextureInfos { TextureInfo at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer MeshTrees { MeshTree at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 16) readonly buffer Words4 { uvec4 at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 16) readonly buffer Floats4 { vec4 at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) buffer Reservoirs { Reservoir at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) buffer Strata { Stratum at[]; };
// Pixels of which something branches off: arguments of the dispatch over them, their number, and x + y·65536 of each.
layout(buffer_reference, scalar, buffer_reference_align = 4) buffer SecondaryPixels { uint groups[3]; uint count; uint at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) buffer Counters { uint at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) buffer Floats { float at[]; };

// Everything that stays the same for one frame.
struct FrameConstants {
    Positions positions;
    Attributes attributes;
    Triangles triangles;
    Materials materials;
    Stages stages;
    TcMods tc_mods;
    Deforms deforms;
    RestVertices rest_vertices;
    Fogs fogs;
    FogPlanes fog_planes;
    Portals portals;
    DynamicTriangles dynamic_triangles;
    Instances instances;
    Lights lights;
    Lights guest_lights;
    BspNodes bsp_nodes;
    LightRows light_rows;
    LightRuns light_runs;
    LightNodes light_nodes;
    LightWeights light_weights;
    LightCells light_cells;
    CellEntries cell_entries;
    LightWeights cell_bounds;
    AmbientCubes ambient_cubes;
    TextureInfos textures;
    MeshTrees mesh_trees;
    Words4 cwbvh_nodes;
    Floats4 cwbvh_triangles;
    Floats4 bvh2_nodes;
    Floats4 bvh2_triangles;
    Floats4 instance_nodes;
    Reservoirs reservoirs;
    Reservoirs reservoir_history;
    Strata strata;
    Counters counters;
    SecondaryPixels secondary_pixels;
    LightWeights triangle_lights;
    Floats exposure;
    Floats focus;
    Floats srgb;
    vec3 eye;
    float half_width;
    vec3 forward;
    float half_height;
    vec3 right;
    float aperture;
    vec3 up;
    float cone;
    vec3 old_eye;
    float old_half_width;
    vec3 old_forward;
    float old_half_height;
    vec3 old_right;
    uint reuse_history;
    vec3 old_up;
    uint reuse_neighbours;
    vec3 ambient_origin;
    uint ambient;
    vec3 ambient_step;
    uint ambient_width;
    vec3 ambient_constant;
    uint ambient_height;
    uvec2 size;
    uint seed;
    uint sequence;
    uint instance_count;
    uint instance_root;
    uint all_row;
    uint cull_lights;
    uint random_lights;
    uint light_sampling;
    uint light_candidates;
    uint least_candidates;
    uint old_least_candidates;
    uint finite_lights;
    uint soft_shadows;
    uint antialiasing;
    uint illumination;
    uint tonemap;
    uint view;
    float fixed_exposure;
    float exposure_blend;
    uint cell_mask;
    uint ambient_depth;
    vec2 jitter;
    vec2 old_jitter;
    uint denoised;
    uint taa;
    uint history;
    uint still;
    float least_alpha;
    float taa_gamma;
    float fireflies;
    uint reservoirs_used;
    uint changed;
    uint filter_levels;
    uint clock;
    uint choose_layers;
    uint light_filters;
    uint shown_emission;
    uint moving;
    uint old_clock;
    uint first_dynamic_vertex;
    uint dynamic_triangles_count;
    uint fog_count;
    uint portal_count;
    uint max_depth;
    uint secondary;
    uint glossy;
    uint branches_off;
    float branch_share;
    uint guest_count;
    uint draw_sun;
    uint secondary_levels;
    uint white;
    uint solo_light;
    uint light_term;
};

layout(buffer_reference, scalar, buffer_reference_align = 8) readonly buffer Frame { FrameConstants constants; };

// What changes between the passes of a frame.
layout(push_constant, scalar) uniform Push {
    Frame frame;
    uint sample_index;
    // Samples in the accumulation, this one included; 0 where nothing is accumulated.
    uint accumulated;
    // Number of the filter level, from 0.
    uint level;
    uint padding;
};

#define FC frame.constants

#endif
