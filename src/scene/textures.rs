//! The textures of a scene: asked for by name, loaded together, each once.

use crate::assets::image::{self, Texture};
use crate::assets::vfs::FileSource;
use rayon::prelude::*;
use std::collections::HashMap;

/// Collects names first, so that all images can be decoded in parallel.
#[derive(Default)]
pub struct TextureRequests {
    names: Vec<String>,
    /// Asked for by something that shows it, so that its absence is worth a word.
    shown: Vec<bool>,
    by_name: HashMap<String, u32>,
}

/// Texture 0 is always the checker.
pub const CHECKER: u32 = 0;
/// Texture 1 is always plain white.
pub const WHITE: u32 = 1;
const FIRST_IMAGE: u32 = 2;

impl TextureRequests {
    /// Number of the texture that will hold the image `name`.
    pub fn request(&mut self, name: &str) -> u32 {
        self.number(name, true)
    }

    /// The same for an image that is only one of several candidates: it is no fault if it is missing.
    pub fn request_candidate(&mut self, name: &str) -> u32 {
        self.number(name, false)
    }

    fn number(&mut self, name: &str, shown: bool) -> u32 {
        let key = name.to_ascii_lowercase().replace('\\', "/");
        if let Some(&id) = self.by_name.get(&key) {
            self.shown[(id - FIRST_IMAGE) as usize] |= shown;
            return id;
        }
        let id = FIRST_IMAGE + self.names.len() as u32;
        self.names.push(key.clone());
        self.shown.push(shown);
        self.by_name.insert(key, id);
        id
    }

    /// Loads everything. Missing and damaged images become checkers; the second value says each of them once.
    pub fn load(self, files: &dyn FileSource) -> (Vec<Texture>, Vec<String>) {
        let loaded: Vec<(Texture, Option<String>)> = self
            .names
            .par_iter()
            .zip(&self.shown)
            .map(|(name, shown)| match image::load(files, name) {
                Ok(Some(texture)) => (texture, None),
                Ok(None) => (Texture::checker(name), shown.then(|| format!("missing image {name}"))),
                Err(e) => (Texture::checker(name), Some(e)),
            })
            .collect();
        let mut textures = vec![
            Texture {
                missing: false,
                ..Texture::checker("*checker")
            },
            Texture::solid("*white", [255; 4]),
        ];
        let mut warnings = Vec::new();
        for (texture, warning) in loaded {
            textures.push(texture);
            warnings.extend(warning);
        }
        (textures, warnings)
    }
}
