//! A scene on the GPU: buffers, textures and acceleration structures that any number of views share.

use super::backend::Backend;
use super::bvh_upload::{MeshTree, MeshTrees, TreeError, instance_tree};
use super::driver_structures::{self, DriverStructures};
use super::frame_constants::FrameConstants;
use super::history::Moving;
use crate::assets::image::SRGB_TO_LINEAR;
use crate::gpu::{
    Binding, BindingKind, Buffer, DescriptorLayout, DescriptorSets, Device, GpuError, Image, ImageDesc, MemoryKind,
    SampledTexture, Sampler, SamplerDesc, UploadBatch, Write,
};
use crate::scene::Scene;
use crate::scene::bvh::BvhQuality;
use crate::scene::camera::Camera;
use crate::scene::clock::Clock;
use crate::scene::entity_geometry::Placement;
use crate::scene::motion::Motion;
use crate::scene::polygons::{Polygon, PolygonError, Room};
use crate::scene::records::{
    Instance, Light, MATERIAL_DIELECTRIC, MATERIAL_FILTER, MATERIAL_GLOSSY, NONE, TextureInfo,
};
use crate::scene::static_geometry::Mesh;
use ash::vk;
use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::{Arc, Mutex};
use thiserror::Error;

/// Why a scene cannot be put on the GPU or rendered there.
#[derive(Debug, Error)]
pub enum RenderError {
    #[error(transparent)]
    Gpu(#[from] GpuError),
    #[error(transparent)]
    Tree(#[from] TreeError),
    #[error(transparent)]
    Polygons(#[from] PolygonError),
    #[error("map \"{map}\" has {count} textures; this device can bind {most} at once")]
    Textures { map: String, count: usize, most: u32 },
}

/// Bytes of staging memory for uploads.
const STAGING: u64 = 32 << 20;

/// Light lists of one culling level.
pub struct LightListBuffers {
    pub rows: Buffer,
    pub runs: Buffer,
}

/// Where the cubes of unexplained light are, and the constant that may stand for them.
struct AmbientLayout {
    origin: [f32; 3],
    step: [f32; 3],
    size: [u32; 3],
    constant: [f32; 3],
}

/// Where the polygons of frames go.
pub struct PolygonPlace {
    pub room: Option<Room>,
    /// Where their trees are.
    pub tree: MeshTree,
    /// Those that are there, as far as recorded commands have it.
    pub there: Mutex<Vec<Polygon>>,
}

/// Buffers of the own traversal.
pub struct BvhBuffers {
    pub mesh_trees: Buffer,
    pub cwbvh_nodes: Buffer,
    pub cwbvh_triangles: Buffer,
    pub bvh2_nodes: Buffer,
    pub bvh2_triangles: Buffer,
    pub instance_nodes: Buffer,
    pub instance_root: u32,
}

/// Everything of a scene that shaders read.
pub struct SceneGpu {
    pub device: Arc<Device>,
    pub backend: Backend,
    pub positions: Buffer,
    pub attributes: Buffer,
    pub triangles: Buffer,
    pub materials: Buffer,
    pub stages: Buffer,
    pub tc_mods: Buffer,
    pub deforms: Buffer,
    pub fogs: Buffer,
    pub fog_planes: Buffer,
    fog_count: u32,
    pub portals: Buffer,
    portal_count: u32,
    pub rest_vertices: Buffer,
    pub dynamic_triangles: Buffer,
    pub dynamic_triangles_count: u32,
    first_dynamic_vertex: u32,
    /// The scene has layers that tint light.
    pub light_filters: bool,
    /// The scene has surfaces that something branches off at.
    pub branches_off: bool,
    /// Light of each triangle, or [`NONE`].
    pub triangle_lights: Buffer,
    pub moving: Moving,
    /// Somebody looks at the scene: parts of it follow the camera.
    pub has_player: bool,
    pub name: String,
    /// Where meshes stand, and how they move.
    pub placements: Vec<Placement>,
    pub meshes: Vec<Mesh>,
    pub polygons: PolygonPlace,
    /// Flags of each material.
    pub material_flags: Vec<u32>,
    pub instances: Buffer,
    pub instance_count: u32,
    pub lights: Buffer,
    pub light_nodes: Buffer,
    pub light_weights: Buffer,
    pub light_cells: Buffer,
    pub cell_entries: Buffer,
    pub cell_bounds: Buffer,
    pub ambient_cubes: Buffer,
    ambient: AmbientLayout,
    /// Slots of the hash table of light cells less one; [`NONE`] without any.
    pub cell_mask: u32,
    /// Lights in the tree; suns follow.
    pub finite_lights: u32,
    /// All lights.
    pub light_count: u32,
    pub bsp_nodes: Buffer,
    pub texture_infos: Buffer,
    /// sRGB byte to linear light.
    pub srgb_table: Buffer,
    pub pvs: LightListBuffers,
    pub tight: LightListBuffers,
    pub all_row: u32,
    pub bvh: BvhBuffers,
    pub driver: Option<DriverStructures>,
    textures: Vec<Image>,
    sampler: Sampler,
    pub layout: Arc<DescriptorLayout>,
    pub sets: DescriptorSets,
    revision: AtomicU32,
}

fn upload<T: bytemuck::NoUninit>(
    device: &Arc<Device>,
    name: &str,
    data: &[T],
    usage: vk::BufferUsageFlags,
) -> Result<Buffer, GpuError> {
    // A shader may be handed the address of an empty list, so there is always something behind it.
    let size = (size_of_val(data) as u64).max(256);
    let usage = usage | vk::BufferUsageFlags::STORAGE_BUFFER;
    Buffer::new(device, name, size, usage, MemoryKind::DeviceLocal)
}

/// A light in the space of what carries it.
fn carried(light: &Light, placements: &[Placement]) -> Light {
    match placements.get(light.instance as usize) {
        Some(carrier) => light.moved(carrier.pose(Clock::default()).inverse()),
        None => *light,
    }
}

struct Uploads {
    staging: Vec<(Vec<u8>, usize)>,
}

impl SceneGpu {
    /// Uploads a scene and builds its acceleration structures.
    ///
    /// # Errors
    /// [`RenderError`] naming what does not fit, or what the device reported.
    pub fn new(
        device: &Arc<Device>,
        scene: &Scene,
        backend: Backend,
        quality: BvhQuality,
    ) -> Result<Self, RenderError> {
        let start = Clock::default().into();
        let instances: Vec<Instance> = scene
            .placements
            .iter()
            .map(|p| p.record(&scene.geometry.meshes, &start, &start))
            .collect();
        let trees = MeshTrees::build(scene, quality)?;
        let others = instance_tree(&scene.geometry.meshes, &instances, &scene.name)?;
        // Where no model but the world is drawn, there is no tree over the others to walk.
        let instance_count = if others.is_some() {
            instances.len()
        } else {
            instances.len().min(1)
        } as u32;
        let others = others.unwrap_or_default();
        let most = device.limits().max_sampled_images_per_stage.min(MAX_TEXTURES);
        if scene.textures.len() > most as usize {
            return Err(RenderError::Textures {
                map: scene.name.clone(),
                count: scene.textures.len(),
                most,
            });
        }
        let mut uploads = Uploads { staging: Vec::new() };
        let mut buffers = Vec::new();
        let build_input = if device.has_ray_query() {
            vk::BufferUsageFlags::ACCELERATION_STRUCTURE_BUILD_INPUT_READ_ONLY_KHR
        } else {
            vk::BufferUsageFlags::empty()
        };
        let none = vk::BufferUsageFlags::empty();
        macro_rules! buffer {
            ($name:literal, $data:expr, $usage:expr) => {{
                let data = $data;
                buffers.push(upload(device, $name, data, $usage)?);
                uploads
                    .staging
                    .push((bytemuck::cast_slice::<_, u8>(data).to_vec(), buffers.len() - 1));
                buffers.len() - 1
            }};
        }
        let g = &scene.geometry;
        let positions = buffer!("positions", &g.positions, build_input);
        let attributes = buffer!("attributes", &g.attributes, none);
        let triangles = buffer!("triangles", &g.triangles, none);
        let materials = buffer!("materials", &scene.materials, none);
        let stages = buffer!("stages", &scene.tables.stages, none);
        let tc_mods = buffer!("texture coordinate changes", &scene.tables.tc_mods, none);
        let deforms = buffer!("deforms", &scene.tables.deforms, none);
        let fogs = buffer!("fogs", &scene.fogs.fogs, none);
        let fog_planes = buffer!("fog planes", &scene.fogs.planes, none);
        let portals = buffer!("portals", &scene.portals, none);
        let rest_vertices = buffer!("rest vertices", &g.dynamic.rest, none);
        let dynamic_triangles = buffer!("dynamic triangles", &trees.dynamic, none);
        let instance_records = buffer!("instances", &instances, none);
        let carried: Vec<Light> = scene
            .lights
            .lights
            .iter()
            .map(|l| carried(l, &scene.placements))
            .collect();
        let lights = buffer!("lights", &carried, none);
        let light_nodes = buffer!("light nodes", &scene.lights.tree.nodes, none);
        let light_weights = buffer!("light weights", &scene.lights.weights, none);
        let of_triangles = scene.lights.of_triangles(g.triangles.len());
        let triangle_lights = buffer!("triangle lights", &of_triangles, none);
        let light_cells = buffer!("light cells", &scene.cells.slots, none);
        let cell_entries = buffer!("light cell entries", &scene.cells.entries, none);
        let cell_bounds = buffer!("light cell bounds", &scene.cells.bounds, none);
        let ambient_cubes = buffer!("ambient cubes", &scene.ambient.volume.cubes, none);
        let bsp_nodes = buffer!("bsp nodes", &scene.bsp_nodes, none);
        let pvs_rows = buffer!("light rows", &scene.rows.pvs.rows, none);
        let pvs_runs = buffer!("light runs", &scene.rows.pvs.runs, none);
        let tight_rows = buffer!("tight light rows", &scene.rows.tight.rows, none);
        let tight_runs = buffer!("tight light runs", &scene.rows.tight.runs, none);
        let infos: Vec<TextureInfo> = scene
            .textures
            .iter()
            .map(|t| TextureInfo {
                width: t.width,
                height: t.height,
                levels: t.levels.len() as u32,
            })
            .collect();
        let texture_infos = buffer!("texture infos", &infos, none);
        let srgb_table = buffer!("srgb table", &SRGB_TO_LINEAR[..], none);
        let mesh_trees = buffer!("mesh trees", &trees.records, none);
        let cwbvh_nodes = buffer!("8-wide nodes", &trees.cwbvh_nodes, none);
        let cwbvh_triangles = buffer!("8-wide triangles", &trees.cwbvh_triangles, none);
        let bvh2_nodes = buffer!("binary nodes", &trees.bvh2_nodes, none);
        let bvh2_triangles = buffer!("binary triangles", &trees.bvh2_triangles, none);
        let instance_tree_nodes = buffer!("instance nodes", &others.nodes, none);
        let indices: Vec<[u32; 3]> = g.triangles.iter().map(|t| t.vertices).collect();
        let index_buffer = buffer!("indices", &indices, build_input);

        let textures = scene
            .textures
            .iter()
            .map(|t| {
                Image::new(
                    device,
                    &ImageDesc {
                        name: &t.name,
                        format: vk::Format::R8G8B8A8_UNORM,
                        width: t.width,
                        height: t.height,
                        mips: t.levels.len() as u32,
                        usage: vk::ImageUsageFlags::SAMPLED | vk::ImageUsageFlags::TRANSFER_DST,
                    },
                )
            })
            .collect::<Result<Vec<_>, _>>()?;
        let mut batch = UploadBatch::new(device, STAGING)?;
        for (bytes, index) in &uploads.staging {
            batch.buffer(&buffers[*index], 0, bytes)?;
        }
        for (image, texture) in textures.iter().zip(&scene.textures) {
            for (mip, level) in texture.levels.iter().enumerate() {
                batch.image(image, mip as u32, bytemuck::cast_slice(level))?;
            }
        }
        batch.finish()?;

        let driver = match backend {
            Backend::RayQuery => Some(driver_structures::build(
                device,
                scene,
                &instances,
                &buffers[positions],
                &buffers[index_buffer],
            )?),
            Backend::Bvh => None,
        };
        let mut take = buffers.into_iter().map(Some).collect::<Vec<_>>();
        let mut take = |index: usize| -> Result<Buffer, GpuError> {
            take[index]
                .take()
                .ok_or_else(|| GpuError::InvalidInput("a scene buffer is used twice".into()))
        };
        let index_buffer = take(index_buffer)?;
        let driver = driver.map(|built| built.keeping(index_buffer));
        let sampler = Sampler::new(device, "texels", &SamplerDesc::default())?;
        let (layout, sets) = scene_set(device, backend, driver.as_ref(), &textures, &sampler)?;
        Ok(Self {
            device: device.clone(),
            backend,
            positions: take(positions)?,
            attributes: take(attributes)?,
            triangles: take(triangles)?,
            materials: take(materials)?,
            stages: take(stages)?,
            tc_mods: take(tc_mods)?,
            deforms: take(deforms)?,
            fogs: take(fogs)?,
            fog_planes: take(fog_planes)?,
            portals: take(portals)?,
            portal_count: scene.portals.len() as u32,
            fog_count: scene.fogs.fogs.len() as u32,
            rest_vertices: take(rest_vertices)?,
            dynamic_triangles: take(dynamic_triangles)?,
            dynamic_triangles_count: trees.dynamic.len() as u32,
            first_dynamic_vertex: g.dynamic.vertices.start,
            moving: Moving {
                picture: scene.material_sources.iter().any(|m| m.program.animated),
                lights: scene.material_sources.iter().any(|m| m.program.moving_emission)
                    || scene.lights.lights.iter().any(|l| l.instance != NONE),
                geometry: scene.placements.iter().any(|p| p.motion.moves())
                    || !trees.dynamic.is_empty()
                    || g.polygons.is_some(),
            },
            has_player: scene
                .placements
                .iter()
                .any(|p| matches!(p.motion, Motion::Body(_) | Motion::View(_))),
            name: scene.name.clone(),
            placements: scene.placements.clone(),
            polygons: PolygonPlace {
                room: g.polygons,
                tree: trees.polygons,
                there: Mutex::new(Vec::new()),
            },
            material_flags: scene.materials.iter().map(|m| m.flags).collect(),
            meshes: scene.geometry.meshes.clone(),
            light_filters: scene.materials.iter().any(|m| m.flags & MATERIAL_FILTER != 0),
            branches_off: scene
                .materials
                .iter()
                .any(|m| m.flags & (MATERIAL_DIELECTRIC | MATERIAL_GLOSSY) != 0),
            triangle_lights: take(triangle_lights)?,
            instances: take(instance_records)?,
            instance_count,
            lights: take(lights)?,
            light_nodes: take(light_nodes)?,
            light_weights: take(light_weights)?,
            light_cells: take(light_cells)?,
            cell_entries: take(cell_entries)?,
            cell_bounds: take(cell_bounds)?,
            ambient_cubes: take(ambient_cubes)?,
            ambient: AmbientLayout {
                origin: scene.ambient.volume.origin.into(),
                step: scene.ambient.volume.step.into(),
                size: scene.ambient.volume.size.into(),
                constant: scene.ambient.constant.into(),
            },
            cell_mask: (scene.cells.slots.len() as u32).checked_sub(1).unwrap_or(NONE),
            finite_lights: scene.lights.tree.finite,
            light_count: scene.lights.lights.len() as u32,
            bsp_nodes: take(bsp_nodes)?,
            texture_infos: take(texture_infos)?,
            srgb_table: take(srgb_table)?,
            pvs: LightListBuffers {
                rows: take(pvs_rows)?,
                runs: take(pvs_runs)?,
            },
            tight: LightListBuffers {
                rows: take(tight_rows)?,
                runs: take(tight_runs)?,
            },
            all_row: scene.rows.all_row,
            bvh: BvhBuffers {
                mesh_trees: take(mesh_trees)?,
                cwbvh_nodes: take(cwbvh_nodes)?,
                cwbvh_triangles: take(cwbvh_triangles)?,
                bvh2_nodes: take(bvh2_nodes)?,
                bvh2_triangles: take(bvh2_triangles)?,
                instance_nodes: take(instance_tree_nodes)?,
                instance_root: others.root,
            },
            driver,
            textures,
            sampler,
            layout,
            sets,
            revision: AtomicU32::new(0),
        })
    }
}

impl SceneGpu {
    /// Replaces lights from number `first` on, whose places and extents must stay within what the scene's rows and tree know of
    /// them: made for lights that change their colour or go out. Must not be called while a frame of this scene runs.
    ///
    /// # Errors
    /// [`GpuError`], where they do not fit above all.
    pub fn update_lights(&self, first: usize, lights: &[Light]) -> Result<(), GpuError> {
        let mut batch = UploadBatch::new(&self.device, STAGING)?;
        let lights: Vec<Light> = lights.iter().map(|l| carried(l, &self.placements)).collect();
        batch.buffer(&self.lights, (first * size_of::<Light>()) as u64, &lights)?;
        batch.finish()?;
        self.revision.fetch_add(1, Ordering::Relaxed);
        Ok(())
    }

    /// Another set 0 with the scene's textures, for a view with a top level of its own.
    ///
    /// # Errors
    /// [`GpuError`] of the device.
    pub fn texture_sets(&self) -> Result<DescriptorSets, GpuError> {
        texture_sets(&self.layout, &self.textures, &self.sampler)
    }

    /// Number of changes so far.
    pub fn revision(&self) -> u32 {
        self.revision.load(Ordering::Relaxed)
    }

    /// Constants of a frame as far as scene and view decide them; the rest is zero.
    pub fn constants(&self, camera: &Camera, size: (u32, u32)) -> FrameConstants {
        let axes = camera.axes();
        let (half_width, half_height) = camera.half_extent(size.0, size.1);
        FrameConstants {
            positions: self.positions.address(),
            attributes: self.attributes.address(),
            triangles: self.triangles.address(),
            materials: self.materials.address(),
            stages: self.stages.address(),
            tc_mods: self.tc_mods.address(),
            deforms: self.deforms.address(),
            fogs: self.fogs.address(),
            fog_planes: self.fog_planes.address(),
            fog_count: self.fog_count,
            portals: self.portals.address(),
            portal_count: self.portal_count,
            rest_vertices: self.rest_vertices.address(),
            dynamic_triangles: self.dynamic_triangles.address(),
            dynamic_triangles_count: self.dynamic_triangles_count,
            first_dynamic_vertex: if self.dynamic_triangles_count > 0 {
                self.first_dynamic_vertex
            } else {
                NONE
            },
            light_filters: u32::from(self.light_filters),
            instances: self.instances.address(),
            lights: self.lights.address(),
            light_nodes: self.light_nodes.address(),
            light_weights: self.light_weights.address(),
            triangle_lights: self.triangle_lights.address(),
            light_cells: self.light_cells.address(),
            cell_entries: self.cell_entries.address(),
            cell_bounds: self.cell_bounds.address(),
            ambient_cubes: self.ambient_cubes.address(),
            ambient_origin: self.ambient.origin,
            ambient_step: self.ambient.step,
            ambient_width: self.ambient.size[0],
            ambient_height: self.ambient.size[1],
            ambient_depth: self.ambient.size[2],
            ambient_constant: self.ambient.constant,
            cell_mask: self.cell_mask,
            finite_lights: self.finite_lights,
            bsp_nodes: self.bsp_nodes.address(),
            textures: self.texture_infos.address(),
            mesh_trees: self.bvh.mesh_trees.address(),
            cwbvh_nodes: self.bvh.cwbvh_nodes.address(),
            cwbvh_triangles: self.bvh.cwbvh_triangles.address(),
            bvh2_nodes: self.bvh.bvh2_nodes.address(),
            bvh2_triangles: self.bvh.bvh2_triangles.address(),
            instance_nodes: self.bvh.instance_nodes.address(),
            srgb: self.srgb_table.address(),
            eye: camera.eye,
            half_width,
            forward: axes.forward.into(),
            half_height,
            right: axes.right.into(),
            up: axes.up.into(),
            size: [size.0, size.1],
            instance_count: self.instance_count,
            instance_root: self.bvh.instance_root,
            all_row: self.all_row,
            ..FrameConstants::default()
        }
    }
}

/// Most textures bound at once.
const MAX_TEXTURES: u32 = 8192;

/// Set 0: the top level (ray queries only) and all textures.
fn scene_set(
    device: &Arc<Device>,
    backend: Backend,
    driver: Option<&DriverStructures>,
    textures: &[Image],
    sampler: &Sampler,
) -> Result<(Arc<DescriptorLayout>, DescriptorSets), GpuError> {
    let count = textures.len() as u32;
    let mut bindings = Vec::new();
    if backend == Backend::RayQuery {
        bindings.push(Binding::one(0, BindingKind::AccelerationStructure));
    }
    bindings.push(Binding::variable(1, BindingKind::Texture, count.max(1)));
    let layout = DescriptorLayout::new(device, "scene", &bindings)?;
    let sets = texture_sets(&layout, textures, sampler)?;
    if let Some(driver) = driver {
        sets.write(0, &[Write::acceleration_structure(0, &driver.top)])?;
    }
    Ok((layout, sets))
}

/// A set 0 with the textures; its top level is still to be written.
fn texture_sets(
    layout: &Arc<DescriptorLayout>,
    textures: &[Image],
    sampler: &Sampler,
) -> Result<DescriptorSets, GpuError> {
    let sets = DescriptorSets::new(layout, 1, textures.len().max(1) as u32)?;
    let sampled: Vec<_> = textures.iter().map(|image| SampledTexture { image, sampler }).collect();
    sets.write(0, &[Write::textures(1, 0, &sampled)])?;
    Ok(sets)
}
