//! Instances that move with the scene's clock: their records, the tree over them and the top level, made anew for each frame
//! of a view. A few hundred bytes an instance; nothing where nothing moves.

use super::bvh_upload::instance_tree;
use super::frame_constants::FrameConstants;
use super::scene_gpu::SceneGpu;
use crate::gpu::acceleration::{TopInstance, TopLevel};
use crate::gpu::{Access, Buffer, Commands, DescriptorSets, GpuError, MemoryKind, Tracker, Use, Write};
use crate::scene::entity_geometry::{EntityState, apply};
use crate::scene::motion::Moment;
use crate::scene::records::Instance;
use crate::scene::static_geometry::Mesh;
use ash::vk;
use std::borrow::Cow;

/// A view's own instances.
pub struct Moving {
    /// By frame in flight.
    instances: Vec<Buffer>,
    nodes: Vec<Buffer>,
    top: Option<(TopLevel, DescriptorSets)>,
    /// What the frame's top level is made of.
    placed: Vec<TopInstance>,
    before: Option<Moment>,
    states: Vec<EntityState>,
}

impl Moving {
    /// Makes room for a scene's instances.
    ///
    /// # Errors
    /// [`GpuError`], out of memory above all.
    pub fn new(scene: &SceneGpu, frames_in_flight: usize) -> Result<Self, GpuError> {
        let count = scene.placements.len().max(1);
        let buffers = |name: &str, bytes: usize| {
            (0..frames_in_flight)
                .map(|_| {
                    let usage = vk::BufferUsageFlags::STORAGE_BUFFER;
                    Buffer::new(&scene.device, name, bytes as u64, usage, MemoryKind::Upload)
                })
                .collect::<Result<Vec<_>, _>>()
        };
        let top = match &scene.driver {
            Some(_) => {
                let top = TopLevel::new(&scene.device, "moving top level", count as u32, frames_in_flight)?;
                let sets = scene.texture_sets()?;
                sets.write(0, &[Write::acceleration_structure(0, &top)])?;
                Some((top, sets))
            }
            None => None,
        };
        Ok(Self {
            instances: buffers("moving instances", count * size_of::<Instance>())?,
            nodes: buffers("moving instance nodes", count * size_of::<[f32; 16]>())?,
            top,
            placed: Vec::new(),
            before: None,
            states: Vec::new(),
        })
    }

    /// Writes a frame's instances and tells its constants. `polygons`: their mesh; `states`: of entities that are not
    /// as the map has them.
    ///
    /// # Errors
    /// [`GpuError`] of the device.
    pub fn advance(
        &mut self,
        scene: &SceneGpu,
        slot: usize,
        now: Moment,
        polygons: Option<Mesh>,
        states: &[EntityState],
        constants: FrameConstants,
    ) -> Result<FrameConstants, GpuError> {
        let before = self.before.replace(now).unwrap_or(now);
        let mut meshes = Cow::Borrowed(&scene.meshes);
        if let (Some(mesh), Some(room)) = (polygons, scene.polygons.room) {
            meshes.to_mut()[room.mesh as usize] = mesh;
        }
        let mut records: Vec<Instance> = scene
            .placements
            .iter()
            .map(|p| p.record(&meshes, &now, &before))
            .collect();
        apply([states, &self.states], &scene.placements, &mut records);
        let changed = self.states != states;
        if changed {
            self.states = states.to_vec();
        }
        let tree = instance_tree(&meshes, &records, &scene.name).map_err(|e| GpuError::InvalidInput(e.to_string()))?;
        let count = if tree.is_some() {
            records.len()
        } else {
            records.len().min(1)
        } as u32;
        let tree = tree.unwrap_or_default();
        self.instances[slot].write(0, &records)?;
        if !tree.nodes.is_empty() {
            self.nodes[slot].write(0, &tree.nodes)?;
        }
        if let Some(driver) = &scene.driver {
            self.placed = driver.placed(&records);
        }
        Ok(FrameConstants {
            instances: self.instances[slot].address(),
            instance_nodes: self.nodes[slot].address(),
            instance_count: count,
            instance_root: tree.root,
            moving: u32::from(
                changed || before.clock != now.clock || (scene.has_player && before.camera != now.camera),
            ),
            ..constants
        })
    }

    /// Records the build of the frame's top level, where there is one.
    ///
    /// # Errors
    /// [`GpuError`] of the device.
    pub fn build_top(&mut self, cmd: &Commands<'_>, tracker: &mut Tracker, slot: usize) -> Result<(), GpuError> {
        let Some((top, _)) = &mut self.top else { return Ok(()) };
        tracker.pass(cmd, &[Use::resource(top.id(), Access::BuildWrite)])?;
        top.record_build(cmd, &self.placed, slot)?;
        tracker.pass(cmd, &[Use::resource(top.id(), Access::Trace)])
    }

    /// Set 0 of the frame, where the driver's structures are of this view.
    pub fn sets(&self) -> Option<&DescriptorSets> {
        self.top.as_ref().map(|(_, sets)| sets)
    }
}
