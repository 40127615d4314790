//! One script file.

use super::definition::Shader;
use super::parse_definition::parse_definition;
use super::prescan::definitions;
use super::warning::Warning;
use std::sync::Arc;

/// What a script file holds.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ParsedFile {
    /// In the order of the file, duplicates included.
    pub shaders: Vec<Shader>,
    /// In the order of the file.
    pub warnings: Vec<Warning>,
}

/// Reads a script file. Never fails: faults become warnings, and a file whose braces don't match gives no shader, as
/// in ioquake3.
pub fn parse_file(name: &str, text: &str) -> ParsedFile {
    let file: Arc<str> = Arc::from(name);
    let spans = match definitions(text) {
        Ok(spans) => spans,
        Err(error) => {
            let (shader, line) = error.place();
            let warning = Warning {
                line,
                shader: shader.to_owned(),
                message: error.to_string(),
                file,
            };
            return ParsedFile {
                shaders: Vec::new(),
                warnings: vec![warning],
            };
        }
    };
    let mut parsed = ParsedFile::default();
    for span in &spans {
        let (shader, warnings) = parse_definition(&file, span);
        parsed.shaders.push(shader);
        parsed.warnings.extend(warnings);
    }
    parsed
}

#[cfg(test)]
mod tests {
    use super::parse_file;
    use proptest::prelude::*;

    #[test]
    fn a_brace_error_skips_the_file_with_one_warning() {
        let parsed = parse_file("bad", "a { { map x }\nb { { map y } }");
        assert!(parsed.shaders.is_empty());
        assert_eq!(parsed.warnings.len(), 1);
        assert_eq!((parsed.warnings[0].line, parsed.warnings[0].shader.as_str()), (1, "a"));
    }

    #[test]
    fn a_fault_in_one_definition_leaves_the_others() {
        let parsed = parse_file("f", "a { nonsense }\nb {\n cull none\n { map y }\n}");
        assert_eq!(parsed.shaders.len(), 2);
        assert!(parsed.shaders[0].rejected && !parsed.shaders[1].rejected);
        assert_eq!(parsed.warnings.len(), 1);
    }

    const WORDS: &[&str] = &[
        "{",
        "}",
        "{",
        "}",
        "\n",
        "\n",
        "\r",
        "//",
        "/*",
        "*/",
        "\"",
        "(",
        ")",
        "(1",
        "2)",
        "name",
        "map",
        "clampmap",
        "animMap",
        "videoMap",
        "$lightmap",
        "blendFunc",
        "gl_one",
        "add",
        "rgbGen",
        "alphaGen",
        "const",
        "wave",
        "sin",
        "portal",
        "tcGen",
        "vector",
        "tcMod",
        "turb",
        "stretch",
        "transform",
        "scale",
        "deformVertexes",
        "move",
        "text",
        "text9",
        "cull",
        "sort",
        "skyparms",
        "-",
        "fogparms",
        "surfaceparm",
        "sky",
        "sun",
        "q3map_sunExt",
        "q3map_skylight",
        "q3map_backsplash",
        "q3map_nolightmap",
        "q3map_",
        "qer_editorimage",
        "qer_trans",
        "qer",
        "implicitMap",
        "0",
        "-1.5",
        "1e99",
        "4294967296",
        "é",
        "a.tga",
    ];

    proptest! {
        #[test]
        fn arbitrary_text_never_panics(text in any::<String>()) {
            parse_file("p", &text);
        }

        #[test]
        fn arbitrary_words_never_panic(indices in prop::collection::vec(0..WORDS.len(), 0..200)) {
            let words: Vec<&str> = indices.iter().map(|&index| WORDS[index]).collect();
            parse_file("p", &words.join(" "));
            // In matched braces, so that the definitions themselves are reached.
            let body: Vec<&str> = words.iter().copied().filter(|word| !matches!(*word, "{" | "}" | "\"" | "/*")).collect();
            let parsed = parse_file("p", &format!("a {{ {}\n {{ {}\n }}\n}}", body.join(" "), body.join(" ")));
            prop_assert_eq!(parsed.shaders.len(), 1);
        }
    }
}
