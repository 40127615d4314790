//! A whole IBSP v46 file: typed lumps read with bounds checks, and written back byte for byte.

use super::lumps::{
    Brush, BrushSide, Fog, GridPoint, LIGHTMAP_BYTES, LUMP_COUNT, Leaf, Lump, MAGIC, Model, Node, Plane, Shader,
    Surface, VERSION, Vertex,
};
use super::visibility::Visibility;
use bytemuck::Pod;
use thiserror::Error;

/// Why bytes are not a usable BSP.
#[derive(Debug, Error, PartialEq)]
pub enum BspError {
    #[error("not a Quake III map: the file starts with {found:?} instead of \"IBSP\"")]
    Magic { found: Vec<u8> },
    #[error("BSP version {found} is not supported (only Quake III's version 46 is)")]
    Version { found: i32 },
    #[error("truncated: {what} needs bytes {start}..{end} but the file has {len}")]
    Truncated {
        what: &'static str,
        start: u64,
        end: u64,
        len: u64,
    },
    #[error("damaged {lump} lump: {bytes} bytes is no multiple of the record size {record}")]
    RecordSize {
        lump: &'static str,
        bytes: usize,
        record: usize,
    },
    #[error("damaged {lump} lump: record {index} refers to {target} {value}, of which there are {count}")]
    Reference {
        lump: &'static str,
        index: usize,
        target: &'static str,
        value: i64,
        count: usize,
    },
    #[error("damaged visibility lump: {clusters} clusters of {row_bytes} bytes do not fit in {bytes} bytes")]
    Visibility {
        clusters: i32,
        row_bytes: i32,
        bytes: usize,
    },
    #[error("damaged {lump} lump: record {index} {problem}")]
    Record {
        lump: &'static str,
        index: usize,
        problem: &'static str,
    },
}

/// A map file as typed lumps. Fields are in lump order.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Bsp {
    /// Entity text exactly as stored, trailing zero included.
    pub entities: Vec<u8>,
    pub shaders: Vec<Shader>,
    pub planes: Vec<Plane>,
    pub nodes: Vec<Node>,
    pub leafs: Vec<Leaf>,
    pub leaf_surfaces: Vec<i32>,
    pub leaf_brushes: Vec<i32>,
    pub models: Vec<Model>,
    pub brushes: Vec<Brush>,
    pub brush_sides: Vec<BrushSide>,
    pub vertices: Vec<Vertex>,
    /// Triangle indices relative to each surface's `first_vertex`.
    pub indices: Vec<i32>,
    pub fogs: Vec<Fog>,
    pub surfaces: Vec<Surface>,
    /// Whole pages of [`LIGHTMAP_BYTES`] bytes.
    pub lightmaps: Vec<u8>,
    pub light_grid: Vec<GridPoint>,
    /// `None` where the map was never vised: everything sees everything.
    pub visibility: Option<Visibility>,
}

fn records<T: Pod>(lump: Lump, bytes: &[u8]) -> Result<Vec<T>, BspError> {
    let record = size_of::<T>();
    if !bytes.len().is_multiple_of(record) {
        return Err(BspError::RecordSize {
            lump: lump.name(),
            bytes: bytes.len(),
            record,
        });
    }
    Ok(bytes.chunks_exact(record).map(bytemuck::pod_read_unaligned).collect())
}

