//! How long named stretches of a command buffer take on the GPU.

use std::borrow::Cow;
use std::sync::{Arc, Mutex, PoisonError};

use ash::vk;

use super::error::Context;
use super::{Commands, Device, GpuError};

/// How long a scope took.
#[derive(Clone, Debug, PartialEq)]
pub struct ScopeTime {
    /// The scope's name.
    pub name: Cow<'static, str>,
    /// Milliseconds on the GPU.
    pub milliseconds: f64,
}

/// A scope that was begun; give it to [`Timestamps::end`].
#[derive(Debug)]
#[must_use = "a scope that is not ended is never reported"]
pub struct ScopeId(Option<u32>);

/// The timed scopes of one frame. On a queue without timestamps everything works and nothing is measured.
pub struct Timestamps {
    device: Arc<Device>,
    pool: Option<vk::QueryPool>,
    capacity: u32,
    /// Name of each scope and whether it was ended.
    scopes: Mutex<Vec<(Cow<'static, str>, bool)>>,
}

impl Timestamps {
    /// Makes room for `capacity` scopes; more are not measured.
    ///
    /// # Errors
    /// Out of memory.
    pub fn new(device: &Arc<Device>, capacity: u32) -> Result<Self, GpuError> {
        let supported = device.limits().timestamp_valid_bits > 0 && capacity > 0;
        let pool = if supported {
            let info = vk::QueryPoolCreateInfo::default()
                .query_type(vk::QueryType::TIMESTAMP)
                .query_count(capacity.saturating_mul(2));
            // SAFETY: `info` is complete.
            let pool = unsafe { device.raw().create_query_pool(&info, None) }
                .context("the creation of the timestamp queries")?;
            Some(pool)
        } else {
            None
        };
        Ok(Self {
            device: device.clone(),
            pool,
            capacity,
            scopes: Mutex::default(),
        })
    }

    /// Forgets all scopes; must be recorded before the first scope of each use.
    pub fn reset(&self, cmd: &Commands<'_>) {
        self.lock().clear();
        if let Some(pool) = self.pool {
            // SAFETY: the range is the whole pool; the command buffer is outside of a render pass.
            unsafe {
                self.device
                    .raw()
                    .cmd_reset_query_pool(cmd.raw(), pool, 0, self.capacity * 2)
            };
        }
    }

    /// Times what `record` records, and labels it for debuggers.
    pub fn scope<R>(
        &self,
        cmd: &Commands<'_>,
        name: impl Into<Cow<'static, str>>,
        record: impl FnOnce(&Commands<'_>) -> R,
    ) -> R {
        let scope = self.begin(cmd, name);
        let result = record(cmd);
        self.end(cmd, scope);
        result
    }

    /// Begins a scope. Scopes may nest.
    pub fn begin(&self, cmd: &Commands<'_>, name: impl Into<Cow<'static, str>>) -> ScopeId {
        let name = name.into();
        cmd.begin_label(&name);
        let Some(pool) = self.pool else { return ScopeId(None) };
        let mut scopes = self.lock();
        let index = scopes.len() as u32;
        if index >= self.capacity {
            return ScopeId(None);
        }
        scopes.push((name, false));
        // SAFETY: the query lies in the pool and was reset.
        unsafe {
            self.device
                .raw()
                .cmd_write_timestamp(cmd.raw(), vk::PipelineStageFlags::BOTTOM_OF_PIPE, pool, index * 2);
        }
        ScopeId(Some(index))
    }

    /// Ends a scope.
    pub fn end(&self, cmd: &Commands<'_>, scope: ScopeId) {
        cmd.end_label();
        let (Some(pool), Some(index)) = (self.pool, scope.0) else {
            return;
        };
        if let Some((_, ended)) = self.lock().get_mut(index as usize) {
            *ended = true;
            let query = index * 2 + 1;
            // SAFETY: as in `begin`.
            unsafe {
                self.device
                    .raw()
                    .cmd_write_timestamp(cmd.raw(), vk::PipelineStageFlags::BOTTOM_OF_PIPE, pool, query);
            }
        }
    }

    /// The milliseconds of each scope in order of beginning, without waiting: call it when the commands are known to
    /// have run. `None` if the queue has no timestamps; scopes without a result are left out.
    ///
    /// # Errors
    /// Device loss.
    pub fn read(&self) -> Result<Option<Vec<ScopeTime>>, GpuError> {
        let Some(pool) = self.pool else { return Ok(None) };
        let scopes = self.lock();
        if scopes.is_empty() {
            return Ok(Some(Vec::new()));
        }
        // Two queries per scope, each a value followed by whether it is there.
        let mut results = vec![[[0u64; 2]; 2]; scopes.len()];
        let flags = vk::QueryResultFlags::TYPE_64 | vk::QueryResultFlags::WITH_AVAILABILITY;
        // ash takes one element per query.
        let queries = results.as_flattened_mut();
        // SAFETY: the queries lie in the pool; each element takes a value and its availability.
        match unsafe { self.device.raw().get_query_pool_results(pool, 0, queries, flags) } {
            Ok(()) | Err(vk::Result::NOT_READY) => {}
            Err(result) => return Err(GpuError::from_vulkan("the reading of timestamps", result)),
        }
        let limits = self.device.limits();
        let times = scopes
            .iter()
            .zip(&results)
            .filter(|((_, ended), [begin, end])| *ended && begin[1] != 0 && end[1] != 0)
            .map(|((name, _), [begin, end])| {
                let ticks = elapsed_ticks(begin[0], end[0], limits.timestamp_valid_bits);
                let milliseconds = ticks as f64 * f64::from(limits.timestamp_period_ns) * 1e-6;
                ScopeTime {
                    name: name.clone(),
                    milliseconds,
                }
            })
            .collect();
        Ok(Some(times))
    }

    fn lock(&self) -> std::sync::MutexGuard<'_, Vec<(Cow<'static, str>, bool)>> {
        self.scopes.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Drop for Timestamps {
    fn drop(&mut self) {
        if let Some(pool) = self.pool {
            // SAFETY: the owner drops this only when the GPU is done with it.
            unsafe { self.device.raw().destroy_query_pool(pool, None) };
        }
    }
}

/// Ticks between two timestamps of which only the low `valid_bits` count and which may have wrapped around.
fn elapsed_ticks(begin: u64, end: u64, valid_bits: u32) -> u64 {
    let mask = if valid_bits >= 64 {
        u64::MAX
    } else {
        (1 << valid_bits) - 1
    };
    end.wrapping_sub(begin) & mask
}

#[cfg(test)]
mod tests {
    use super::elapsed_ticks;

    #[test]
    fn timestamps_wrap_at_their_valid_bits() {
        assert_eq!(elapsed_ticks(100, 250, 64), 150);
        assert_eq!(elapsed_ticks(0xf_fff0, 0x10, 20), 0x20);
        assert_eq!(
            elapsed_ticks(0xab0_0005, 0xcd0_0009, 20),
            4,
            "bits above the valid ones are garbage"
        );
    }
}
