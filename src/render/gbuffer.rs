//! The images of a view; `shaders/include/gbuffer.glsl` says what each holds.

use crate::gpu::{Binding, BindingKind, DescriptorLayout, DescriptorSets, Device, GpuError, Image, ImageDesc, Write};
use ash::vk;
use std::sync::Arc;

/// Name and format of every image, in the order of their bindings in set 1.
const IMAGES: [(&str, vk::Format); 23] = [
    ("albedo", vk::Format::R32G32B32A32_SFLOAT),
    ("position", vk::Format::R32G32B32A32_SFLOAT),
    ("surface", vk::Format::R32G32B32A32_UINT),
    ("object", vk::Format::R32G32B32A32_UINT),
    ("view", vk::Format::R32G32B32A32_SFLOAT),
    ("motion", vk::Format::R32G32B32A32_SFLOAT),
    ("emission", vk::Format::R32G32B32A32_SFLOAT),
    ("direct", vk::Format::R32G32B32A32_SFLOAT),
    ("composite", vk::Format::R32G32B32A32_SFLOAT),
    ("mean", vk::Format::R32G32B32A32_SFLOAT),
    ("compensation", vk::Format::R32G32B32A32_SFLOAT),
    ("mean direct", vk::Format::R32G32B32A32_SFLOAT),
    ("mean emission", vk::Format::R32G32B32A32_SFLOAT),
    ("display", vk::Format::R8G8B8A8_UNORM),
    ("filter a", vk::Format::R16G16B16A16_UINT),
    ("filter b", vk::Format::R16G16B16A16_UINT),
    ("gradient a", vk::Format::R32G32B32A32_SFLOAT),
    ("gradient b", vk::Format::R32G32B32A32_SFLOAT),
    ("share", vk::Format::R32G32B32A32_SFLOAT),
    ("layers", vk::Format::R32G32B32A32_SFLOAT),
    ("mean layers", vk::Format::R32G32B32A32_SFLOAT),
    ("secondary", vk::Format::R32G32B32A32_SFLOAT),
    ("taa mean", vk::Format::R32G32B32A32_SFLOAT),
];

/// Name and format of every image that the next frame reads too: this frame's and the one before's stand side by side in set
/// 1, after [`IMAGES`], and change places from frame to frame.
const HISTORIES: [(&str, vk::Format); 7] = [
    ("guide", vk::Format::R16G16B16A16_UINT),
    ("irradiance", vk::Format::R16G16B16A16_UINT),
    ("moments", vk::Format::R16G16B16A16_SFLOAT),
    ("taa", vk::Format::R16G16B16A16_SFLOAT),
    ("secondary guide", vk::Format::R16G16B16A16_UINT),
    ("secondary radiance", vk::Format::R16G16B16A16_UINT),
    ("secondary moments", vk::Format::R16G16B16A16_SFLOAT),
];

/// Pixels per edge of a stratum, which has one gradient.
pub const STRATUM: u32 = 3;

/// An image of this frame, and the same of the frame before.
pub struct History {
    images: [Image; 2],
}

impl History {
    /// The image that a frame of this parity writes.
    pub fn now(&self, parity: usize) -> &Image {
        &self.images[parity & 1]
    }

    /// The image that the frame before it wrote.
    pub fn before(&self, parity: usize) -> &Image {
        &self.images[(parity & 1) ^ 1]
    }
}

/// The images of one view at one size.
pub struct GBuffer {
    images: Vec<Image>,
    histories: Vec<History>,
    /// Which of two frames in turn this is: images of [`HISTORIES`] follow it.
    pub parity: usize,
    pub size: (u32, u32),
    pub layout: Arc<DescriptorLayout>,
    pub sets: DescriptorSets,
}

macro_rules! accessors {
    ($($name:ident = $index:literal),*; $($history:ident = $at:literal),*) => {
        impl GBuffer {
            $(#[doc = concat!("The image `", stringify!($name), "`.")]
            pub fn $name(&self) -> &Image {
                &self.images[$index]
            })*
            $(#[doc = concat!("The images `", stringify!($history), "`.")]
            pub fn $history(&self) -> &History {
                &self.histories[$at]
            })*
        }
    };
}

accessors!(
    albedo = 0,
    position = 1,
    surface = 2,
    object = 3,
    view = 4,
    motion = 5,
    emission = 6,
    direct = 7,
    composite = 8,
    mean = 9,
    compensation = 10,
    mean_direct = 11,
    mean_emission = 12,
    display = 13,
    filter_a = 14,
    filter_b = 15,
    gradient_a = 16,
    gradient_b = 17,
    share = 18,
    layers = 19,
    mean_layers = 20,
    secondary = 21,
    taa_mean = 22;
    guide = 0,
    irradiance = 1,
    moments = 2,
    taa = 3,
    secondary_guide = 4,
    secondary_radiance = 5,
    secondary_moments = 6
);

impl GBuffer {
    /// Descriptor layout of set 1, the same for all views.
    ///
    /// # Errors
    /// [`GpuError`] of the device.
    pub fn layout(device: &Arc<Device>) -> Result<Arc<DescriptorLayout>, GpuError> {
        let bindings: Vec<_> = (0..(IMAGES.len() + 2 * HISTORIES.len()) as u32)
            .map(|i| Binding::one(i, BindingKind::StorageImage))
            .collect();
        DescriptorLayout::new(device, "view", &bindings)
    }

    /// Makes the images.
    ///
    /// # Errors
    /// [`GpuError`], out of memory above all.
    pub fn new(device: &Arc<Device>, layout: &Arc<DescriptorLayout>, size: (u32, u32)) -> Result<Self, GpuError> {
        let image = |name: &str, format: vk::Format| {
            let strata = name.starts_with("gradient");
            let edge = |pixels: u32| if strata { pixels.div_ceil(STRATUM) } else { pixels };
            Image::new(
                device,
                &ImageDesc {
                    name,
                    format,
                    width: edge(size.0),
                    height: edge(size.1),
                    mips: 1,
                    usage: vk::ImageUsageFlags::STORAGE
                        | vk::ImageUsageFlags::TRANSFER_SRC
                        | vk::ImageUsageFlags::TRANSFER_DST,
                },
            )
        };
        let images = IMAGES
            .iter()
            .map(|(name, format)| image(name, *format))
            .collect::<Result<Vec<_>, _>>()?;
        let histories = HISTORIES
            .iter()
            .map(|(name, format)| {
                Ok(History {
                    images: [image(name, *format)?, image(name, *format)?],
                })
            })
            .collect::<Result<Vec<_>, GpuError>>()?;
        let sets = DescriptorSets::new(layout, 2, 0)?;
        for parity in 0..2 {
            let pairs = histories.iter().flat_map(|h| [h.now(parity), h.before(parity)]);
            let writes: Vec<_> = images
                .iter()
                .chain(pairs)
                .enumerate()
                .map(|(i, image)| Write::storage_image(i as u32, image))
                .collect();
            sets.write(parity, &writes)?;
        }
        Ok(Self {
            images,
            histories,
            parity: 0,
            size,
            layout: layout.clone(),
            sets,
        })
    }
}
