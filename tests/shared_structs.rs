//! The shaders' structures lie in memory as the program's records do: offsets and strides by reflection of the committed
//! SPIR-V against `offset_of!`.

use q3rays::render::bvh_upload::MeshTree;
use q3rays::render::frame_constants::{FrameConstants, Push};
use q3rays::render::reservoirs::Reservoir;
use q3rays::render::strata::Stratum;
use q3rays::scene::records::{
    AmbientCube, BspNode, CellEntry, Deform, DynamicTriangle, Fog, Instance, Light, LightCell, LightNode, LightRow,
    LightRun, Material, Portal, RestVertex, Stage, TcMod, TextureInfo, Triangle, VertexAttributes, Wave,
};
use std::collections::{BTreeMap, HashMap};
use std::mem::offset_of;
use std::path::PathBuf;

// Numbers of the SPIR-V specification, section 3.
const OP_NAME: u32 = 5;
const OP_MEMBER_NAME: u32 = 6;
const OP_TYPE_RUNTIME_ARRAY: u32 = 29;
const OP_TYPE_STRUCT: u32 = 30;
const OP_DECORATE: u32 = 71;
const OP_MEMBER_DECORATE: u32 = 72;
const DECORATION_ARRAY_STRIDE: u32 = 6;
const DECORATION_OFFSET: u32 = 35;
const HEADER_WORDS: usize = 5;

/// What a module says of its types.
#[derive(Default)]
struct Module {
    names: HashMap<u32, String>,
    member_names: HashMap<(u32, u32), String>,
    offsets: HashMap<(u32, u32), usize>,
    strides: HashMap<u32, usize>,
    /// Member types by structure.
    structs: BTreeMap<u32, Vec<u32>>,
    /// Element types of runtime arrays.
    arrays: BTreeMap<u32, u32>,
}

fn text(words: &[u32]) -> String {
    let bytes: Vec<u8> = words
        .iter()
        .flat_map(|w| w.to_le_bytes())
        .take_while(|b| *b != 0)
        .collect();
    String::from_utf8(bytes).unwrap()
}

fn parse(words: &[u32]) -> Module {
    assert_eq!(words[0], 0x0723_0203, "no SPIR-V");
    let mut m = Module::default();
    let mut at = HEADER_WORDS;
    while at < words.len() {
        let (length, op) = ((words[at] >> 16) as usize, words[at] & 0xffff);
        let w = &words[at + 1..at + length];
        match op {
            OP_NAME => drop(m.names.insert(w[0], text(&w[1..]))),
            OP_MEMBER_NAME => drop(m.member_names.insert((w[0], w[1]), text(&w[2..]))),
            OP_MEMBER_DECORATE if w[2] == DECORATION_OFFSET => {
                m.offsets.insert((w[0], w[1]), w[3] as usize);
            }
            OP_DECORATE if w[1] == DECORATION_ARRAY_STRIDE => {
                m.strides.insert(w[0], w[2] as usize);
            }
            OP_TYPE_STRUCT => drop(m.structs.insert(w[0], w[1..].to_vec())),
            OP_TYPE_RUNTIME_ARRAY => drop(m.arrays.insert(w[0], w[1])),
            _ => {}
        }
        at += length;
    }
    m
}

