//! A glTF document under construction: JSON objects by kind, and the binary chunk that they point into.

use super::ExportError;
use serde_json::{Map, Value, json};
use std::borrow::Cow;
use std::collections::BTreeMap;

/// glTF's numbers for component types.
const FLOAT: u32 = 5126;
const UNSIGNED_INT: u32 = 5125;
/// glTF's numbers for what a buffer view is for.
const ARRAY_BUFFER: u32 = 34962;
const ELEMENT_ARRAY_BUFFER: u32 = 34963;

/// See the module.
#[derive(Default)]
pub struct Document {
    lists: BTreeMap<&'static str, Vec<Value>>,
    whole: Map<String, Value>,
    extensions: BTreeMap<&'static str, Value>,
    binary: Vec<u8>,
}

impl Document {
    /// Appends to a list of the document; returns the number.
    pub fn push(&mut self, list: &'static str, value: Value) -> usize {
        let list = self.lists.entry(list).or_default();
        list.push(value);
        list.len() - 1
    }

    /// Sets a member of the document.
    pub fn set(&mut self, member: &str, value: Value) {
        self.whole.insert(member.to_owned(), value);
    }

    /// Notes that an extension is used, with what it has in the document itself.
    pub fn use_extension(&mut self, name: &'static str, value: Value) {
        self.extensions.insert(name, value);
    }

    fn view(&mut self, bytes: &[u8], target: Option<u32>) -> usize {
        while !self.binary.len().is_multiple_of(4) {
            self.binary.push(0);
        }
        let mut view = json!({ "buffer": 0, "byteOffset": self.binary.len(), "byteLength": bytes.len() });
        if let Some(target) = target {
            view["target"] = json!(target);
        }
        self.binary.extend_from_slice(bytes);
        self.push("bufferViews", view)
    }

    /// Vectors of a vertex attribute.
    pub fn vectors<const N: usize>(&mut self, values: &[[f32; N]]) -> usize {
        let view = self.view(bytemuck::cast_slice(values.as_flattened()), Some(ARRAY_BUFFER));
        let mut bounds = [[f32::INFINITY; N], [f32::NEG_INFINITY; N]];
        for v in values {
            for c in 0..N {
                bounds[0][c] = bounds[0][c].min(v[c]);
                bounds[1][c] = bounds[1][c].max(v[c]);
            }
        }
        let accessor = json!({
            "bufferView": view, "componentType": FLOAT, "count": values.len(), "type": format!("VEC{N}"),
            "min": bounds[0].as_slice(), "max": bounds[1].as_slice(),
        });
        self.push("accessors", accessor)
    }

    /// Numbers of vertices.
    pub fn indices(&mut self, values: &[u32]) -> usize {
        let view = self.view(bytemuck::cast_slice(values), Some(ELEMENT_ARRAY_BUFFER));
        let accessor =
            json!({ "bufferView": view, "componentType": UNSIGNED_INT, "count": values.len(), "type": "SCALAR" });
        self.push("accessors", accessor)
    }

    /// A PNG file.
    pub fn image(&mut self, name: &str, png: &[u8]) -> usize {
        let view = self.view(png, None);
        self.push(
            "images",
            json!({ "name": name, "bufferView": view, "mimeType": "image/png" }),
        )
    }

    /// The file, checked by the reader of the same crate that wrote it.
    pub fn glb(mut self) -> Result<Vec<u8>, ExportError> {
        self.set("buffers", json!([{ "byteLength": self.binary.len() }]));
        for (list, values) in std::mem::take(&mut self.lists) {
            self.set(list, Value::Array(values));
        }
        let used: Vec<&str> = self.extensions.keys().copied().collect();
        if !used.is_empty() {
            self.set("extensionsUsed", json!(used));
        }
        let members: Map<String, Value> = std::mem::take(&mut self.extensions)
            .into_iter()
            .filter(|(_, value)| !value.is_null())
            .map(|(name, value)| (name.to_owned(), value))
            .collect();
        if !members.is_empty() {
            self.set("extensions", Value::Object(members));
        }
        let text = Value::Object(self.whole).to_string();
        // Header, two chunk headers, padding.
        let bytes = text.len() as u64 + self.binary.len() as u64 + 64;
        if bytes > u64::from(u32::MAX) {
            return Err(ExportError::TooLarge { bytes });
        }
        let file = gltf::binary::Glb {
            header: gltf::binary::Header {
                magic: *b"glTF",
                version: 2,
                length: 0,
            },
            json: Cow::Owned(text.into_bytes()),
            bin: Some(Cow::Owned(self.binary)),
        };
        let bytes = file.to_vec()?;
        gltf::Gltf::from_slice(&bytes)?;
        Ok(bytes)
    }
}
