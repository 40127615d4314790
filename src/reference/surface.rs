//! What shading knows of a hit. Counterpart of `shaders/include/surface.glsl`.

use super::program::{Point, cloud_coordinates, shade, shining};
use super::texture::{sample, uv_at};
use super::trace::{Hit, Tracer, point_to_world};
use crate::assets::image::Texture;
use crate::render::settings::ShownEmission;
use crate::scene::Scene;
use crate::scene::blending::Shade;
use crate::scene::clock::Clock;
use crate::scene::clusters::{NUDGES, cluster_at};
use crate::scene::program::UNLIT;
use crate::scene::records::{
    Instance, MATERIAL_BACK, MATERIAL_CLAMP, MATERIAL_LAYER, MATERIAL_MOVING_EMISSION, MATERIAL_NO_FRONT, MATERIAL_SKY,
    MATERIAL_SKY_BOX, MATERIAL_STAGES, MATERIAL_TWO_SIDED_EMISSION, Material, NONE,
};
use glam::{Vec2, Vec3, Vec4, Vec4Swizzles};

/// How far away clouds are where stages ask for a place, units.
const CLOUD_DISTANCE: f32 = 4096.0;

/// A point to be shaded, wherever the ray that found it came from.
#[derive(Clone, Copy, Debug)]
pub struct SurfaceHit {
    pub position: Vec3,
    /// Unit geometric normal on the side of the ray's origin.
    pub geometric_normal: Vec3,
    /// Unit interpolated normal, same side.
    pub shading_normal: Vec3,
    pub uv: Vec2,
    /// Level of detail of an image of one texel over those coordinates; of a sky, over directions. −∞ for full resolution.
    pub lod: f32,
    /// Linear reflectance.
    pub albedo: Vec3,
    /// Radiance of stages that shine by themselves, luxel units.
    pub glow: Vec3,
    /// Share of what is behind that shows through.
    pub through: Vec3,
    /// Share of what it reflects as a mirror or in its lobe; until [`super::layers`] has looked at it, at normal incidence.
    pub specular: Vec3,
    pub material: u32,
    pub triangle: u32,
    /// The ray met the side that the surface's normals point to.
    pub front: bool,
    /// PVS cluster, or [`NONE`] in solid.
    pub cluster: u32,
    /// Row of the light lists.
    pub row: u32,
    pub clock: Clock,
}

impl SurfaceHit {
    /// Makes the surface reflect all light alike, and nothing else.
    pub fn whiten(&mut self) {
        self.albedo = Vec3::ONE;
        self.glow = Vec3::ZERO;
        self.specular = Vec3::ZERO;
    }

    /// A point that receives light, for samplers that look at nothing else.
    pub fn receiver(position: Vec3, normal: Vec3, row: u32) -> Self {
        Self {
            position,
            geometric_normal: normal,
            shading_normal: normal,
            uv: Vec2::ZERO,
            lod: f32::NEG_INFINITY,
            albedo: Vec3::ONE,
            glow: Vec3::ZERO,
            through: Vec3::ZERO,
            specular: Vec3::ZERO,
            material: NONE,
            triangle: NONE,
            front: true,
            cluster: row,
            row,
            clock: Clock::default(),
        }
    }
}

