//! The 17 lumps of an IBSP version 46 file as plain records.
//!
//! Every record is the exact little-endian layout of the file, so that a typed lump can be written back byte for byte.
//! Positions are Quake units, z up.

use bytemuck::{Pod, Zeroable};

/// Magic number and version of the one BSP flavour read and written here.
pub const MAGIC: [u8; 4] = *b"IBSP";
/// Quake III's BSP version.
pub const VERSION: i32 = 46;
/// Number of lumps in the directory.
pub const LUMP_COUNT: usize = 17;
/// Edge length of a lightmap page in luxels.
pub const LIGHTMAP_SIZE: usize = 128;
/// Bytes of one lightmap page (RGB).
pub const LIGHTMAP_BYTES: usize = LIGHTMAP_SIZE * LIGHTMAP_SIZE * 3;

/// Directory index of each lump.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[repr(usize)]
pub enum Lump {
    Entities,
    Shaders,
    Planes,
    Nodes,
    Leafs,
    LeafSurfaces,
    LeafBrushes,
    Models,
    Brushes,
    BrushSides,
    Vertices,
    Indices,
    Fogs,
    Surfaces,
    Lightmaps,
    LightGrid,
    Visibility,
}

impl Lump {
    /// All lumps in directory order.
    pub const ALL: [Lump; LUMP_COUNT] = [
        Lump::Entities,
        Lump::Shaders,
        Lump::Planes,
        Lump::Nodes,
        Lump::Leafs,
        Lump::LeafSurfaces,
        Lump::LeafBrushes,
        Lump::Models,
        Lump::Brushes,
        Lump::BrushSides,
        Lump::Vertices,
        Lump::Indices,
        Lump::Fogs,
        Lump::Surfaces,
        Lump::Lightmaps,
        Lump::LightGrid,
        Lump::Visibility,
    ];

    /// Name used in messages.
    pub fn name(self) -> &'static str {
        match self {
            Lump::Entities => "entities",
            Lump::Shaders => "shaders",
            Lump::Planes => "planes",
            Lump::Nodes => "nodes",
            Lump::Leafs => "leafs",
            Lump::LeafSurfaces => "leaf surfaces",
            Lump::LeafBrushes => "leaf brushes",
            Lump::Models => "models",
            Lump::Brushes => "brushes",
            Lump::BrushSides => "brush sides",
            Lump::Vertices => "vertices",
            Lump::Indices => "indices",
            Lump::Fogs => "fogs",
            Lump::Surfaces => "surfaces",
            Lump::Lightmaps => "lightmaps",
            Lump::LightGrid => "light grid",
            Lump::Visibility => "visibility",
        }
    }
}

/// Zero-padded 64-byte name.
#[derive(Clone, Copy, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub struct Name(pub [u8; 64]);

impl Name {
    /// The text up to the first zero byte; invalid UTF-8 is replaced.
    pub fn text(&self) -> std::borrow::Cow<'_, str> {
        let end = self.0.iter().position(|&b| b == 0).unwrap_or(64);
        String::from_utf8_lossy(&self.0[..end])
    }

    /// A name from text; at most 63 bytes are kept.
    pub fn new(text: &str) -> Self {
        let mut bytes = [0; 64];
        let n = text.len().min(63);
        bytes[..n].copy_from_slice(&text.as_bytes()[..n]);
        Self(bytes)
    }
}

impl std::fmt::Debug for Name {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{:?}", self.text())
    }
}

/// A shader (material) name with the flags that the compiler gave it.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Shader {
    pub name: Name,
    pub surface_flags: i32,
    pub content_flags: i32,
}

/// Plane n·x = dist. Stored in pairs: `i ^ 1` is the same plane turned over.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Plane {
    pub normal: [f32; 3],
    pub dist: f32,
}

/// Inner node. A child ≥ 0 is a node, a child < 0 is leaf −1−child. Child 0 lies in front of the plane.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Node {
    pub plane: i32,
    pub children: [i32; 2],
    pub mins: [i32; 3],
    pub maxs: [i32; 3],
}

/// Convex leaf of the BSP tree. `cluster` < 0: solid.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Leaf {
    pub cluster: i32,
    pub area: i32,
    pub mins: [i32; 3],
    pub maxs: [i32; 3],
    pub first_leaf_surface: i32,
    pub leaf_surface_count: i32,
    pub first_leaf_brush: i32,
    pub leaf_brush_count: i32,
}

/// Brush model; model 0 is the world.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Model {
    pub mins: [f32; 3],
    pub maxs: [f32; 3],
    pub first_surface: i32,
    pub surface_count: i32,
    pub first_brush: i32,
    pub brush_count: i32,
}

