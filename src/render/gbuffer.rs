//! The images of a view; `shaders/include/gbuffer.glsl` says what each holds.

use crate::gpu::{Binding, BindingKind, DescriptorLayout, DescriptorSets, Device, GpuError, Image, ImageDesc, Write};
use ash::vk;
use std::sync::Arc;

/// Name and format of every image, in the order of their bindings in set 1.
const IMAGES: [(&str, vk::Format); 14] = [
    ("albedo", vk::Format::R32G32B32A32_SFLOAT),
    ("position", vk::Format::R32G32B32A32_SFLOAT),
    ("surface", vk::Format::R32G32B32A32_UINT),
    ("object", vk::Format::R32G32B32A32_UINT),
    ("view", vk::Format::R32G32B32A32_SFLOAT),
    ("motion", vk::Format::R16G16B16A16_SFLOAT),
    ("emission", vk::Format::R32G32B32A32_SFLOAT),
    ("direct", vk::Format::R32G32B32A32_SFLOAT),
    ("composite", vk::Format::R32G32B32A32_SFLOAT),
    ("mean", vk::Format::R32G32B32A32_SFLOAT),
    ("compensation", vk::Format::R32G32B32A32_SFLOAT),
    ("mean direct", vk::Format::R32G32B32A32_SFLOAT),
    ("mean emission", vk::Format::R32G32B32A32_SFLOAT),
    ("display", vk::Format::R8G8B8A8_UNORM),
];

/// The images of one view at one size.
pub struct GBuffer {
    images: Vec<Image>,
    pub size: (u32, u32),
    pub layout: Arc<DescriptorLayout>,
    pub sets: DescriptorSets,
}

macro_rules! accessors {
    ($($name:ident = $index:literal),*) => {
        impl GBuffer {
            $(#[doc = concat!("The image `", stringify!($name), "`.")]
            pub fn $name(&self) -> &Image {
                &self.images[$index]
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
    display = 13
);

impl GBuffer {
    /// Descriptor layout of set 1, the same for all views.
    ///
    /// # Errors
    /// [`GpuError`] of the device.
    pub fn layout(device: &Arc<Device>) -> Result<Arc<DescriptorLayout>, GpuError> {
        let bindings: Vec<_> = (0..IMAGES.len() as u32)
            .map(|i| Binding::one(i, BindingKind::StorageImage))
            .collect();
        DescriptorLayout::new(device, "view", &bindings)
    }

    /// Makes the images.
    ///
    /// # Errors
    /// [`GpuError`], out of memory above all.
    pub fn new(device: &Arc<Device>, layout: &Arc<DescriptorLayout>, size: (u32, u32)) -> Result<Self, GpuError> {
        let images = IMAGES
            .iter()
            .map(|(name, format)| {
                Image::new(
                    device,
                    &ImageDesc {
                        name,
                        format: *format,
                        width: size.0,
                        height: size.1,
                        mips: 1,
                        usage: vk::ImageUsageFlags::STORAGE
                            | vk::ImageUsageFlags::TRANSFER_SRC
                            | vk::ImageUsageFlags::TRANSFER_DST,
                    },
                )
            })
            .collect::<Result<Vec<_>, _>>()?;
        let sets = DescriptorSets::new(layout, 1, 0)?;
        let writes: Vec<_> = images
            .iter()
            .enumerate()
            .map(|(i, image)| Write::storage_image(i as u32, image))
            .collect();
        sets.write(0, &writes)?;
        Ok(Self {
            images,
            size,
            layout: layout.clone(),
            sets,
        })
    }
}
