//! Which traversal a device uses.

use std::fmt;

/// Traversal on a Vulkan device.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Backend {
    /// The driver's acceleration structures by VK_KHR_ray_query.
    RayQuery,
    /// Own traversal in compute shaders.
    Bvh,
}

impl Backend {
    /// Name as in `rt_backend`; also the suffix of the shaders' compiled forms.
    pub fn name(self) -> &'static str {
        match self {
            Self::RayQuery => "rayquery",
            Self::Bvh => "bvh",
        }
    }
}

impl fmt::Display for Backend {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}
