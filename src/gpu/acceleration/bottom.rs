//! Bottom levels: trees over the triangles of one object.

use std::sync::Arc;
use std::time::Instant;

use ash::vk;

use super::build::{Build, Prepared, TriangleGeometry, record_builds};
use super::memory::{Scratch, Storage, lay_out};
use crate::gpu::error::Context;
use crate::gpu::{Access, Barrier, Commands, Device, GpuError, ResourceId};

/// Builds share scratch memory up to this many bytes; a larger single build gets what it needs.
const SCRATCH_BUDGET: u64 = 64 << 20;

/// What the tree is to be good at.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum BuildPreference {
    /// Fast to trace.
    #[default]
    FastTrace,
    /// Fast to build.
    FastBuild,
}

/// What a bottom level is made from.
#[derive(Clone, Copy, Debug)]
pub struct BottomDesc<'a> {
    /// Name for debuggers and messages.
    pub name: &'a str,
    /// Its geometries, numbered from 0 in this order.
    pub geometries: &'a [TriangleGeometry],
    /// What it is to be good at.
    pub preference: BuildPreference,
    /// It will be refitted to moved vertices.
    pub allow_update: bool,
    /// Copy it to memory of just the size needed. It can then be refitted but not rebuilt in place.
    pub compact: bool,
}

/// What a batch of builds took.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct BuildStatistics {
    /// Number of structures.
    pub structures: usize,
    /// Number of triangles.
    pub triangles: u64,
    /// Bytes as built.
    pub bytes_built: u64,
    /// Bytes after compaction.
    pub bytes_final: u64,
    /// Milliseconds from the first submission to the end of the last, waiting included.
    pub milliseconds: f64,
}

/// A bottom level, destroyed on drop. Must outlive the GPU's use of top levels that refer to it.
pub struct BottomLevel {
    storage: Storage,
    id: ResourceId,
    flags: vk::BuildAccelerationStructureFlagsKHR,
    triangle_counts: Vec<u32>,
    build_size: u64,
    build_scratch: u64,
    update_scratch: u64,
}

/// New geometry for a bottom level, for [`BottomLevel::record_refits`].
#[derive(Clone, Copy)]
pub struct Refit<'a> {
    /// The bottom level.
    pub bottom: &'a BottomLevel,
    /// As many geometries of as many triangles as it was built from.
    pub geometries: &'a [TriangleGeometry],
    /// Build the tree anew instead of moving its boxes.
    pub rebuild: bool,
}

