//! All shader definitions of a game, found by name.

use super::definition::Shader;
use super::file::parse_file;
use super::warning::Warning;
use std::collections::HashMap;

/// Suffix of definitions meant for the map compiler only.
const COMPILER_SUFFIX: &str = ":q3map";

/// Shader definitions by name, with the game's rule for names defined more than once.
#[derive(Clone, Debug, Default)]
pub struct ShaderLibrary {
    /// All definitions in listing order.
    shaders: Vec<Shader>,
    names: HashMap<String, Definitions>,
    warnings: Vec<Warning>,
}

/// Where the definitions of one name are.
#[derive(Clone, Debug)]
struct Definitions {
    /// The game's choice.
    winner: usize,
    /// Number of the file that `winner` is from.
    file: usize,
    /// In listing order.
    all: Vec<usize>,
}

impl ShaderLibrary {
    /// Reads script files, given as (name, text) in the game's listing order: highest-priority search path first,
    /// each file name once.
    ///
    /// The game joins the texts in reverse order and takes the first definition it meets. So of a name in several
    /// files the **last listed** file wins, and inside a file the first definition.
    pub fn from_files<N: AsRef<str>, T: AsRef<str>>(files: impl IntoIterator<Item = (N, T)>) -> Self {
        let mut library = Self::default();
        for (file, (name, text)) in files.into_iter().enumerate() {
            let parsed = parse_file(name.as_ref(), text.as_ref());
            library.warnings.extend(parsed.warnings);
            for shader in parsed.shaders {
                library.insert(file, shader);
            }
        }
        library
    }

    fn insert(&mut self, file: usize, shader: Shader) {
        let index = self.shaders.len();
        let key = definition_key(&shader.name);
        if lookup_key(&shader.name) != key {
            self.warnings.push(Warning {
                file: shader.file.clone(),
                line: shader.line,
                shader: shader.name.clone(),
                message: "never found: lookups leave the extension off, but this name has one".to_owned(),
            });
        }
        self.shaders.push(shader);
        let entry = self.names.entry(key).or_insert_with(|| Definitions {
            winner: index,
            file,
            all: Vec::new(),
        });
        entry.all.push(index);
        if file != entry.file {
            (entry.winner, entry.file) = (index, file);
        }
    }

    /// The definition that the game uses for `name`. Case, the extension and the direction of slashes don't matter.
    pub fn get(&self, name: &str) -> Option<&Shader> {
        self.names
            .get(&lookup_key(name))
            .map(|entry| &self.shaders[entry.winner])
    }

    /// The definition `name:q3map`, which q3map2 reads as one of `name` and the game doesn't.
    pub fn compiler_alternate(&self, name: &str) -> Option<&Shader> {
        let key = lookup_key(name) + COMPILER_SUFFIX;
        self.names.get(&key).map(|entry| &self.shaders[entry.winner])
    }

    /// Every definition of `name` in listing order, without its `:q3map` alternate. A map may have been compiled with
    /// another one than the game's choice.
    pub fn definitions(&self, name: &str) -> impl Iterator<Item = &Shader> {
        let entry = self.names.get(&lookup_key(name));
        entry
            .into_iter()
            .flat_map(|entry| entry.all.iter().map(|&index| &self.shaders[index]))
    }

    /// Every definition in listing order, those never used included.
    pub fn all_definitions(&self) -> &[Shader] {
        &self.shaders
    }

    /// The definitions that the game uses, in listing order.
    pub fn iter(&self) -> impl Iterator<Item = &Shader> {
        let mut winners: Vec<usize> = self.names.values().map(|entry| entry.winner).collect();
        winners.sort_unstable();
        winners.into_iter().map(|index| &self.shaders[index])
    }

    /// Number of different names.
    pub fn len(&self) -> usize {
        self.names.len()
    }

    /// Without any definition.
    pub fn is_empty(&self) -> bool {
        self.names.is_empty()
    }

    /// What is wrong with the scripts, in listing order.
    pub fn warnings(&self) -> &[Warning] {
        &self.warnings
    }
}

/// What `name` is looked up by: lower case, `/` between folders, no extension.
pub fn lookup_key(name: &str) -> String {
    let mut key = definition_key(name);
    let file = key.rfind('/').map_or(0, |slash| slash + 1);
    if let Some(dot) = key[file..].rfind('.') {
        key.truncate(file + dot);
    }
    key
}

/// The game takes names in scripts as they are, extension included.
fn definition_key(name: &str) -> String {
    name.to_ascii_lowercase().replace('\\', "/")
}

#[cfg(test)]
mod tests {
    use super::{ShaderLibrary, lookup_key};

    fn library() -> ShaderLibrary {
        ShaderLibrary::from_files([
            ("first", "a { cull none }\nb { cull none }\nx/c { }"),
            ("second", "A { cull back }\na { }\na:q3map { q3map_surfacelight 5 }"),
            ("bad", "a { "),
        ])
    }

    #[test]
    fn the_last_file_wins_and_in_it_the_first_definition() {
        let library = library();
        let a = library.get("a").unwrap();
        assert_eq!((&*a.file, a.line), ("second", 1));
        assert_eq!(&*library.get("b").unwrap().file, "first");
        let all: Vec<_> = library
            .definitions("a")
            .map(|shader| (&*shader.file, shader.line))
            .collect();
        assert_eq!(all, [("first", 1), ("second", 1), ("second", 2)]);
        assert_eq!(
            (library.len(), library.all_definitions().len(), library.warnings().len()),
            (4, 6, 1)
        );
        let used: Vec<_> = library.iter().map(|shader| shader.name.as_str()).collect();
        assert_eq!(used, ["b", "x/c", "A", "a:q3map"]);
    }

    #[test]
    fn case_extension_and_slashes_do_not_matter() {
        let library = library();
        for name in ["x/c", "X\\C", "x/c.tga", "x/C.JPG"] {
            assert!(library.get(name).is_some(), "{name}");
        }
        assert!(library.get("c").is_none());
        assert_eq!(lookup_key("a.b/c"), "a.b/c");
    }

    #[test]
    fn alternates_are_the_compilers() {
        let library = library();
        assert_eq!(library.compiler_alternate("a.tga").unwrap().emits(), Some(5.0));
        assert!(library.get("a").unwrap().emits().is_none() && library.compiler_alternate("b").is_none());
    }

    #[test]
    fn a_name_with_an_extension_is_never_found() {
        let library = ShaderLibrary::from_files([("f", "a.tga { }")]);
        assert!(library.get("a.tga").is_none() && library.get("a").is_none());
        assert_eq!(library.warnings().len(), 1);
    }
}
