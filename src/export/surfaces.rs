//! Triangles at a moment, one glTF mesh for all that are alike.

use super::ExportError;
use super::document::Document;
use super::materials::{Emitter, Materials, kind};
use crate::reference::surface::normal_to_world;
use crate::reference::trace::{Tracer, point_to_world};
use crate::scene::Scene;
use crate::scene::records::{
    Instance, LIGHT_TWO_SIDED, MATERIAL_BACK, MATERIAL_FILTER, MATERIAL_NO_FRONT, SEEN_BY_SHADOWS,
};
use glam::Vec3;
use serde_json::json;
use std::collections::BTreeMap;

/// What triangles of one mesh have in common.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Group {
    material: u32,
    emitter: Option<Emitter>,
    /// Rays meet it.
    traced: bool,
}

#[derive(Default)]
struct Triangles {
    positions: Vec<[f32; 3]>,
    normals: Vec<[f32; 3]>,
    uvs: Vec<[f32; 2]>,
}

/// Adds all triangles; returns the nodes.
pub fn add(document: &mut Document, scene: &Scene, tracer: &Tracer) -> Result<Vec<usize>, ExportError> {
    let mut groups: BTreeMap<Group, Triangles> = BTreeMap::new();
    for instance in &tracer.instances {
        // What mirrors alone show, or the eye alone, throws no shadow and is left out.
        if instance.seen_by & SEEN_BY_SHADOWS == 0 {
            continue;
        }
        let mesh = &scene.geometry.meshes[instance.mesh as usize];
        for t in mesh.first_triangle..mesh.first_triangle + mesh.triangle_count {
            collect(&mut groups, scene, tracer, t, Some(instance));
        }
    }
    for t in scene.geometry.untraced.clone() {
        collect(&mut groups, scene, tracer, t, None);
    }
    let mut materials = Materials::new(scene, tracer.clock);
    let mut nodes = Vec::new();
    for (group, triangles) in groups {
        nodes.push(add_group(document, scene, &mut materials, group, &triangles)?);
    }
    Ok(nodes)
}

fn collect(
    groups: &mut BTreeMap<Group, Triangles>,
    scene: &Scene,
    tracer: &Tracer,
    t: u32,
    instance: Option<&Instance>,
) {
    let triangle = scene.geometry.triangles[t as usize];
    let emitter = tracer.light_of(t).map(|number| {
        let light = scene.lights.lights[number as usize];
        Emitter {
            scale: light.scale.to_bits(),
            two_sided: light.flags & LIGHT_TWO_SIDED != 0,
        }
    });
    if instance.is_none() && emitter.is_none() {
        return;
    }
    let group = Group {
        material: triangle.material,
        emitter,
        traced: instance.is_some(),
    };
    let placed = |p: Vec3| instance.map_or(p, |i| point_to_world(i, p));
    let corners = tracer.corners(scene, t).map(placed);
    let cross = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
    if cross.length_squared() <= f32::MIN_POSITIVE || !cross.is_finite() {
        return;
    }
    let face = cross.normalize();
    let normals = tracer.normals(scene, t).map(|n| {
        let turned = instance.map_or(n, |i| normal_to_world(i, n)).normalize_or(face);
        // glTF has no normals that point away from their own face.
        if turned.is_finite() { turned } else { face }
    });
    let out = groups.entry(group).or_default();
    for k in 0..3 {
        out.positions.push(corners[k].into());
        out.normals.push(normals[k].into());
        out.uvs
            .push(scene.geometry.attributes[triangle.vertices[k] as usize].uv);
    }
}

fn add_group(
    document: &mut Document,
    scene: &Scene,
    materials: &mut Materials,
    group: Group,
    triangles: &Triangles,
) -> Result<usize, ExportError> {
    let record = &scene.materials[group.material as usize];
    let name = &scene.material_sources[group.material as usize].name;
    let material = materials.number(document, group.material, group.emitter)?;
    // What is drawn from behind alone is turned about: glTF draws fronts.
    let from_behind = record.flags & (MATERIAL_NO_FRONT | MATERIAL_BACK) == MATERIAL_NO_FRONT | MATERIAL_BACK;
    let indices: Vec<u32> = (0..triangles.positions.len() as u32).collect();
    let attributes = json!({
        "POSITION": document.vectors(&triangles.positions),
        "NORMAL": document.vectors(&triangles.normals),
        "TEXCOORD_0": document.vectors(&triangles.uvs),
    });
    let mesh = json!({
        "name": name,
        "primitives": [{ "attributes": attributes, "indices": document.indices(&indices), "material": material }],
    });
    let mesh = document.push("meshes", mesh);
    let extras = json!({ "q3rays": {
        "kind": kind(record),
        "occludes": group.traced && matches!(kind(record), "opaque" | "alpha_tested" | "sky"),
        "filters_light": record.flags & MATERIAL_FILTER != 0,
        "drawn_front": group.traced && record.flags & MATERIAL_NO_FRONT == 0,
        "drawn_back": group.traced && record.flags & MATERIAL_BACK != 0,
        "seen_from_behind_alone": from_behind,
        "emission": group.emitter.map(|e| materials.emission(group.material, e)),
    } });
    Ok(document.push("nodes", json!({ "name": name, "mesh": mesh, "extras": extras })))
}
