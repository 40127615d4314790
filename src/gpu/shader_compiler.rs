//! GLSL to SPIR-V 1.5 for Vulkan 1.2. The same source gives the same bytes on every machine.

use std::collections::HashMap;
use std::path::{Component, Path, PathBuf};

use glslang::include::{IncludeHandler, IncludeResult, IncludeType};
use glslang::{
    Compiler, CompilerOptions, ShaderInput, ShaderMessage, ShaderSource, ShaderStage, SourceLanguage, SpirvVersion,
    Target, VulkanVersion,
};

use super::GpuError;
use super::shader_table::{SHADERS, ShaderEntry};

/// The folder `shaders` of this crate when run by cargo, else of the current directory.
pub fn source_root() -> PathBuf {
    std::env::var_os("CARGO_MANIFEST_DIR")
        .map(PathBuf::from)
        .unwrap_or_default()
        .join("shaders")
}

/// Compiles one entry of the table. `root` is the folder `shaders`.
///
/// # Errors
/// [`GpuError::Shader`] with the compiler's messages, [`GpuError::Io`] if a file is not there.
pub fn compile_entry(root: &Path, entry: &ShaderEntry) -> Result<Vec<u32>, GpuError> {
    let path = root.join(entry.source);
    let text = std::fs::read_to_string(&path).map_err(|source| GpuError::Io { path, source })?;
    compile(entry.name, &text, entry.defines, &root.join("include"))
}

/// Compiles the text of a compute shader. Every `#include` is resolved in `include_folder`.
///
/// # Errors
/// [`GpuError::Shader`] with the compiler's messages.
pub fn compile(name: &str, text: &str, defines: &[(&str, &str)], include_folder: &Path) -> Result<Vec<u32>, GpuError> {
    let failed = |log: String| GpuError::Shader {
        name: name.into(),
        log: log.trim().replace('\n', "; "),
    };
    // The wrapper hands the text to C, which knows no zero bytes inside strings.
    if text.contains('\0') {
        return Err(failed("its source contains a zero byte".into()));
    }
    let compiler = Compiler::acquire().ok_or_else(|| failed("glslang does not start".into()))?;
    let source = ShaderSource::from(text);
    let options = CompilerOptions {
        source_language: SourceLanguage::GLSL,
        target: Target::Vulkan {
            version: VulkanVersion::Vulkan1_2,
            spirv_version: SpirvVersion::SPIRV1_5,
        },
        version_profile: None,
        messages: ShaderMessage::SPV_RULES | ShaderMessage::VULKAN_RULES,
    };
    let defines: Vec<(&str, Option<&str>)> = defines.iter().map(|&(name, value)| (name, Some(value))).collect();
    let mut includes = Includes {
        folder: include_folder,
        read: HashMap::new(),
    };
    let input = ShaderInput::new(
        &source,
        ShaderStage::Compute,
        &options,
        Some(&defines),
        Some(&mut includes),
    )
    .map_err(|error| failed(error.to_string()))?;
    let shader = compiler
        .create_shader(input)
        .map_err(|error| failed(error.to_string()))?;
    shader.compile().map_err(|error| failed(error.to_string()))
}

/// Compiles the whole table. Writes `spirv/NAME.spv` under `root`, or, if `check`, only compares; returns the names of
/// the files that differed.
///
/// # Errors
/// The first shader that does not compile, or a file that cannot be written.
pub fn compile_table(root: &Path, check: bool) -> Result<Vec<&'static str>, GpuError> {
    let folder = root.join("spirv");
    let io = |path: &Path| {
        let path = path.to_owned();
        move |source| GpuError::Io { path, source }
    };
    let mut changed = Vec::new();
    for entry in SHADERS {
        let words = compile_entry(root, entry)?;
        let bytes: Vec<u8> = words.iter().flat_map(|word| word.to_le_bytes()).collect();
        let path = folder.join(entry.name).with_added_extension("spv");
        if std::fs::read(&path).is_ok_and(|present| present == bytes) {
            continue;
        }
        changed.push(entry.name);
        if !check {
            std::fs::create_dir_all(&folder).map_err(io(&folder))?;
            std::fs::write(&path, &bytes).map_err(io(&path))?;
        }
    }
    Ok(changed)
}

struct Includes<'a> {
    folder: &'a Path,
    read: HashMap<String, String>,
}

impl IncludeHandler for Includes<'_> {
    fn include(&mut self, _: IncludeType, name: &str, _: &str, depth: usize) -> Option<IncludeResult> {
        // A file that includes itself would recurse for ever; nothing sensible nests this deep.
        const DEEPEST: usize = 32;
        let stays_inside = Path::new(name)
            .components()
            .all(|part| matches!(part, Component::Normal(_)));
        if depth > DEEPEST || !stays_inside {
            return None;
        }
        if !self.read.contains_key(name) {
            let text = std::fs::read_to_string(self.folder.join(name)).ok()?;
            self.read.insert(name.to_owned(), text);
        }
        let data = self.read.get(name).filter(|text| !text.contains('\0'))?.clone();
        Some(IncludeResult {
            name: name.to_owned(),
            data,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn compile_text(body: &str) -> Result<Vec<u32>, GpuError> {
        compile("test", body, &[], &source_root().join("include"))
    }

    #[test]
    fn errors_carry_the_compilers_message() {
        let error = compile_text("#version 460\nvoid main() { nonsense; }")
            .unwrap_err()
            .to_string();
        assert!(error.contains("nonsense"), "{error}");
        let error = compile_text(
            "#version 460\n#extension GL_GOOGLE_include_directive : require\n#include \"none.glsl\"\nvoid main() {}",
        );
        assert!(matches!(error, Err(GpuError::Shader { .. })));
    }

    #[test]
    fn includes_stay_inside_their_folder() {
        let text = "#version 460\n#extension GL_GOOGLE_include_directive : require\n#include \"../test/fill.comp\"\nvoid main() {}";
        assert!(compile_text(text).is_err());
    }

    #[test]
    fn output_is_deterministic_and_needed_extensions_are_known() {
        let text = "#version 460
#extension GL_EXT_ray_query : require
#extension GL_EXT_buffer_reference : require
#extension GL_EXT_scalar_block_layout : require
#extension GL_EXT_nonuniform_qualifier : require
#extension GL_EXT_control_flow_attributes : require
layout(local_size_x = 64) in;
layout(buffer_reference, scalar) buffer Values { vec3 value[]; };
layout(push_constant, scalar) uniform Push { Values values; uint count; };
layout(set = 0, binding = 0) uniform sampler2D textures[];
void main() {
    [[dont_unroll]] for (uint i = 0; i < count; ++i)
        values.value[i] = textureLod(textures[nonuniformEXT(i)], vec2(0.5), 0.0).rgb;
}";
        assert_eq!(compile_text(text).unwrap(), compile_text(text).unwrap());
    }

    #[test]
    fn committed_spirv_is_up_to_date() {
        let stale = compile_table(&source_root(), true).unwrap();
        assert!(stale.is_empty(), "run compile_shaders: {stale:?} differ");
    }
}
