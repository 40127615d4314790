//! The thin Vulkan layer: everything that talks to `ash`, and nothing that knows about Quake, windows or files.
//!
//! Objects own an [`std::sync::Arc`] of what they were made from ([`Device`] owns its [`Instance`]), so dropping them in
//! any order is sound. An object must not be dropped while the GPU still uses it: hand it to [`Frame::retire`] instead.
//!
//! Recording goes through [`Commands`], hazards through [`Tracker`], frames in flight through [`FrameRing`].

pub mod acceleration;
mod adopt;
mod barrier;
mod buffer;
mod command;
mod descriptor;
mod descriptor_sets;
mod device;
mod error;
mod format;
mod frame_ring;
mod image;
mod instance;
mod pipeline;
mod pipeline_cache;
mod report;
mod sampler;
mod select;
#[cfg(feature = "compile-shaders")]
pub mod shader_compiler;
pub mod shader_table;
mod surface;
mod swapchain;
mod timestamps;
mod tracker;
mod upload;
mod validation;

pub use adopt::AdoptedHandles;
pub use barrier::{Access, Barrier, ResourceId};
pub use buffer::{Buffer, MemoryKind};
pub use command::Commands;
pub use descriptor::{Binding, BindingKind, DescriptorLayout};
pub use descriptor_sets::{DescriptorSets, SampledTexture, Write};
pub use device::{Device, DeviceInfo, Limits};
pub use error::GpuError;
pub use frame_ring::{Frame, FrameRing, FrameTimings, SubmitSync};
pub use image::{Image, ImageDesc};
pub use instance::{Instance, InstanceOptions};
pub use pipeline::{ComputePipeline, ComputePipelineDesc, spirv_words};
pub use pipeline_cache::PipelineCache;
pub use report::{DeviceReport, OptionalFeatures};
pub use sampler::{Sampler, SamplerDesc};
pub use select::{DeviceChoice, DeviceRequest, RayQueryUse};
pub use surface::Surface;
pub use swapchain::{Acquired, PresentMode, Swapchain};
pub use timestamps::{ScopeId, ScopeTime, Timestamps};
pub use tracker::{Tracker, Use};
pub use upload::UploadBatch;
pub use validation::{ValidationLog, ValidationMessage, ValidationMode};
