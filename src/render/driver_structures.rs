//! The driver's acceleration structures over a scene, where ray queries trace.

use crate::gpu::acceleration::{
    BottomDesc, BottomLevel, BuildPreference, BuildStatistics, Refit, Scratch, TopInstance, TopLevel, TriangleGeometry,
};
use crate::gpu::{Buffer, Device, GpuError};
use crate::scene::Scene;
use crate::scene::records::Instance;
use std::sync::Arc;

/// Structures of the driver's traversal.
pub struct DriverStructures {
    /// What the bottom levels were built from; refits read it.
    _index_buffer: Option<Buffer>,
    /// One of each mesh that has triangles.
    bottom: Vec<Option<BottomLevel>>,
    pub top: TopLevel,
    pub statistics: BuildStatistics,
    /// Of the dynamic meshes.
    pub refits: Vec<DynamicRefit>,
    /// Of the mesh of polygons.
    pub polygons: Option<DynamicRefit>,
}

/// What refits the driver's structure over a dynamic mesh.
pub struct DynamicRefit {
    pub mesh: u32,
    pub geometries: Vec<TriangleGeometry>,
    pub scratch: Scratch,
}

impl DriverStructures {
    /// The bottom level of a mesh.
    pub fn bottom(&self, mesh: u32) -> Option<&BottomLevel> {
        self.bottom.get(mesh as usize)?.as_ref()
    }

    /// Keeps the buffer of indices as long as the structures.
    pub fn keeping(self, index_buffer: Buffer) -> Self {
        Self {
            _index_buffer: Some(index_buffer),
            ..self
        }
    }

    /// What a top level is built of: instances of meshes that have triangles.
    pub fn placed(&self, instances: &[Instance]) -> Vec<TopInstance> {
        placed(&self.bottom, instances)
    }
}

fn placed(bottom: &[Option<BottomLevel>], instances: &[Instance]) -> Vec<TopInstance> {
    instances
        .iter()
        .enumerate()
        .filter_map(|(index, instance)| {
            let level = bottom[instance.mesh as usize].as_ref()?;
            Some(TopInstance {
                transform: instance.object_to_world,
                mask: instance.seen_by as u8,
                ..TopInstance::new(level, index as u32)
            })
        })
        .collect()
}

/// Geometry 0 of every bottom level is opaque, geometry 1 alpha-tested; a mesh without triangles is not placed.
pub fn build(
    device: &Arc<Device>,
    scene: &Scene,
    instances: &[Instance],
    positions: &Buffer,
    indices: &Buffer,
) -> Result<DriverStructures, GpuError> {
    let g = &scene.geometry;
    let room = |mesh: usize| g.polygons.filter(|r| r.mesh as usize == mesh);
    let used: Vec<usize> = (0..g.meshes.len())
        .filter(|&m| g.meshes[m].triangle_count > 0 || room(m).is_some())
        .collect();
    let geometries: Vec<Vec<TriangleGeometry>> = used
        .iter()
        .map(|&m| {
            let mesh = &g.meshes[m];
            let part = |first: u32, count: u32, opaque: bool| TriangleGeometry {
                vertices: positions.address(),
                vertex_stride: 12,
                vertex_count: g.positions.len() as u32,
                indices: indices.address() + u64::from(mesh.first_triangle + first) * 12,
                triangle_count: count,
                opaque,
            };
            let count = room(m).map_or(mesh.triangle_count, |r| r.triangles);
            vec![
                part(0, mesh.opaque_count, true),
                part(mesh.opaque_count, count - mesh.opaque_count, false),
            ]
        })
        .collect();
    let descriptions: Vec<BottomDesc<'_>> = geometries
        .iter()
        .zip(&used)
        .map(|(geometries, &mesh)| {
            let moves = g.dynamic.part(mesh).is_some() || room(mesh).is_some();
            BottomDesc {
                name: "mesh",
                geometries,
                preference: BuildPreference::FastTrace,
                allow_update: moves,
                compact: !moves,
            }
        })
        .collect();
    let (bottom, statistics) = BottomLevel::build(device, &descriptions)?;
    let mut levels: Vec<Option<BottomLevel>> = (0..g.meshes.len()).map(|_| None).collect();
    let (mut refits, mut polygons) = (Vec::new(), None);
    for ((mesh, level), geometries) in used.into_iter().zip(bottom).zip(&geometries) {
        let rebuild = room(mesh).is_some();
        if rebuild || g.dynamic.part(mesh).is_some() {
            let one = Refit {
                bottom: &level,
                geometries,
                rebuild,
            };
            let made = DynamicRefit {
                mesh: mesh as u32,
                scratch: Scratch::new(device, BottomLevel::refit_scratch_bytes(device, &[one]))?,
                geometries: geometries.clone(),
            };
            if rebuild {
                polygons = Some(made);
            } else {
                refits.push(made);
            }
        }
        levels[mesh] = Some(level);
    }
    let placed = placed(&levels, instances);
    let mut top = TopLevel::new(device, "top level", placed.len().max(1) as u32, 1)?;
    device.submit_once("top level", |cmd| {
        top.record_build(cmd, &placed, 0)?;
        Ok(())
    })?;
    Ok(DriverStructures {
        _index_buffer: None,
        bottom: levels,
        top,
        statistics,
        refits,
        polygons,
    })
}
