//! Shader scripts (`scripts/*.shader`): what a surface looks like, how it blocks and how it emits light.
//!
//! Text in, typed definitions out; no image is loaded. Two readers of the same text are followed, each for its own
//! directives: ioquake3 for what is drawn, q3map2 for `q3map_*`. What neither understands becomes a [`Warning`].

mod blend;
mod color;
mod compiler;
mod definition;
mod deform;
mod file;
mod library;
mod number;
mod parse_compiler;
mod parse_definition;
mod parse_stage;
mod prescan;
mod reader;
mod sky;
mod stage;
mod surface_parm;
mod texcoord;
mod token;
mod warning;
mod wave;

pub use blend::{AlphaFunc, Blend, BlendFactor, DepthFunc};
pub use color::{AlphaGen, RgbGen};
pub use compiler::{Backsplash, CompilerParms, Directive, ImplicitImage, ImplicitKind, SkyLight, Sun};
pub use definition::{Cull, EditorParms, FogParms, Shader, Sort};
pub use deform::Deform;
pub use file::{ParsedFile, parse_file};
pub use library::{ShaderLibrary, lookup_key};
pub use sky::SkyParms;
pub use stage::{Image, Stage, StageTexture};
pub use surface_parm::{SurfaceParm, SurfaceParms, content, surface};
pub use texcoord::{TcGen, TcMod};
pub use warning::Warning;
pub use wave::{Wave, WaveFunction};
