//! What shading knows of a hit. Counterpart of `shaders/include/surface.glsl`.

use super::texture::{sample, uv_at};
use super::trace::{Hit, Tracer, point_to_world};
use crate::scene::Scene;
use crate::scene::clusters::{NUDGES, cluster_at};
use crate::scene::records::{
    Instance, MATERIAL_CLAMP, MATERIAL_SKY, MATERIAL_SKY_BOX, MATERIAL_TWO_SIDED_EMISSION, Material, NONE,
};
use glam::{Vec2, Vec3, Vec4Swizzles};

/// A point to be shaded, wherever the ray that found it came from.
#[derive(Clone, Copy, Debug)]
pub struct SurfaceHit {
    pub position: Vec3,
    /// Unit geometric normal on the side of the ray's origin.
    pub geometric_normal: Vec3,
    /// Unit interpolated normal, same side.
    pub shading_normal: Vec3,
    pub uv: Vec2,
    /// Linear reflectance.
    pub albedo: Vec3,
    pub material: u32,
    pub triangle: u32,
    /// The ray met the side that the surface's normals point to.
    pub front: bool,
    /// PVS cluster, or [`NONE`] in solid.
    pub cluster: u32,
    /// Row of the light lists.
    pub row: u32,
}

fn normal_to_world(instance: &Instance, n: Vec3) -> Vec3 {
    if instance.identity == 1 {
        return n;
    }
    // Inverse transpose: columns of world-to-object.
    let m = &instance.world_to_object;
    let column = |i: usize| m[0][i] * n.x + m[1][i] * n.y + m[2][i] * n.z;
    Vec3::new(column(0), column(1), column(2))
}

/// A point moved off its surface far enough that rounding cannot put it behind: 2⁻¹⁸ of its largest coordinate, 2⁻¹⁰
/// units at least.
pub fn offset_point(p: Vec3, normal: Vec3) -> Vec3 {
    let scale = p.abs().max_element() * (1.0 / 262_144.0);
    p + normal * scale.max(1.0 / 1024.0)
}

/// Cluster and light row of a receiver.
pub fn classify(scene: &Scene, position: Vec3, normal: Vec3, fallback_row: u32) -> (u32, u32) {
    for nudge in NUDGES {
        if let Some(cluster) = cluster_at(&scene.bsp_nodes, position + normal * nudge) {
            return (cluster, cluster);
        }
    }
    (NONE, fallback_row)
}

/// Level of detail whose texel is as wide as the ray's footprint. `width`: of the ray's cone at the hit, units.
fn texture_lod(corners: [Vec3; 3], uvs: [Vec2; 3], size: Vec2, width: f32, cosine: f32) -> f32 {
    let world_area = (corners[1] - corners[0]).cross(corners[2] - corners[0]).length();
    let (e1, e2) = ((uvs[1] - uvs[0]) * size, (uvs[2] - uvs[0]) * size);
    let texel_area = (e1.x * e2.y - e1.y * e2.x).abs();
    let ratio = texel_area / world_area.max(f32::MIN_POSITIVE);
    0.5 * ratio.max(f32::MIN_POSITIVE).log2() + (width / cosine.abs().max(1e-3)).max(f32::MIN_POSITIVE).log2()
}