impl Bsp {
    /// Reads a file. Every index that later code follows is checked here, so that the rest may rely on it.
    ///
    /// # Errors
    /// [`BspError`] naming the lump and record at fault.
    pub fn read(data: &[u8]) -> Result<Self, BspError> {
        let header = 8 + LUMP_COUNT * 8;
        let found = data.get(..4).unwrap_or(data);
        if found != MAGIC {
            return Err(BspError::Magic { found: found.to_vec() });
        }
        if data.len() < header {
            return Err(BspError::Truncated {
                what: "the header",
                start: 0,
                end: header as u64,
                len: data.len() as u64,
            });
        }
        let int = |at: usize| bytemuck::pod_read_unaligned::<i32>(&data[at..at + 4]);
        let version = int(4);
        if version != VERSION {
            return Err(BspError::Version { found: version });
        }
        let lump = |lump: Lump| -> Result<&[u8], BspError> {
            let at = 8 + lump as usize * 8;
            // A negative offset or length is as wrong as one past the end: as u32 both are caught by one test.
            let (start, len) = (u64::from(int(at) as u32), u64::from(int(at + 4) as u32));
            let end = start + len;
            if end > data.len() as u64 {
                return Err(BspError::Truncated {
                    what: lump.name(),
                    start,
                    end,
                    len: data.len() as u64,
                });
            }
            Ok(&data[start as usize..end as usize])
        };
        macro_rules! typed {
            ($lump:ident) => {
                records(Lump::$lump, lump(Lump::$lump)?)?
            };
        }
        let lightmaps = lump(Lump::Lightmaps)?;
        if !lightmaps.len().is_multiple_of(LIGHTMAP_BYTES) {
            return Err(BspError::RecordSize {
                lump: Lump::Lightmaps.name(),
                bytes: lightmaps.len(),
                record: LIGHTMAP_BYTES,
            });
        }
        let bsp = Self {
            entities: lump(Lump::Entities)?.to_vec(),
            shaders: typed!(Shaders),
            planes: typed!(Planes),
            nodes: typed!(Nodes),
            leafs: typed!(Leafs),
            leaf_surfaces: typed!(LeafSurfaces),
            leaf_brushes: typed!(LeafBrushes),
            models: typed!(Models),
            brushes: typed!(Brushes),
            brush_sides: typed!(BrushSides),
            vertices: typed!(Vertices),
            indices: typed!(Indices),
            fogs: typed!(Fogs),
            surfaces: typed!(Surfaces),
            lightmaps: lightmaps.to_vec(),
            light_grid: typed!(LightGrid),
            visibility: Visibility::read(lump(Lump::Visibility)?)?,
        };
        super::check::check(&bsp)?;
        Ok(bsp)
    }

    /// The bytes of one lump, as they stand in the file.
    pub fn lump_bytes(&self, lump: Lump) -> Vec<u8> {
        fn bytes<T: Pod>(records: &[T]) -> Vec<u8> {
            bytemuck::cast_slice(records).to_vec()
        }
        match lump {
            Lump::Entities => self.entities.clone(),
            Lump::Shaders => bytes(&self.shaders),
            Lump::Planes => bytes(&self.planes),
            Lump::Nodes => bytes(&self.nodes),
            Lump::Leafs => bytes(&self.leafs),
            Lump::LeafSurfaces => bytes(&self.leaf_surfaces),
            Lump::LeafBrushes => bytes(&self.leaf_brushes),
            Lump::Models => bytes(&self.models),
            Lump::Brushes => bytes(&self.brushes),
            Lump::BrushSides => bytes(&self.brush_sides),
            Lump::Vertices => bytes(&self.vertices),
            Lump::Indices => bytes(&self.indices),
            Lump::Fogs => bytes(&self.fogs),
            Lump::Surfaces => bytes(&self.surfaces),
            Lump::Lightmaps => self.lightmaps.clone(),
            Lump::LightGrid => bytes(&self.light_grid),
            Lump::Visibility => self.visibility.as_ref().map(Visibility::bytes).unwrap_or_default(),
        }
    }

    /// The whole file: header, then the lumps in directory order, each at a multiple of four bytes.
    pub fn write(&self) -> Vec<u8> {
        let mut out = vec![0; 8 + LUMP_COUNT * 8];
        out[..4].copy_from_slice(&MAGIC);
        out[4..8].copy_from_slice(&VERSION.to_le_bytes());
        for lump in Lump::ALL {
            let bytes = self.lump_bytes(lump);
            let at = 8 + lump as usize * 8;
            let start = out.len() as i32;
            out[at..at + 4].copy_from_slice(&start.to_le_bytes());
            out[at + 4..at + 8].copy_from_slice(&(bytes.len() as i32).to_le_bytes());
            out.extend_from_slice(&bytes);
            out.resize(out.len().next_multiple_of(4), 0);
        }
        out
    }
}
