// What shading knows of a hit. Counterpart of src/reference/surface.rs.
#ifndef SURFACE_GLSL
#define SURFACE_GLSL

struct SurfaceHit {
    vec3 position;
    vec3 geometric_normal;
    vec3 shading_normal;
    vec2 uv;
    // Level of detail of an image of one texel over those coordinates; -1e30 for full resolution.
    float lod;
    vec3 albedo;
    // Radiance of stages that shine by themselves; of a sky, all that is seen.
    vec3 glow;
    // Share of what is behind that shows through.
    vec3 through;
    // Share of what it reflects as a mirror or in its lobe; until layers.glsl has looked at it, at normal incidence.
    vec3 specular;
    uint material;
    uint triangle;
    bool front;
    uint cluster;
    uint row;
};

vec3 point_to_world(Instance i, vec3 p) {
    if (i.identity == 1) return p;
    return vec3(dot(i.object_to_world[0], vec4(p, 1.0)), dot(i.object_to_world[1], vec4(p, 1.0)),
                dot(i.object_to_world[2], vec4(p, 1.0)));
}

vec3 normal_to_world(Instance i, vec3 n) {
    if (i.identity == 1) return n;
    return i.world_to_object[0].xyz * n.x + i.world_to_object[1].xyz * n.y + i.world_to_object[2].xyz * n.z;
}

vec3 offset_point(vec3 p, vec3 normal) {
    float scale = max(max(abs(p.x), abs(p.y)), abs(p.z)) * (1.0 / 262144.0);
    return p + normal * max(scale, 1.0 / 1024.0);
}

// Cluster at a point, NONE in solid.
uint cluster_at(vec3 point) {
    int at = 0;
    do {
        BspNode node = FC.bsp_nodes.at[at];
        float side = dot(node.normal, point) - node.dist;
        at = node.children[side < 0.0 ? 1 : 0];
    } while (at >= 0);
    return at == -1 ? NONE : uint(-2 - at);
}

const float NUDGES[5] = float[5](0.25, 1.0, 4.0, 8.0, 16.0);

uint classify(vec3 position, vec3 normal) {
    [[dont_unroll]] for (int i = 0; i < 5; i++) {
        uint cluster = cluster_at(position + normal * NUDGES[i]);
        if (cluster != NONE) return cluster;
    }
    return NONE;
}

const float FULL_RESOLUTION = -1e30;

// Level of detail, for an image of one texel, whose texel is as wide as the ray's footprint.
float texture_lod(vec3 e1, vec3 e2, vec2 uv0, vec2 uv1, vec2 uv2, float width, float cosine) {
    float world_area = length(cross(e1, e2));
    vec2 t1 = uv1 - uv0;
    vec2 t2 = uv2 - uv0;
    float texel_area = abs(t1.x * t2.y - t1.y * t2.x);
    float ratio = texel_area / max(world_area, 1.17549435e-38);
    return 0.5 * log2(max(ratio, 1.17549435e-38)) + log2(max(width / max(abs(cosine), 1e-3), 1.17549435e-38));
}

// The same for an image of more texels. Known to be 0 where lights are sampled: the compiler drops what blends levels.
float lod_of(uint index, float lod) {
    if (lod <= FULL_RESOLUTION) return 0.0;
    TextureInfo info = FC.textures.at[index];
    return lod + 0.5 * log2(float(info.width * info.height));
}

// A point of which only texture, level of detail and place are known.
Point point_on_texture(vec2 uv, float lod, vec3 position, vec3 to_viewer) {
    Point p;
    p.uv = uv;
    p.lightmap_uv = uv;
    p.colour = vec4(1.0);
    p.position = position;
    p.normal = to_viewer;
    p.to_viewer = to_viewer;
    p.distance = 0.0;
    p.lod = lod;
    return p;
}

#include "sky.glsl"