impl BottomLevel {
    /// Builds bottom levels, several at a time, and waits for them.
    ///
    /// # Errors
    /// [`GpuError::MissingFeature`] without ray query, [`GpuError::InvalidInput`] for triangles without vertices, out of
    /// memory, device loss.
    pub fn build(
        device: &Arc<Device>,
        descriptions: &[BottomDesc<'_>],
    ) -> Result<(Vec<Self>, BuildStatistics), GpuError> {
        let start = Instant::now();
        let mut statistics = BuildStatistics {
            structures: descriptions.len(),
            ..Default::default()
        };
        let mut levels = Vec::with_capacity(descriptions.len());
        let mut prepared = Vec::with_capacity(descriptions.len());
        for description in descriptions {
            let build = Prepared::new(description.geometries, build_flags(description))?;
            let level = Self::unbuilt(device, description, &build)?;
            statistics.bytes_built += level.storage.size();
            statistics.triangles += level.triangle_counts.iter().map(|&count| u64::from(count)).sum::<u64>();
            levels.push(level);
            prepared.push(build);
        }
        let alignment = device.limits().scratch_alignment;
        let groups = group_by_budget(
            levels.iter().map(|level| level.build_scratch),
            alignment,
            SCRATCH_BUDGET,
        );
        let scratch_size = groups.iter().map(|(_, size)| *size).max().unwrap_or(0);
        let scratch = Scratch::new(device, scratch_size)?;
        for (group, _) in groups {
            Self::build_group(device, &mut levels[group.clone()], &prepared[group.clone()], &scratch)?;
            Self::compact_group(device, &mut levels[group.clone()], &descriptions[group])?;
        }
        statistics.bytes_final = levels.iter().map(|level| level.storage.size()).sum();
        statistics.milliseconds = start.elapsed().as_secs_f64() * 1e3;
        Ok((levels, statistics))
    }

    fn unbuilt(device: &Arc<Device>, description: &BottomDesc<'_>, build: &Prepared) -> Result<Self, GpuError> {
        let sizes = build.sizes(device)?;
        let size = sizes.acceleration_structure_size;
        let storage = Storage::new(
            device,
            description.name,
            vk::AccelerationStructureTypeKHR::BOTTOM_LEVEL,
            size,
        )?;
        Ok(Self {
            storage,
            id: device.new_resource_id(),
            flags: build.flags,
            triangle_counts: build.ranges.iter().map(|range| range.primitive_count).collect(),
            build_size: size,
            build_scratch: sizes.build_scratch_size,
            update_scratch: sizes.update_scratch_size,
        })
    }

    fn build_group(
        device: &Arc<Device>,
        levels: &mut [Self],
        prepared: &[Prepared],
        scratch: &Scratch,
    ) -> Result<(), GpuError> {
        let builds: Vec<_> = levels
            .iter()
            .zip(prepared)
            .map(|(level, prepared)| level.command(prepared, false))
            .collect();
        device.submit_once("the build of acceleration structures", |cmd| {
            record_builds(cmd, &builds, scratch)
        })
    }

    /// Replaces those that want it by copies of just the size needed.
    fn compact_group(
        device: &Arc<Device>,
        levels: &mut [Self],
        descriptions: &[BottomDesc<'_>],
    ) -> Result<(), GpuError> {
        let chosen: Vec<usize> = (0..levels.len()).filter(|&index| descriptions[index].compact).collect();
        if chosen.is_empty() {
            return Ok(());
        }
        let structures: Vec<_> = chosen.iter().map(|&index| levels[index].storage.raw()).collect();
        let sizes = compacted_sizes(device, &structures)?;
        let mut copies = Vec::with_capacity(chosen.len());
        for (&index, size) in chosen.iter().zip(sizes) {
            let name = descriptions[index].name;
            copies.push(Storage::new(
                device,
                name,
                vk::AccelerationStructureTypeKHR::BOTTOM_LEVEL,
                size,
            )?);
        }
        let functions = device.acceleration()?;
        device.submit_once("the compaction of acceleration structures", |cmd| {
            for (&source, target) in structures.iter().zip(&copies) {
                let info = vk::CopyAccelerationStructureInfoKHR::default()
                    .src(source)
                    .dst(target.raw())
                    .mode(vk::CopyAccelerationStructureModeKHR::COMPACT);
                // SAFETY: the target has the size that the driver named for this copy.
                unsafe { functions.cmd_copy_acceleration_structure(cmd.raw(), &info) };
            }
            Ok(())
        })?;
        for (index, copy) in chosen.into_iter().zip(copies) {
            levels[index].storage = copy;
        }
        Ok(())
    }

    /// Bytes of scratch memory that [`Self::record_refits`] needs for these refits together.
    pub fn refit_scratch_bytes(device: &Device, refits: &[Refit<'_>]) -> u64 {
        lay_out(
            refits.iter().map(Refit::scratch_bytes),
            device.limits().scratch_alignment,
        )
        .1
    }

    /// Records refits (or rebuilds in place) of bottom levels. The caller declares [`Access::BuildInput`] of the vertex
    /// buffers and [`Access::BuildWrite`] of the levels and of `scratch`.
    ///
    /// # Errors
    /// [`GpuError::InvalidInput`] if a level was not made to be updated, its geometry has changed in number, it was
    /// compacted and is to be rebuilt, or the scratch memory is too small.
    pub fn record_refits(cmd: &Commands<'_>, refits: &[Refit<'_>], scratch: &Scratch) -> Result<(), GpuError> {
        let mut prepared = Vec::with_capacity(refits.len());
        for refit in refits {
            refit.check()?;
            prepared.push(Prepared::new(refit.geometries, refit.bottom.flags)?);
        }
        let builds: Vec<_> = refits
            .iter()
            .zip(&prepared)
            .map(|(refit, build)| refit.bottom.command(build, !refit.rebuild))
            .collect();
        record_builds(cmd, &builds, scratch)
    }

    fn command<'a>(&self, prepared: &'a Prepared, update: bool) -> Build<'a> {
        let scratch = if update {
            self.update_scratch
        } else {
            self.build_scratch
        };
        Build {
            target: self.storage.raw(),
            prepared,
            scratch,
            update,
        }
    }

    /// The address by which instances refer to it.
    pub fn address(&self) -> vk::DeviceAddress {
        self.storage.address()
    }

    /// Bytes of GPU memory.
    pub fn size(&self) -> u64 {
        self.storage.size()
    }

    /// Identity for hazard tracking.
    pub fn id(&self) -> ResourceId {
        self.id
    }
}

