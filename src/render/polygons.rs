//! Polygons of a frame on the GPU: their trees are built here, and what has changed goes to the scene's buffers with the frame's own
//! commands. Frames whose polygons are those that are there already upload nothing.

use super::bvh_upload::{MeshTree, polygon_tree};
use super::scene_gpu::{RenderError, SceneGpu};
use crate::gpu::acceleration::{BottomLevel, Refit};
use crate::gpu::{Access, Buffer, Commands, MemoryKind, Tracker, Use};
use crate::scene::polygons::{Polygon, Room};
use crate::scene::static_geometry::Mesh;
use ash::vk;

/// Staging memory of a view's polygons, by frame in flight.
#[derive(Default)]
pub struct Polygons {
    staging: Vec<Option<Buffer>>,
    before: Vec<Polygon>,
    /// Number of changes so far.
    pub revision: u32,
}

/// A range of bytes on its way to a buffer of the scene.
struct Part<'a> {
    target: &'a Buffer,
    offset: u64,
    bytes: Vec<u8>,
}

fn part<'a, T: bytemuck::NoUninit>(target: &'a Buffer, first: u32, data: &[T]) -> Part<'a> {
    Part {
        target,
        offset: u64::from(first) * size_of::<T>() as u64,
        bytes: bytemuck::cast_slice(data).to_vec(),
    }
}

impl Polygons {
    /// Counts a change where a frame's polygons are not those of the frame before.
    pub fn note(&mut self, polygons: &[Polygon]) {
        if self.before != polygons {
            self.before = polygons.to_vec();
            self.revision = self.revision.wrapping_add(1);
        }
    }

    /// Records what brings the scene's buffers up to date, where they are not; returns the mesh of the polygons, `None` where the
    /// scene has no room for any.
    ///
    /// # Errors
    /// [`RenderError`] where the polygons do not fit, or of the device.
    pub fn record(
        &mut self,
        cmd: &Commands<'_>,
        tracker: &mut Tracker,
        scene: &SceneGpu,
        slot: usize,
        polygons: &[Polygon],
    ) -> Result<Option<Mesh>, RenderError> {
        let Some(room) = scene.polygons.room else {
            Room::NONE.shape(&scene.name, polygons, usize::MAX, 0)?;
            return Ok(None);
        };
        let shape = room.shape(&scene.name, polygons, scene.material_flags.len(), scene.all_row)?;
        let mut there = scene.polygons.there.lock().unwrap_or_else(|e| e.into_inner());
        if *there == polygons {
            return Ok(Some(shape.mesh));
        }
        let tree = polygon_tree(&shape, &scene.material_flags, &scene.name)?;
        let at = scene.polygons.tree;
        let record = MeshTree {
            bvh2_root: tree.root,
            ..at
        };
        let mut positions = shape.positions.clone();
        // The driver's structure always has all triangles: those that are not used have no area.
        if scene.driver.is_some() {
            positions.resize(3 * room.triangles as usize, [0.0; 3]);
        }
        let b = &scene.bvh;
        let parts = [
            part(&scene.positions, room.first_vertex, &positions),
            part(&scene.attributes, room.first_vertex, &shape.attributes),
            part(&scene.triangles, room.first_triangle, &shape.triangles),
            part(&b.mesh_trees, room.mesh, &[record]),
            part(&b.cwbvh_nodes, at.cwbvh_node, &tree.cwbvh_nodes),
            part(&b.cwbvh_triangles, at.cwbvh_triangle, &tree.cwbvh_triangles),
            part(&b.bvh2_nodes, at.bvh2_node, &tree.bvh2_nodes),
            part(&b.bvh2_triangles, at.bvh2_triangle, &tree.bvh2_triangles),
        ];
        let staging = self.staged(scene, slot, &parts)?;
        // Frames before this one may still read what is written now.
        let read: Vec<_> = parts
            .iter()
            .map(|p| Use::buffer(p.target, Access::ComputeRead))
            .collect();
        tracker.pass(cmd, &read)?;
        let uses: Vec<_> = (parts.iter())
            .map(|p| Use::buffer(p.target, Access::TransferWrite))
            .chain([Use::buffer(staging, Access::TransferRead)])
            .collect();
        tracker.pass(cmd, &uses)?;
        let mut from = 0;
        for p in &parts {
            cmd.copy_buffer(staging, from, p.target, p.offset, p.bytes.len() as u64)?;
            from += p.bytes.len() as u64;
        }
        if let Some((driver, refit)) = scene.driver.as_ref().and_then(|d| Some((d, d.polygons.as_ref()?)))
            && let Some(level) = driver.bottom(room.mesh)
        {
            tracker.pass(cmd, &[Use::resource(level.id(), Access::Trace)])?;
            let uses = [
                Use::buffer(&scene.positions, Access::BuildInput),
                Use::resource(level.id(), Access::BuildWrite),
            ];
            tracker.pass(cmd, &uses)?;
            let one = Refit {
                bottom: level,
                geometries: &refit.geometries,
                rebuild: true,
            };
            BottomLevel::record_refits(cmd, &[one], &refit.scratch)?;
            tracker.pass(cmd, &[Use::resource(level.id(), Access::BuildRead)])?;
        }
        let read: Vec<_> = parts
            .iter()
            .map(|p| Use::buffer(p.target, Access::ComputeRead))
            .collect();
        tracker.pass(cmd, &read)?;
        *there = polygons.to_vec();
        Ok(Some(shape.mesh))
    }

    fn staged(&mut self, scene: &SceneGpu, slot: usize, parts: &[Part<'_>]) -> Result<&Buffer, RenderError> {
        if self.staging.len() <= slot {
            self.staging.resize_with(slot + 1, || None);
        }
        let bytes: Vec<u8> = parts.iter().flat_map(|p| p.bytes.iter().copied()).collect();
        let mut buffer = match self.staging[slot].take() {
            Some(made) if made.size() >= bytes.len() as u64 => made,
            _ => Buffer::new(
                &scene.device,
                "polygons",
                (bytes.len() as u64).next_power_of_two(),
                vk::BufferUsageFlags::empty(),
                MemoryKind::Upload,
            )?,
        };
        buffer.write(0, &bytes)?;
        Ok(self.staging[slot].insert(buffer))
    }
}