/// Evaluates the surface at a hit. `cone`: width of the ray's cone at distance 1, 0 for full-resolution textures.
pub fn surface_at(scene: &Scene, tracer: &Tracer, hit: &Hit, direction: Vec3, cone: f32) -> SurfaceHit {
    let instance = &tracer.instances[hit.instance as usize];
    let triangle = scene.geometry.triangles[hit.triangle as usize];
    let corners = scene.geometry.corners(hit.triangle);
    let [b1, b2] = hit.barycentrics.map(|b| b as f32);
    let b0 = 1.0 - b1 - b2;
    let position = point_to_world(instance, corners[0] * b0 + corners[1] * b1 + corners[2] * b2);
    let cross = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
    let mut geometric = normal_to_world(instance, cross).normalize();
    let normals = triangle
        .vertices
        .map(|v| Vec3::from(scene.geometry.attributes[v as usize].normal));
    let interpolated = normal_to_world(instance, normals[0] * b0 + normals[1] * b1 + normals[2] * b2);
    let mut shading = interpolated.normalize_or(geometric);
    if shading.dot(geometric) < 0.0 {
        shading = geometric;
    }
    let front = geometric.dot(direction) <= 0.0;
    if !front {
        geometric = -geometric;
        shading = -shading;
    }
    let material = &scene.materials[triangle.material as usize];
    let texture = &scene.textures[material.texture as usize];
    let uv = uv_at(scene, hit.triangle, [b1, b2]);
    let lod = if cone > 0.0 {
        let uvs = triangle
            .vertices
            .map(|v| Vec2::from(scene.geometry.attributes[v as usize].uv));
        let width = cone * hit.t as f32 * direction.length();
        let cosine = geometric.dot(direction) / direction.length();
        texture_lod(
            corners,
            uvs,
            Vec2::new(texture.width as f32, texture.height as f32),
            width,
            cosine,
        )
    } else {
        0.0
    };
    let albedo = if material.flags & MATERIAL_SKY != 0 {
        Vec3::ZERO
    } else {
        sample(texture, uv, lod, material.flags & MATERIAL_CLAMP != 0).xyz()
    };
    let (cluster, row) = classify(scene, position, geometric, triangle.fallback_row);
    SurfaceHit {
        position,
        geometric_normal: geometric,
        shading_normal: shading,
        uv,
        albedo,
        material: triangle.material,
        triangle: hit.triangle,
        front,
        cluster,
        row,
    }
}

/// Image and texture coordinates of a sky box in a direction; images in the order of `Material::sky`.
fn sky_box_lookup(d: Vec3) -> (usize, Vec2) {
    let a = d.abs();
    // Seen from inside, with z up; the game's right is +x, back +y, left −x, front −y, and the top image continues
    // the right one.
    let (side, s, t, m) = if a.z >= a.x && a.z >= a.y {
        if d.z > 0.0 {
            (4, -d.y, d.x, a.z)
        } else {
            (5, -d.y, -d.x, a.z)
        }
    } else if a.x >= a.y {
        if d.x > 0.0 {
            (0, -d.y, -d.z, a.x)
        } else {
            (1, d.y, -d.z, a.x)
        }
    } else if d.y > 0.0 {
        (2, d.x, -d.z, a.y)
    } else {
        (3, -d.x, -d.z, a.y)
    };
    (side, Vec2::new(s, t) / m * 0.5 + 0.5)
}

/// Radiance of a sky material in a direction.
pub fn sky_radiance(scene: &Scene, material: &Material, direction: Vec3) -> Vec3 {
    let scale = Vec3::from(material.emission);
    if material.flags & MATERIAL_SKY_BOX == 0 {
        return scale;
    }
    let (side, uv) = sky_box_lookup(direction);
    scale * sample(&scene.textures[material.sky[side] as usize], uv, 0.0, true).xyz()
}

/// Radiance that a surface emits at texture coordinates towards `-direction`, from the side that emits.
pub fn emitted(scene: &Scene, material: &Material, uv: Vec2, direction: Vec3) -> Vec3 {
    if material.flags & MATERIAL_SKY != 0 {
        return sky_radiance(scene, material, direction);
    }
    let factor = Vec3::from(material.emission);
    if material.emission_texture == NONE || factor == Vec3::ZERO {
        return factor;
    }
    let texture = &scene.textures[material.emission_texture as usize];
    factor * sample(texture, uv, 0.0, material.flags & MATERIAL_CLAMP != 0).xyz()
}

/// Radiance that a ray along `direction` receives from a surface it hits.
pub fn emission_seen(scene: &Scene, surface: &SurfaceHit, direction: Vec3) -> Vec3 {
    let material = &scene.materials[surface.material as usize];
    let both = MATERIAL_SKY | MATERIAL_TWO_SIDED_EMISSION;
    if surface.front || material.flags & both != 0 {
        emitted(scene, material, surface.uv, direction)
    } else {
        Vec3::ZERO
    }
}