impl Refit<'_> {
    fn scratch_bytes(&self) -> u64 {
        if self.rebuild {
            self.bottom.build_scratch
        } else {
            self.bottom.update_scratch
        }
    }

    fn check(&self) -> Result<(), GpuError> {
        let same_counts = self.geometries.iter().map(|g| g.triangle_count).eq(self
            .bottom
            .triangle_counts
            .iter()
            .copied());
        let problem = if !same_counts {
            "a refit with other numbers of triangles than the build's"
        } else if !self.rebuild
            && !self
                .bottom
                .flags
                .contains(vk::BuildAccelerationStructureFlagsKHR::ALLOW_UPDATE)
        {
            "a refit of an acceleration structure that was not made for it"
        } else if self.rebuild && self.bottom.storage.size() < self.bottom.build_size {
            "a rebuild in place of a compacted acceleration structure"
        } else {
            return Ok(());
        };
        Err(GpuError::InvalidInput(problem.into()))
    }
}

/// A pool of queries, destroyed on drop.
struct SizeQueries<'d> {
    device: &'d Device,
    raw: vk::QueryPool,
}

impl Drop for SizeQueries<'_> {
    fn drop(&mut self) {
        // SAFETY: used only by a submission that was waited for.
        unsafe { self.device.raw().destroy_query_pool(self.raw, None) };
    }
}

fn compacted_sizes(device: &Arc<Device>, structures: &[vk::AccelerationStructureKHR]) -> Result<Vec<u64>, GpuError> {
    let what = "the query of compacted sizes";
    let ty = vk::QueryType::ACCELERATION_STRUCTURE_COMPACTED_SIZE_KHR;
    let info = vk::QueryPoolCreateInfo::default()
        .query_type(ty)
        .query_count(structures.len() as u32);
    // SAFETY: `info` is complete.
    let raw = unsafe { device.raw().create_query_pool(&info, None) }.context(what)?;
    let queries = SizeQueries { device, raw };
    let functions = device.acceleration()?;
    device.submit_once(what, |cmd| {
        cmd.barrier(&Barrier::between(Access::BuildWrite, Access::BuildRead));
        // SAFETY: there is one query per structure, and all structures are built.
        unsafe {
            device
                .raw()
                .cmd_reset_query_pool(cmd.raw(), queries.raw, 0, structures.len() as u32);
            functions.cmd_write_acceleration_structures_properties(cmd.raw(), structures, ty, queries.raw, 0);
        }
        Ok(())
    })?;
    let mut sizes = vec![0u64; structures.len()];
    let flags = vk::QueryResultFlags::TYPE_64 | vk::QueryResultFlags::WAIT;
    // SAFETY: there is one element per query; the queries' commands have run.
    unsafe { device.raw().get_query_pool_results(queries.raw, 0, &mut sizes, flags) }.context(what)?;
    Ok(sizes)
}

fn build_flags(description: &BottomDesc<'_>) -> vk::BuildAccelerationStructureFlagsKHR {
    use vk::BuildAccelerationStructureFlagsKHR as F;
    let mut flags = match description.preference {
        BuildPreference::FastTrace => F::PREFER_FAST_TRACE,
        BuildPreference::FastBuild => F::PREFER_FAST_BUILD,
    };
    if description.allow_update {
        flags |= F::ALLOW_UPDATE;
    }
    if description.compact {
        flags |= F::ALLOW_COMPACTION;
    }
    flags
}

/// Cuts a list of scratch sizes into runs that fit `budget` together; a single larger one is a run by itself.
/// Returns each run with the bytes it needs.
fn group_by_budget(
    sizes: impl Iterator<Item = u64>,
    alignment: u64,
    budget: u64,
) -> Vec<(std::ops::Range<usize>, u64)> {
    let mut groups: Vec<(std::ops::Range<usize>, u64)> = Vec::new();
    for (index, size) in sizes.enumerate() {
        match groups.last_mut() {
            Some((range, total)) if total.next_multiple_of(alignment.max(1)) + size <= budget => {
                *total = total.next_multiple_of(alignment.max(1)) + size;
                range.end = index + 1;
            }
            _ => groups.push((index..index + 1, size)),
        }
    }
    groups
}

#[cfg(test)]
mod tests {
    use super::group_by_budget;

    #[test]
    fn groups_fit_the_budget_unless_single() {
        let groups = group_by_budget([60, 30, 200, 10].into_iter(), 16, 100);
        assert_eq!(groups, vec![(0..2, 94), (2..3, 200), (3..4, 10)]);
        assert!(group_by_budget([].into_iter(), 16, 100).is_empty());
    }
}