/// A record: its name, its size, and its members' names and offsets in order.
struct Record {
    name: &'static str,
    size: usize,
    members: Vec<(&'static str, usize)>,
}

macro_rules! record {
    ($type:ident { $($member:ident),* $(,)? }) => {{
        // A member that is left out would be left unchecked: taking the record apart names them all.
        let _ = |r: $type| { let $type { $($member: _),* } = r; };
        Record {
            name: stringify!($type),
            size: size_of::<$type>(),
            members: vec![$((stringify!($member), offset_of!($type, $member))),*],
        }
    }};
}

fn records() -> Vec<Record> {
    vec![
        record!(VertexAttributes {
            normal,
            uv,
            lightmap_uv,
            color
        }),
        record!(Triangle {
            vertices,
            material,
            surface,
            fallback_row
        }),
        record!(Material {
            texture,
            flags,
            alpha_scale,
            alpha_offset,
            emission,
            shown,
            emission_texture,
            sky,
            first_stage,
            stage_count,
            alpha_stage,
            sky_scale,
            cloud_height,
            first_deform,
            deform_count,
            ior,
            lobe
        }),
        record!(Wave {
            function,
            base,
            amplitude,
            phase,
            rate
        }),
        record!(Deform {
            kind,
            rate,
            a,
            b,
            direction,
            wave
        }),
        record!(Portal {
            surface,
            mirror,
            there,
            back
        }),
        record!(Fog {
            colour,
            density,
            first_plane,
            plane_count
        }),
        record!(RestVertex {
            position,
            normal,
            quad,
            material,
            instance
        }),
        record!(DynamicTriangle { triangle, cwbvh, bvh2 }),
        record!(TcMod {
            kind,
            rates,
            matrix,
            offset,
            wave
        }),
        record!(Stage {
            textures,
            frames,
            frame_rate,
            flags,
            source,
            destination,
            rgb_source,
            alpha_source,
            tc_gen,
            rgb,
            alpha,
            rgb_wave,
            alpha_wave,
            tc_vectors,
            first_mod,
            mod_count
        }),
        record!(Instance {
            object_to_world,
            world_to_object,
            old_object_to_world,
            first_triangle,
            mesh,
            identity,
            moves,
            seen_by
        }),
        record!(Light {
            kind,
            flags,
            triangle,
            material,
            p0,
            size,
            p1,
            instance,
            p2,
            padding,
            radiance,
            scale
        }),
        record!(BspNode { normal, dist, children }),
        record!(LightRow {
            first_run,
            run_count,
            light_count,
            weight,
        }),
        record!(AmbientCube { axes, open }),
        record!(LightCell {
            row,
            place,
            first,
            count
        }),
        record!(CellEntry {
            first_light,
            light_count,
            probability,
            weight
        }),
        record!(Reservoir {
            position,
            shading_normal,
            geometric_normal,
            row,
            light,
            weight,
            point,
            count,
            target
        }),
        record!(LightRun {
            first_light,
            count,
            before,
            weight_before,
        }),
        record!(LightNode {
            centre,
            cos_cone,
            half_size,
            front,
            axis,
            first,
            count,
            right,
        }),
        record!(TextureInfo { width, height, levels }),
        record!(MeshTree {
            cwbvh_node,
            cwbvh_triangle,
            bvh2_node,
            bvh2_triangle,
            bvh2_root,
            first_triangle,
            opaque_count,
            padding
        }),
        record!(Stratum {
            position,
            shading_normal,
            geometric_normal,
            row,
            instance,
            address,
            sample_index,
            light,
            point,
            weight,
            luminance
        }),
        record!(FrameConstants {
            positions,
            attributes,
            triangles,
            materials,
            stages,
            tc_mods,
            deforms,
            rest_vertices,
            fogs,
            fog_planes,
            portals,
            dynamic_triangles,
            instances,
            lights,
            guest_lights,
            bsp_nodes,
            light_rows,
            light_runs,
            light_nodes,
            light_weights,
            light_cells,
            cell_entries,
            cell_bounds,
            ambient_cubes,
            textures,
            mesh_trees,
            cwbvh_nodes,
            cwbvh_triangles,
            bvh2_nodes,
            bvh2_triangles,
            instance_nodes,
            reservoirs,
            reservoir_history,
            strata,
            counters,
            secondary_pixels,
            triangle_lights,
            exposure,
            focus,
            srgb,
            eye,
            half_width,
            forward,
            half_height,
            right,
            aperture,
            up,
            cone,
            old_eye,
            old_half_width,
            old_forward,
            old_half_height,
            old_right,
            reuse_history,
            old_up,
            reuse_neighbours,
            ambient_origin,
            ambient,
            ambient_step,
            ambient_width,
            ambient_constant,
            ambient_height,
            size,
            seed,
            sequence,
            instance_count,
            instance_root,
            all_row,
            cull_lights,
            random_lights,
            light_sampling,
            light_candidates,
            least_candidates,
            old_least_candidates,
            finite_lights,
            soft_shadows,
            antialiasing,
            illumination,
            tonemap,
            view,
            fixed_exposure,
            exposure_blend,
            cell_mask,
            ambient_depth,
            jitter,
            old_jitter,
            denoised,
            taa,
            history,
            still,
            least_alpha,
            taa_gamma,
            fireflies,
            reservoirs_used,
            changed,
            filter_levels,
            clock,
            choose_layers,
            light_filters,
            shown_emission,
            moving,
            old_clock,
            first_dynamic_vertex,
            dynamic_triangles_count,
            fog_count,
            portal_count,
            max_depth,
            secondary,
            glossy,
            branches_off,
            branch_share,
            guest_count,
            draw_sun,
            secondary_levels,
            white,
            solo_light,
            light_term
        }),
        record!(Push {
            frame,
            sample_index,
            accumulated,
            level,
            padding
        }),
    ]
}

/// Members that are called otherwise in GLSL, where `texture` is a function.
const RENAMED: [(&str, &str, &str); 1] = [("Material", "texture", "texture_index")];

fn glsl_name(record: &'static str, member: &'static str) -> &'static str {
    let renamed = RENAMED.iter().find(|(r, m, _)| *r == record && *m == member);
    renamed.map_or(member, |(_, _, glsl)| glsl)
}

