//! Sizes of the image formats that we use.

use ash::vk;

use super::GpuError;

/// Bytes per texel of an uncompressed format.
pub(super) fn texel_size(format: vk::Format) -> Result<u64, GpuError> {
    use vk::Format as F;
    Ok(match format {
        F::R8_UNORM | F::R8_UINT | F::R8_SNORM => 1,
        F::R8G8_UNORM | F::R8G8_SNORM | F::R16_SFLOAT | F::R16_UNORM | F::R16_UINT => 2,
        F::R8G8B8A8_UNORM
        | F::R8G8B8A8_SRGB
        | F::R8G8B8A8_UINT
        | F::R8G8B8A8_SNORM
        | F::B8G8R8A8_UNORM
        | F::B8G8R8A8_SRGB
        | F::A8B8G8R8_UNORM_PACK32
        | F::A2B10G10R10_UNORM_PACK32
        | F::A2R10G10B10_UNORM_PACK32
        | F::B10G11R11_UFLOAT_PACK32
        | F::E5B9G9R9_UFLOAT_PACK32
        | F::R16G16_SFLOAT
        | F::R16G16_UNORM
        | F::R16G16_SNORM
        | F::R16G16_UINT
        | F::R32_SFLOAT
        | F::R32_UINT
        | F::R32_SINT => 4,
        F::R16G16B16A16_SFLOAT
        | F::R16G16B16A16_UNORM
        | F::R16G16B16A16_SNORM
        | F::R16G16B16A16_UINT
        | F::R32G32_SFLOAT
        | F::R32G32_UINT => 8,
        F::R32G32B32A32_SFLOAT | F::R32G32B32A32_UINT => 16,
        other => {
            return Err(GpuError::InvalidInput(format!(
                "the image format {other:?} is not in our table"
            )));
        }
    })
}