// A hit as far as geometry and material go; `cluster` and `row` are left to `locate`. `cone`: width of the eye ray's cone at
// distance 1, 0 for full-resolution textures. `travelled`: way before this ray.
SurfaceHit shaded_hit(Hit hit, vec3 direction, float cone, float travelled) {
    SurfaceHit s;
    Instance instance = FC.instances.at[hit.instance];
    Triangle t = FC.triangles.at[hit.triangle];
    vec3 a = FC.positions.at[t.vertices[0]];
    vec3 b = FC.positions.at[t.vertices[1]];
    vec3 c = FC.positions.at[t.vertices[2]];
    VertexAttributes va = FC.attributes.at[t.vertices[0]];
    VertexAttributes vb = FC.attributes.at[t.vertices[1]];
    VertexAttributes vc = FC.attributes.at[t.vertices[2]];
    float b1 = hit.barycentrics.x;
    float b2 = hit.barycentrics.y;
    float b0 = 1.0 - b1 - b2;
    s.position = point_to_world(instance, a * b0 + b * b1 + c * b2);
    s.geometric_normal = normalize(normal_to_world(instance, cross(b - a, c - a)));
    vec3 interpolated = normal_to_world(instance, va.normal * b0 + vb.normal * b1 + vc.normal * b2);
    float len = length(interpolated);
    s.shading_normal = len > 0.0 ? interpolated / len : s.geometric_normal;
    if (dot(s.shading_normal, s.geometric_normal) < 0.0) s.shading_normal = s.geometric_normal;
    s.front = dot(s.geometric_normal, direction) <= 0.0;
    if (!s.front) {
        s.geometric_normal = -s.geometric_normal;
        s.shading_normal = -s.shading_normal;
    }
    s.uv = va.uv * b0 + vb.uv * b1 + vc.uv * b2;
    s.material = t.material;
    s.triangle = hit.triangle;
    s.albedo = vec3(0.0);
    s.glow = vec3(0.0);
    s.through = vec3(0.0);
    s.specular = vec3(0.0);
    s.cluster = NONE;
    s.row = t.fallback_row;
    Material material = FC.materials.at[t.material];
    bool sky = (material.flags & MATERIAL_SKY) != 0;
    float d = length(direction);
    s.lod = FULL_RESOLUTION;
    if (cone > 0.0) {
        float width = cone * (1.0 + travelled / hit.t) * hit.t * d;
        float cosine = dot(s.geometric_normal, direction) / d;
        s.lod = texture_lod(b - a, c - a, va.uv, vb.uv, vc.uv, width, cosine);
    }
    if ((material.flags & MATERIAL_STAGES) != 0) {
        Point p;
        p.uv = s.uv;
        p.lightmap_uv = va.lightmap_uv * b0 + vb.lightmap_uv * b1 + vc.lightmap_uv * b2;
        p.colour = unpackUnorm4x8(va.color) * b0 + unpackUnorm4x8(vb.color) * b1 + unpackUnorm4x8(vc.color) * b2;
        p.position = s.position;
        p.normal = s.shading_normal;
        p.to_viewer = -direction / d;
        p.distance = hit.t * d;
        p.lod = s.lod;
        if (sky) p = cloud_point(material, sky_direction(direction / d), cone);
        Shade shaded = shade(material, p, FC.glossy != 0 && !sky);
        if (sky) {
            s.glow = sky_seen(material, direction, cone, shaded);
            return s;
        }
        s.albedo = shaded.albedo;
        s.glow = shaded.glow;
        s.through = shaded.through;
        s.specular = shaded.specular;
        return s;
    }
    if (sky) {
        s.glow = sky_seen(material, direction, cone, Shade(vec3(0.0), vec3(0.0), vec3(1.0), vec3(0.0)));
        return s;
    }
    float lod = lod_of(material.texture_index, s.lod);
    s.albedo = sample_texture(material.texture_index, s.uv, lod, (material.flags & MATERIAL_CLAMP) != 0).rgb;
    return s;
}

// Finds cluster and row of a shaded hit.
void locate(inout SurfaceHit s) {
    if (s.cluster != NONE) return;
    s.cluster = classify(s.position, s.geometric_normal);
    if (s.cluster != NONE) s.row = s.cluster;
}

// Makes a surface reflect all light alike, and nothing else.
void whiten(inout SurfaceHit s) {
    s.albedo = vec3(1.0);
    s.glow = vec3(0.0);
    s.specular = vec3(0.0);
}

// Whether a surface is drawn on the side that a ray meets.
bool drawn(Material material, bool front) {
    return (material.flags & (front ? MATERIAL_NO_FRONT : MATERIAL_BACK)) == (front ? 0 : MATERIAL_BACK);
}

// What a surface emits over its factor at a point of its texture. `lod`: of an image of one texel.
vec3 emission_picture(Material material, vec2 uv, float lod, vec3 position, vec3 direction) {
    if ((material.flags & MATERIAL_MOVING_EMISSION) != 0) {
        return shining(material, point_on_texture(uv, lod, position, -direction));
    }
    if (material.emission_texture == NONE) return vec3(1.0);
    bool clamped = (material.flags & MATERIAL_CLAMP) != 0;
    return sample_texture(material.emission_texture, uv, lod_of(material.emission_texture, lod), clamped).rgb;
}

// Radiance that a surface emits at a point of its texture towards -direction, from the side that emits: what lights are
// sampled with.
vec3 emitted(Material material, vec2 uv, vec3 position, vec3 direction) {
    if ((material.flags & MATERIAL_SKY) != 0) return sky_radiance(material, direction);
    if (material.emission == vec3(0.0)) return vec3(0.0);
    return material.emission * emission_picture(material, uv, FULL_RESOLUTION, position, direction);
}

// What a light of a material is to the eye over what it lights with.
vec3 shown_over_lit(Material material) {
    if (FC.shown_emission != 0) return vec3(1.0);
    bool pictured = (material.flags & MATERIAL_SKY) != 0 && (material.flags & (MATERIAL_SKY_BOX | MATERIAL_STAGES)) != 0;
    vec3 lit = pictured ? material.sky_scale : material.emission;
    return mix(material.shown / lit, vec3(0.0), lessThanEqual(lit, vec3(0.0)));
}

// Radiance that a ray receives from a surface it hits, but for the light that the surface reflects.
vec3 emission_seen(SurfaceHit s, vec3 direction) {
    Material material = FC.materials.at[s.material];
    if ((material.flags & MATERIAL_SKY) != 0) return s.glow;
    vec3 factor = FC.shown_emission == 0 ? material.shown : material.emission;
    bool emits = s.front || (material.flags & (MATERIAL_TWO_SIDED_EMISSION | MATERIAL_LAYER)) != 0;
    if (!emits || factor == vec3(0.0)) return s.glow;
    return s.glow + factor * emission_picture(material, s.uv, s.lod, s.position, direction);
}

#endif