fn check(file: &str, m: &Module, record: &Record) -> usize {
    // The compiler makes a copy without layout of every structure that is also a local variable.
    let laid_out = m
        .structs
        .iter()
        .filter(|(id, _)| m.names.get(id).is_some_and(|n| n == record.name) && m.offsets.contains_key(&(**id, 0)));
    let mut found = 0;
    for (&id, types) in laid_out {
        found += 1;
        let shader: Vec<(&str, usize)> = (0..types.len() as u32)
            .map(|i| (m.member_names[&(id, i)].as_str(), m.offsets[&(id, i)]))
            .collect();
        let program: Vec<(&str, usize)> = record
            .members
            .iter()
            .map(|(member, offset)| (glsl_name(record.name, member), *offset))
            .collect();
        assert_eq!(shader, program, "{file}: {}", record.name);
        for (array, _) in m.arrays.iter().filter(|(_, element)| **element == id) {
            assert_eq!(m.strides[array], record.size, "{file}: elements of {}", record.name);
        }
    }
    found
}

#[test]
fn records_lie_in_memory_as_the_shaders_read_them() {
    let folder = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("shaders/spirv");
    let mut files: Vec<PathBuf> = std::fs::read_dir(folder).unwrap().map(|e| e.unwrap().path()).collect();
    // The shaders of tests/gpu.rs have push constants of their own.
    files.retain(|p| p.file_name().is_some_and(|n| !n.to_string_lossy().starts_with("test_")));
    files.sort();
    let records = records();
    let mut found = vec![0; records.len()];
    for path in &files {
        let file = path.file_name().unwrap().to_string_lossy().into_owned();
        let bytes = std::fs::read(path).unwrap();
        let words: Vec<u32> = bytes.chunks_exact(4).map(bytemuck::pod_read_unaligned).collect();
        let module = parse(&words);
        for (record, found) in records.iter().zip(&mut found) {
            *found += check(&file, &module, record);
        }
    }
    for (record, found) in records.iter().zip(&found) {
        println!("{}: {} members, {found} times", record.name, record.members.len());
        assert!(*found > 0, "no shader has {}: nothing was compared", record.name);
    }
}