/// Object-space normal to world space, of any length.
pub fn normal_to_world(instance: &Instance, n: Vec3) -> Vec3 {
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

/// Level of detail, for an image of one texel, whose texel is as wide as the ray's footprint. `width`: of the ray's cone at the
/// hit, units.
fn texture_lod(corners: [Vec3; 3], uvs: [Vec2; 3], width: f32, cosine: f32) -> f32 {
    let world_area = (corners[1] - corners[0]).cross(corners[2] - corners[0]).length();
    let (e1, e2) = (uvs[1] - uvs[0], uvs[2] - uvs[0]);
    let texel_area = (e1.x * e2.y - e1.y * e2.x).abs();
    let ratio = texel_area / world_area.max(f32::MIN_POSITIVE);
    0.5 * ratio.max(f32::MIN_POSITIVE).log2() + (width / cosine.abs().max(1e-3)).max(f32::MIN_POSITIVE).log2()
}

/// The same for an image of more texels.
fn lod_of(texture: &Texture, lod: f32) -> f32 {
    lod + 0.5 * ((texture.width * texture.height) as f32).log2()
}

/// A hit as far as geometry goes.
struct Place {
    position: Vec3,
    geometric: Vec3,
    shading: Vec3,
    front: bool,
}

fn place(scene: &Scene, tracer: &Tracer, hit: &Hit, direction: Vec3) -> Place {
    let instance = &tracer.instances[hit.instance as usize];
    let corners = tracer.corners(scene, hit.triangle);
    let [b1, b2] = hit.barycentrics.map(|b| b as f32);
    let b0 = 1.0 - b1 - b2;
    let position = point_to_world(instance, corners[0] * b0 + corners[1] * b1 + corners[2] * b2);
    let cross = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
    let mut geometric = normal_to_world(instance, cross).normalize();
    let normals = tracer.normals(scene, hit.triangle);
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
    Place {
        position,
        geometric,
        shading,
        front,
    }
}

fn colour(code: u32) -> Vec4 {
    Vec4::from_array(code.to_le_bytes().map(|c| f32::from(c) / 255.0))
}

/// Level of detail of the surface's coordinates. `cone` as for [`shade_at`].
fn footprint(scene: &Scene, tracer: &Tracer, place: &Place, hit: &Hit, direction: Vec3, cone: f32) -> f32 {
    if cone <= 0.0 {
        return f32::NEG_INFINITY;
    }
    let vertices = scene.geometry.triangles[hit.triangle as usize].vertices;
    let uvs = vertices.map(|v| Vec2::from(scene.geometry.attributes[v as usize].uv));
    let length = direction.length();
    texture_lod(
        tracer.corners(scene, hit.triangle),
        uvs,
        cone * hit.t as f32 * length,
        place.geometric.dot(direction) / length,
    )
}

fn stage_point(scene: &Scene, place: &Place, hit: &Hit, direction: Vec3, lod: f32) -> Point {
    let triangle = scene.geometry.triangles[hit.triangle as usize];
    let attributes = triangle.vertices.map(|v| scene.geometry.attributes[v as usize]);
    let [b1, b2] = hit.barycentrics.map(|b| b as f32);
    let b0 = 1.0 - b1 - b2;
    let page = attributes.map(|a| Vec2::from(a.lightmap_uv));
    let colours = attributes.map(|a| colour(a.color));
    let length = direction.length();
    Point {
        uv: uv_at(scene, hit.triangle, [b1, b2]),
        lightmap_uv: page[0] * b0 + page[1] * b1 + page[2] * b2,
        colour: colours[0] * b0 + colours[1] * b1 + colours[2] * b2,
        position: place.position,
        normal: place.shading,
        to_viewer: -direction / length,
        distance: hit.t as f32 * length,
        lod,
    }
}

/// What stages look at in a hit, textures at full resolution.
pub fn point_at(scene: &Scene, tracer: &Tracer, hit: &Hit, direction: Vec3) -> Point {
    let place = place(scene, tracer, hit, direction);
    stage_point(scene, &place, hit, direction, f32::NEG_INFINITY)
}

fn shade_of(scene: &Scene, tracer: &Tracer, place: &Place, hit: &Hit, direction: Vec3, lod: f32) -> Shade {
    let triangle = scene.geometry.triangles[hit.triangle as usize];
    let material = &scene.materials[triangle.material as usize];
    if material.flags & MATERIAL_SKY != 0 {
        return Shade {
            albedo: Vec3::ZERO,
            glow: Vec3::ZERO,
            through: Vec3::ZERO,
            specular: Vec3::ZERO,
        };
    }
    if material.flags & MATERIAL_STAGES != 0 {
        let point = stage_point(scene, place, hit, direction, lod);
        return shade(scene, material, &point, tracer.clock, tracer.glossy);
    }
    let texture = &scene.textures[material.texture as usize];
    let lod = lod_of(texture, lod);
    let uv = uv_at(scene, hit.triangle, hit.barycentrics.map(|b| b as f32));
    Shade {
        albedo: sample(texture, uv, lod, material.flags & MATERIAL_CLAMP != 0).xyz(),
        glow: Vec3::ZERO,
        through: Vec3::ZERO,
        specular: Vec3::ZERO,
    }
}

/// What a surface does with light at a hit, textures at full resolution.
pub fn shade_at(scene: &Scene, tracer: &Tracer, hit: &Hit, direction: Vec3) -> Shade {
    let place = place(scene, tracer, hit, direction);
    shade_of(scene, tracer, &place, hit, direction, f32::NEG_INFINITY)
}

/// Evaluates the surface at a hit. `cone`: width of the eye ray's cone at distance 1, 0 for full-resolution textures.
/// `travelled`: way before this ray, units.
pub fn surface_at(scene: &Scene, tracer: &Tracer, hit: &Hit, direction: Vec3, cone: f32, travelled: f32) -> SurfaceHit {
    let place = place(scene, tracer, hit, direction);
    let triangle = scene.geometry.triangles[hit.triangle as usize];
    let sky = scene.materials[triangle.material as usize].flags & MATERIAL_SKY != 0;
    let lod = if sky {
        // Infinitely far away: the way before is nothing.
        cone.log2()
    } else {
        let wide = cone * (1.0 + travelled / hit.t as f32);
        footprint(scene, tracer, &place, hit, direction, wide)
    };
    let shade = shade_of(scene, tracer, &place, hit, direction, lod);
    let (cluster, row) = classify(scene, place.position, place.geometric, triangle.fallback_row);
    SurfaceHit {
        position: place.position,
        geometric_normal: place.geometric,
        shading_normal: place.shading,
        uv: uv_at(scene, hit.triangle, hit.barycentrics.map(|b| b as f32)),
        lod,
        albedo: shade.albedo,
        glow: shade.glow,
        through: shade.through,
        specular: shade.specular,
        material: triangle.material,
        triangle: hit.triangle,
        front: place.front,
        cluster,
        row,
        clock: tracer.clock,
    }
}

/// Whether a surface is drawn on the side that a ray meets.
pub fn drawn(material: &Material, front: bool) -> bool {
    if front {
        material.flags & MATERIAL_NO_FRONT == 0
    } else {
        material.flags & MATERIAL_BACK != 0
    }
}

/// Image of a sky box in a direction, in the order of `Material::sky`, texture coordinates, and what part of the direction's length
/// goes across the image.
fn sky_box_lookup(d: Vec3) -> (usize, Vec2, f32) {
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
    (side, Vec2::new(s, t) / m * 0.5 + 0.5, m / d.length())
}

/// `lod`: over directions.
fn sky_box(scene: &Scene, material: &Material, direction: Vec3, lod: f32) -> Vec3 {
    let (side, uv, across) = sky_box_lookup(direction);
    let texture = &scene.textures[material.sky[side] as usize];
    // The image, as wide as two, stands at distance 1: a cone is as wide as it is far, and stretched where it meets it aslant.
    let lod = lod_of(texture, lod - 1.0 - 2.0 * across.log2());
    sample(texture, uv, lod, true).xyz()
}

/// Texture coordinates of clouds in a direction (unit), and their level of detail. The cloud layer is a dome; below the horizon
/// there is none. `lod`: over directions.
fn clouds_lookup(d: Vec3, height: f32, lod: f32) -> (Vec2, f32) {
    let at = |d: Vec3| cloud_coordinates(Vec3::new(d.x, d.y, d.z.max(0.0)), height);
    let uv = at(d);
    let cone = lod.exp2();
    if cone <= 0.0 {
        return (uv, f32::NEG_INFINITY);
    }
    // Along the horizon and across it; at the zenith, any two.
    let along = Vec3::new(-d.y, d.x, 0.0).normalize_or(Vec3::X);
    let up = d.cross(along);
    let longest = [along, up]
        .map(|side| (at((d + side * cone).normalize()) - uv).length())
        .into_iter()
        .fold(f32::MIN_POSITIVE, f32::max);
    (uv, longest.log2())
}

/// Radiance of a sky material in a direction, as it lights: clouds stand for their mean.
fn sky_radiance(scene: &Scene, material: &Material, direction: Vec3) -> Vec3 {
    let scale = Vec3::from(material.emission);
    if material.flags & (MATERIAL_SKY_BOX | MATERIAL_STAGES) == MATERIAL_SKY_BOX {
        scale * sky_box(scene, material, direction, f32::NEG_INFINITY)
    } else {
        scale
    }
}

/// Radiance of a sky in a direction, as it is seen.
fn sky_seen(scene: &Scene, surface: &SurfaceHit, direction: Vec3, shown: ShownEmission) -> Vec3 {
    let material = &scene.materials[surface.material as usize];
    if material.flags & (MATERIAL_SKY_BOX | MATERIAL_STAGES) == 0 {
        return match shown {
            ShownEmission::Game => material.shown,
            ShownEmission::Radiance => material.emission,
        }
        .into();
    }
    let mut picture = if material.flags & MATERIAL_SKY_BOX != 0 {
        sky_box(scene, material, direction, surface.lod)
    } else {
        Vec3::ZERO
    };
    if material.flags & MATERIAL_STAGES != 0 {
        let d = direction.normalize();
        let (uv, lod) = clouds_lookup(d, material.cloud_height, surface.lod);
        let point = Point {
            distance: CLOUD_DISTANCE,
            ..Point::on_texture(uv, lod, d * CLOUD_DISTANCE, -d)
        };
        let clouds = shade(scene, material, &point, surface.clock, false);
        picture = clouds.albedo + clouds.glow / UNLIT + clouds.through * picture;
    }
    let scale = match shown {
        ShownEmission::Game => material.shown,
        ShownEmission::Radiance => material.sky_scale,
    };
    picture * Vec3::from(scale)
}

/// What a surface emits over its factor at a point of its texture. `lod`: of an image of one texel. `position`: world.
fn emission_picture(
    scene: &Scene,
    material: &Material,
    uv: Vec2,
    lod: f32,
    position: Vec3,
    direction: Vec3,
    clock: Clock,
) -> Vec3 {
    if material.flags & MATERIAL_MOVING_EMISSION != 0 {
        let point = Point::on_texture(uv, lod, position, -direction);
        return shining(scene, material, &point, clock);
    }
    if material.emission_texture == NONE {
        return Vec3::ONE;
    }
    let texture = &scene.textures[material.emission_texture as usize];
    sample(texture, uv, lod_of(texture, lod), material.flags & MATERIAL_CLAMP != 0).xyz()
}

/// Radiance that a surface emits at a point of its texture towards `-direction`, from the side that emits: what lights are
/// sampled with. `position`: world.
pub fn emitted(scene: &Scene, material: &Material, uv: Vec2, position: Vec3, direction: Vec3, clock: Clock) -> Vec3 {
    if material.flags & MATERIAL_SKY != 0 {
        return sky_radiance(scene, material, direction);
    }
    let factor = Vec3::from(material.emission);
    if factor == Vec3::ZERO {
        return factor;
    }
    factor * emission_picture(scene, material, uv, f32::NEG_INFINITY, position, direction, clock)
}

/// Radiance that a ray along `direction` receives from a surface it hits, but for the light that the surface reflects.
pub fn emission_seen(scene: &Scene, surface: &SurfaceHit, direction: Vec3, shown: ShownEmission) -> Vec3 {
    let material = &scene.materials[surface.material as usize];
    if material.flags & MATERIAL_SKY != 0 {
        return sky_seen(scene, surface, direction, shown);
    }
    let emits = surface.front || material.flags & (MATERIAL_TWO_SIDED_EMISSION | MATERIAL_LAYER) != 0;
    let factor = Vec3::from(match shown {
        ShownEmission::Game => material.shown,
        ShownEmission::Radiance => material.emission,
    });
    if !emits || factor == Vec3::ZERO {
        return surface.glow;
    }
    let (uv, lod, position) = (surface.uv, surface.lod, surface.position);
    surface.glow + factor * emission_picture(scene, material, uv, lod, position, direction, surface.clock)
}
