//! From a map's files to a scene.

use super::ambient::Ambient;
use super::clusters::{ClusterMap, LightRows, bsp_records, build_light_rows};
use super::entity_geometry::{self, Placement, Standing};
use super::fog::Fogs;
use super::items;
use super::light_cells::LightCells;
use super::lights::{LightInputs, LightTable};
use super::material::{MaterialSource, Tables};
use super::models::Models;
use super::motion::Motion;
use super::player::{self, Player, Shelf};
use super::portals;
use super::records::{BspNode, Material, Portal};
use super::spawns::{Spawn, spawns};
use super::static_geometry::{self, Geometry};
use super::textures::TextureRequests;
use crate::assets::bsp::{Bsp, BspError};
use crate::assets::entities::{self, Entity};
use crate::assets::image::Texture;
use crate::assets::shader_script::ShaderLibrary;
use crate::assets::vfs::search_path::map_path;
use crate::assets::vfs::{FileSource, VfsError};
use glam::Affine3A;
use std::time::{Duration, Instant};
use thiserror::Error;

/// Why a map could not be loaded.
#[derive(Debug, Error)]
pub enum SceneError {
    #[error("no map named \"{name}\" was found; `q3rays maps` lists what there is")]
    NotFound { name: String },
    #[error("cannot load map \"{name}\": {source}")]
    Bsp { name: String, source: BspError },
    #[error(transparent)]
    Files(#[from] VfsError),
}

/// What is loaded with a map.
#[derive(Clone, Debug, Default)]
pub struct LoadOptions {
    /// Somebody who looks at it: a body for mirrors and a weapon before the eye.
    pub player: Option<Player>,
    /// Triangles of polygons that frames may bring along.
    pub polygons: u32,
    /// Names of materials for them.
    pub materials: Vec<String>,
}

/// A loaded map, ready for the tracers. World units, z up; radiance in luxel units.
pub struct Scene {
    pub name: String,
    pub bsp: Bsp,
    pub entities: Vec<Entity>,
    pub spawns: Vec<Spawn>,
    pub textures: Vec<Texture>,
    /// One per shader entry of the map, then those of models.
    pub material_sources: Vec<MaterialSource>,
    pub materials: Vec<Material>,
    /// What materials point into.
    pub tables: Tables,
    pub fogs: Fogs,
    pub portals: Vec<Portal>,
    pub geometry: Geometry,
    /// Where meshes stand; placement 0 is the world.
    pub placements: Vec<Placement>,
    pub lights: LightTable,
    pub clusters: ClusterMap,
    pub rows: LightRows,
    /// What no light of the scene explains; nothing until [`crate::lighting::light`] has looked for it.
    pub ambient: Ambient,
    /// Empty until [`crate::reference::light_cells::build`] has made them.
    pub cells: LightCells,
    pub bsp_nodes: Vec<BspNode>,
    /// What is missing or damaged, one sentence each, each once.
    pub warnings: Vec<String>,
    /// Time that each step of loading took.
    pub timings: Vec<(&'static str, Duration)>,
}

struct Stopwatch {
    last: Instant,
    timings: Vec<(&'static str, Duration)>,
}

impl Stopwatch {
    fn lap(&mut self, name: &'static str) {
        let now = Instant::now();
        self.timings.push((name, now - self.last));
        self.last = now;
    }
}

/// All shader scripts of a search path, in the game's order of precedence.
pub fn load_scripts(files: &dyn FileSource) -> Result<ShaderLibrary, VfsError> {
    let mut texts = Vec::new();
    for path in files.list("scripts", "shader") {
        if let Some(bytes) = files.read(&path)? {
            texts.push((path, String::from_utf8_lossy(&bytes).into_owned()));
        }
    }
    Ok(ShaderLibrary::from_files(texts))
}

impl Scene {
    /// Loads a map by name from a file source.
    ///
    /// # Errors
    /// [`SceneError`] where there is no such map or it is damaged. Missing images and scripts are warnings.
    pub fn load(files: &dyn FileSource, name: &str) -> Result<Self, SceneError> {
        Self::load_with(files, name, &LoadOptions::default())
    }

    /// The same with what else is to be there.
    ///
    /// # Errors
    /// As [`Self::load`].
    pub fn load_with(files: &dyn FileSource, name: &str, options: &LoadOptions) -> Result<Self, SceneError> {
        let start = Instant::now();
        let bytes = files
            .read(&map_path(name))?
            .ok_or_else(|| SceneError::NotFound { name: name.to_owned() })?;
        let bsp = Bsp::read(&bytes).map_err(|source| SceneError::Bsp {
            name: name.to_owned(),
            source,
        })?;
        drop(bytes);
        Self::from_bsp_timed(files, name, bsp, options, start)
    }

    /// Builds a scene of a map that is already in memory.
    ///
    /// # Errors
    /// [`SceneError::Files`] where scripts exist and cannot be read.
    pub fn from_bsp(files: &dyn FileSource, name: &str, bsp: Bsp) -> Result<Self, SceneError> {
        Self::from_bsp_timed(files, name, bsp, &LoadOptions::default(), Instant::now())
    }