/// Convex solid: a run of brush sides. The first six sides are axial: −x +x −y +y −z +z.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Brush {
    pub first_side: i32,
    pub side_count: i32,
    pub shader: i32,
}

/// One half-space of a brush (outward plane).
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct BrushSide {
    pub plane: i32,
    pub shader: i32,
}

/// Vertex of a drawn surface. `uv` texture coordinates, `lightmap_uv` in 0..1 of the page, `color` encoded light RGBA.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Vertex {
    pub position: [f32; 3],
    pub uv: [f32; 2],
    pub lightmap_uv: [f32; 2],
    pub normal: [f32; 3],
    pub color: [u8; 4],
}

/// Fog volume.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Fog {
    pub shader: Name,
    pub brush: i32,
    pub visible_side: i32,
}

/// `Surface::kind`: planar polygon with indices.
pub const SURFACE_PLANAR: i32 = 1;
/// `Surface::kind`: grid of quadratic Bézier patches.
pub const SURFACE_PATCH: i32 = 2;
/// `Surface::kind`: triangle soup (a baked model).
pub const SURFACE_TRIANGLES: i32 = 3;
/// `Surface::kind`: lens flare.
pub const SURFACE_FLARE: i32 = 4;

/// A drawn surface.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Surface {
    pub shader: i32,
    /// Fog volume or −1.
    pub fog: i32,
    pub kind: i32,
    pub first_vertex: i32,
    pub vertex_count: i32,
    pub first_index: i32,
    pub index_count: i32,
    /// Lightmap page; negative: none (−3: lit at the vertices).
    pub lightmap: i32,
    pub lightmap_x: i32,
    pub lightmap_y: i32,
    pub lightmap_width: i32,
    pub lightmap_height: i32,
    pub lightmap_origin: [f32; 3],
    /// Luxel axes s and t and the normal (planar surfaces); a patch's LOD bounds otherwise.
    pub lightmap_vectors: [[f32; 3]; 3],
    pub patch_width: i32,
    pub patch_height: i32,
}

/// Light-grid sample; encodings in the design's physics notes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub struct GridPoint {
    pub ambient: [u8; 3],
    pub directed: [u8; 3],
    /// Polar byte, then azimuth byte.
    pub direction: [u8; 2],
}

/// `Shader::surface_flags` bits.
pub mod surface_flags {
    pub const NODAMAGE: i32 = 0x1;
    pub const SLICK: i32 = 0x2;
    pub const SKY: i32 = 0x4;
    pub const LADDER: i32 = 0x8;
    pub const NOIMPACT: i32 = 0x10;
    pub const NOMARKS: i32 = 0x20;
    pub const FLESH: i32 = 0x40;
    pub const NODRAW: i32 = 0x80;
    pub const HINT: i32 = 0x100;
    pub const SKIP: i32 = 0x200;
    pub const NOLIGHTMAP: i32 = 0x400;
    pub const POINTLIGHT: i32 = 0x800;
    pub const METALSTEPS: i32 = 0x1000;
    pub const NOSTEPS: i32 = 0x2000;
    pub const NONSOLID: i32 = 0x4000;
    pub const LIGHTFILTER: i32 = 0x8000;
    pub const ALPHASHADOW: i32 = 0x10000;
    pub const NODLIGHT: i32 = 0x20000;
    pub const DUST: i32 = 0x40000;
}

/// `Shader::content_flags` bits.
pub mod content_flags {
    pub const SOLID: i32 = 1;
    pub const LAVA: i32 = 8;
    pub const SLIME: i32 = 16;
    pub const WATER: i32 = 32;
    pub const FOG: i32 = 64;
    pub const AREAPORTAL: i32 = 0x8000;
    pub const PLAYERCLIP: i32 = 0x10000;
    pub const MONSTERCLIP: i32 = 0x20000;
    pub const TELEPORTER: i32 = 0x40000;
    pub const JUMPPAD: i32 = 0x80000;
    pub const CLUSTERPORTAL: i32 = 0x100000;
    pub const DONOTENTER: i32 = 0x200000;
    pub const BODY: i32 = 0x2000000;
    pub const CORPSE: i32 = 0x4000000;
    pub const DETAIL: i32 = 0x8000000;
    pub const STRUCTURAL: i32 = 0x10000000;
    pub const TRANSLUCENT: i32 = 0x20000000;
    pub const TRIGGER: i32 = 0x40000000;
    pub const NODROP: i32 = i32::MIN;
}
