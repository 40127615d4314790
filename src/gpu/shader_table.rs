//! The table of all compute shaders, and how to get at their compiled form.
//!
//! Ordinary builds embed `shaders/spirv/NAME.spv`. With the feature `compile-shaders` nothing is embedded: shaders are
//! compiled from `shaders/` when asked for, so that a new entry can be built and an edited one reloaded.

use super::GpuError;

/// One compiled form of one source file.
#[derive(Clone, Copy, Debug)]
pub struct ShaderEntry {
    /// Name of the compiled form: `shaders/spirv/NAME.spv`.
    pub name: &'static str,
    /// The source file, relative to `shaders/`.
    pub source: &'static str,
    /// Macros defined for this form, with their values.
    pub defines: &'static [(&'static str, &'static str)],
}

macro_rules! shader_table {
    ($($name:literal: $source:literal [$($define:literal = $value:literal),*];)*) => {
        /// All compiled forms.
        pub const SHADERS: &[ShaderEntry] =
            &[$(ShaderEntry { name: $name, source: $source, defines: &[$(($define, $value)),*] }),*];

        #[cfg(not(feature = "compile-shaders"))]
        fn embedded(name: &str) -> Option<&'static [u8]> {
            match name {
                $($name => Some(include_bytes!(concat!(
                    env!("CARGO_MANIFEST_DIR"), "/shaders/spirv/", $name, ".spv"
                ))),)*
                _ => None,
            }
        }
    };
}

shader_table! {
    "deform": "deform.comp" [];
    "primary_bvh": "primary.comp" ["TRACE_BVH2" = "1"];
    "primary_rayquery": "primary.comp" ["TRACE_RAYQUERY" = "1"];
    "direct_bvh": "direct.comp" [];
    "direct_rayquery": "direct.comp" ["TRACE_RAYQUERY" = "1"];
    "secondary_bvh": "secondary.comp" [];
    "secondary_rayquery": "secondary.comp" ["TRACE_RAYQUERY" = "1"];
    "resample_bvh": "resample.comp" [];
    "resample_rayquery": "resample.comp" ["TRACE_RAYQUERY" = "1"];
    "reuse_bvh": "reuse.comp" [];
    "reuse_rayquery": "reuse.comp" ["TRACE_RAYQUERY" = "1"];
    "focus_bvh": "focus.comp" ["TRACE_BVH2" = "1"];
    "focus_rayquery": "focus.comp" ["TRACE_RAYQUERY" = "1"];
    "gradient_bvh": "gradient.comp" [];
    "gradient_rayquery": "gradient.comp" ["TRACE_RAYQUERY" = "1"];
    "gradient_atrous": "gradient_atrous.comp" [];
    "temporal": "temporal.comp" [];
    "secondary_temporal": "temporal.comp" ["SECONDARY" = "1"];
    "atrous": "atrous.comp" [];
    "secondary_atrous": "atrous.comp" ["SECONDARY" = "1"];
    "taa": "taa.comp" [];
    "composite": "composite.comp" [];
    "exposure": "exposure.comp" [];
    "tone_map": "tone_map.comp" [];
    "bench_generate_primary": "bench_generate.comp" ["RAYS_PRIMARY" = "1"];
    "bench_generate_shadow": "bench_generate.comp" ["RAYS_SHADOW" = "1"];
    "bench_generate_diffuse": "bench_generate.comp" ["RAYS_DIFFUSE" = "1"];
    "bench_rays_cwbvh_single": "bench_rays.comp" ["TRACE_SINGLE_LEVEL" = "1", "TRACE_OPAQUE" = "1"];
    "bench_rays_cwbvh_two": "bench_rays.comp" ["TRACE_OPAQUE" = "1"];
    "bench_rays_cwbvh_alpha": "bench_rays.comp" [];
    "bench_rays_bvh2_single": "bench_rays.comp" ["TRACE_BVH2" = "1", "TRACE_SINGLE_LEVEL" = "1", "TRACE_OPAQUE" = "1"];
    "bench_rays_bvh2_two": "bench_rays.comp" ["TRACE_BVH2" = "1", "TRACE_OPAQUE" = "1"];
    "bench_rays_bvh2_alpha": "bench_rays.comp" ["TRACE_BVH2" = "1"];
    "bench_rays_rayquery_two": "bench_rays.comp" ["TRACE_RAYQUERY" = "1", "TRACE_OPAQUE" = "1"];
    "bench_rays_rayquery_alpha": "bench_rays.comp" ["TRACE_RAYQUERY" = "1"];
    "test_fill": "test/fill.comp" [];
    "test_fill_squares": "test/fill.comp" ["SQUARES" = "1"];
    "test_image": "test/image.comp" [];
    "test_ray_query": "test/ray_query.comp" [];
}

/// The SPIR-V words of the shader `name`.
///
/// # Errors
/// [`GpuError::Shader`] if it is not in the table, or (with `compile-shaders`) does not compile.
#[cfg(not(feature = "compile-shaders"))]
pub fn load_spirv(name: &str) -> Result<Vec<u32>, GpuError> {
    let bytes = embedded(name).ok_or_else(|| not_in_table(name))?;
    super::spirv_words(name, bytes)
}

/// The SPIR-V words of the shader `name`, compiled now from its source.
///
/// # Errors
/// [`GpuError::Shader`] if it is not in the table or does not compile, [`GpuError::Io`] if a file is not there.
#[cfg(feature = "compile-shaders")]
pub fn load_spirv(name: &str) -> Result<Vec<u32>, GpuError> {
    let entry = SHADERS
        .iter()
        .find(|entry| entry.name == name)
        .ok_or_else(|| not_in_table(name))?;
    super::shader_compiler::compile_entry(&super::shader_compiler::source_root(), entry)
}

fn not_in_table(name: &str) -> GpuError {
    GpuError::Shader {
        name: name.into(),
        log: "it is not in the table of shaders".into(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_unique() {
        for (index, entry) in SHADERS.iter().enumerate() {
            assert!(
                SHADERS[..index].iter().all(|other| other.name != entry.name),
                "{}",
                entry.name
            );
        }
    }

    #[test]
    fn unknown_names_are_errors() {
        assert!(matches!(load_spirv("no such shader"), Err(GpuError::Shader { .. })));
    }
}