    fn from_bsp_timed(
        files: &dyn FileSource,
        name: &str,
        bsp: Bsp,
        options: &LoadOptions,
        start: Instant,
    ) -> Result<Self, SceneError> {
        let mut watch = Stopwatch {
            last: start,
            timings: Vec::new(),
        };
        watch.lap("bsp");
        let scripts = load_scripts(files)?;
        watch.lap("scripts");
        let (entities, mut warnings) = entities::parse(&bsp.entities);
        let mut requests = TextureRequests::default();
        let mut material_sources: Vec<MaterialSource> = bsp
            .shaders
            .iter()
            .map(|s| MaterialSource::new(&s.name.text(), s.surface_flags, &scripts, &mut requests))
            .collect();
        for name in &options.materials {
            let mut made = MaterialSource::new(name, 0, &scripts, &mut requests);
            made.of_model = true;
            material_sources.push(made);
        }
        let mut models = Models::default();
        let items = items::placed(&bsp, &entities);
        let mut item_models = Vec::new();
        for item in &items {
            let mut number = |path: &str| {
                if path.is_empty() {
                    return Ok(None);
                }
                models.number(path, files, &scripts, &mut material_sources, &mut requests)
            };
            item_models.push([number(item.item.models[0])?, number(item.item.models[1])?]);
        }
        // Second models are extras that not every game has.
        let extra = |w: &String| {
            !items
                .iter()
                .any(|i| w.ends_with(i.item.models[1]) && !i.item.models[1].is_empty())
        };
        warnings.extend(models.warnings.drain(..).filter(extra));
        let player = match &options.player {
            Some(player) => player::parts(
                player,
                &mut Shelf {
                    files,
                    scripts: &scripts,
                    models: &mut models,
                    materials: &mut material_sources,
                    requests: &mut requests,
                },
            )?,
            None => Vec::new(),
        };
        warnings.append(&mut models.warnings);
        watch.lap("models");
        let (textures, missing) = requests.load(files);
        warnings.extend(missing);
        for source in &mut material_sources {
            source.resolve(&textures);
        }
        let mut tables = Tables::default();
        let materials: Vec<Material> = material_sources
            .iter()
            .map(|m| m.record(&textures, &mut tables))
            .collect();
        watch.lap("textures");
        let portals = portals::portals(&bsp, &entities, &material_sources);
        let fogs = Fogs::new(&bsp, &scripts);
        let emits: Vec<bool> = material_sources.iter().map(|m| m.surface_light().is_some()).collect();
        let mut geometry = static_geometry::build(&bsp, &material_sources, &emits, &models, options.polygons);
        if geometry.meshes.is_empty() {
            warnings.push("the map has no world model: nothing is drawn".to_owned());
        }
        let mut placements = entity_geometry::placements(&bsp, &entities);
        let first_model = bsp.models.len() as u32;
        for (item, numbers) in items.iter().zip(item_models) {
            placements.extend(entity_geometry::item_placements(item, numbers, &models, first_model));
        }
        placements.extend(player.into_iter().map(|part| Placement::of_player(part, first_model)));
        geometry.dynamic.place(&mut placements);
        if let Some(room) = geometry.polygons {
            placements.push(Placement::new(room.mesh, Motion::Still(Affine3A::IDENTITY)));
        }
        watch.lap("geometry");
        let worldspawn = entities.iter().find(|e| e.class() == "worldspawn");
        let far_plane = worldspawn
            .and_then(|w| w.number("_farplanedist"))
            .filter(|&far| far > 0.0);
        let clusters = ClusterMap::new(&bsp, far_plane);
        let standings = entity_geometry::standings(&placements, geometry.meshes.len());
        let lights = LightTable::collect(&LightInputs {
            bsp: &bsp,
            entities: &entities,
            geometry: &geometry,
            standings: &standings,
            sources: &material_sources,
            materials: &materials,
            clusters: &clusters,
        });
        let rows = build_light_rows(&clusters, &lights.reach, &lights.weights);
        for t in &mut geometry.triangles {
            t.fallback_row = rows.fallback(t.surface);
        }
        watch.lap("lights");
        Ok(Self {
            name: name.to_owned(),
            spawns: spawns(&entities),
            bsp_nodes: bsp_records(&bsp),
            bsp,
            entities,
            textures,
            material_sources,
            materials,
            tables,
            fogs,
            portals,
            geometry,
            placements,
            lights,
            clusters,
            rows,
            ambient: Ambient::default(),
            cells: LightCells::default(),
            warnings,
            timings: watch.timings,
        })
    }

    /// Where each mesh stands first; `None` where no entity places it.
    pub fn standings(&self) -> Vec<Option<Standing>> {
        entity_geometry::standings(&self.placements, self.geometry.meshes.len())
    }

    /// What the collection of lights looks at. `standings`: [`Self::standings`].
    pub fn light_inputs<'a>(&'a self, standings: &'a [Option<Standing>]) -> LightInputs<'a> {
        LightInputs {
            bsp: &self.bsp,
            entities: &self.entities,
            geometry: &self.geometry,
            standings,
            sources: &self.material_sources,
            materials: &self.materials,
            clusters: &self.clusters,
        }
    }

    /// Gives the scene other lights, in any order, and lists them anew. Light cells and ambient light are gone then.
    pub fn relight(&mut self, mut lights: LightTable) {
        lights.put_in_order();
        self.rows = build_light_rows(&self.clusters, &lights.reach, &lights.weights);
        for t in &mut self.geometry.triangles {
            t.fallback_row = self.rows.fallback(t.surface);
        }
        self.lights = lights;
        self.cells = LightCells::default();
        self.ambient = Ambient::default();
    }
}
