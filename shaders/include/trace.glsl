// The one interface to the scene's geometry. Which backend stands behind it is decided when a shader is compiled:
// TRACE_RAYQUERY (the driver's structures) or TRACE_BVH (own traversal; TRACE_BVH2 selects the binary tree, which suits
// coherent rays, else the compressed 8-wide tree). Counterpart of src/reference/trace.rs.
#ifndef TRACE_GLSL
#define TRACE_GLSL

#include "program.glsl"

struct Hit {
    // In units of the ray's direction vector.
    float t;
    // Global triangle, NONE for a miss.
    uint triangle;
    uint instance;
    // Weights of the second and third vertex.
    vec2 barycentrics;
};

const float RAY_FAR = 3.402823466e38;

// Which instances the ray being traced meets: SEEN_BY_….
uint ray_kind = SEEN_BY_SHADOWS;
// Whether the ray being traced meets layers, too: hits after `after_t`, among coincident triangles after `after_triangle`.
bool meets_layers = false;
float after_t;
uint after_triangle;
bool after_opaque;
// The ray has passed layers that take something from light.
bool met_filter;

// What stages look at in a candidate hit; enough for the alpha test.
Point candidate_point(uint triangle, vec2 barycentrics) {
    Triangle t = FC.triangles.at[triangle];
    VertexAttributes a = FC.attributes.at[t.vertices[0]];
    VertexAttributes b = FC.attributes.at[t.vertices[1]];
    VertexAttributes c = FC.attributes.at[t.vertices[2]];
    vec3 w = vec3(1.0 - barycentrics.x - barycentrics.y, barycentrics);
    Point p;
    p.uv = a.uv * w.x + b.uv * w.y + c.uv * w.z;
    p.lightmap_uv = a.lightmap_uv * w.x + b.lightmap_uv * w.y + c.lightmap_uv * w.z;
    p.colour = unpackUnorm4x8(a.color) * w.x + unpackUnorm4x8(b.color) * w.y + unpackUnorm4x8(c.color) * w.z;
    p.position = FC.positions.at[t.vertices[0]] * w.x + FC.positions.at[t.vertices[1]] * w.y
               + FC.positions.at[t.vertices[2]] * w.z;
    p.normal = vec3(0.0);
    p.to_viewer = vec3(0.0);
    p.distance = 0.0;
    p.lod = -1e30;
    return p;
}

bool alpha_test(Material material, uint triangle, vec2 barycentrics) {
    float alpha;
    if (material.alpha_stage == NONE) {
        bool clamped = (material.flags & MATERIAL_CLAMP) != 0;
        alpha = sample_texture(material.texture_index, uv_at(triangle, barycentrics), 0.0, clamped).a;
    } else {
        alpha = tested_alpha(material, candidate_point(triangle, barycentrics));
    }
    return alpha * material.alpha_scale + material.alpha_offset > 0.0;
}

// Whether a candidate hit of a triangle that is not opaque counts.
bool candidate_counts(uint triangle, vec2 barycentrics) {
    Material material = FC.materials.at[FC.triangles.at[triangle].material];
    if (!meets_layers && (material.flags & MATERIAL_LAYER) != 0) {
        if ((material.flags & MATERIAL_FILTER) != 0) met_filter = true;
        return false;
    }
    return (material.flags & MATERIAL_ALPHA_TESTED) == 0 || alpha_test(material, triangle, barycentrics);
}

bool comes_after(float t, uint triangle) {
    return t > after_t || (t == after_t && triangle > after_triangle);
}

#ifdef TRACE_RAYQUERY
#include "trace_rayquery.glsl"
#else
#include "trace_bvh.glsl"
#endif

// The nearest hit with 0 < t < t_max that is no layer.
Hit trace_closest(vec3 origin, vec3 direction, float t_max) {
    met_filter = false;
    return trace(origin, direction, t_max, false);
}

// Whether any hit but of layers lies at 0 < t < t_max.
bool trace_any(vec3 origin, vec3 direction, float t_max) {
    met_filter = false;
    return trace(origin, direction, t_max, true).triangle != NONE;
}

// Puts a walk through layers, by `trace` with `meets_layers`, before the first hit.
void begin_walk() {
    after_t = 0.0;
    after_triangle = NONE;
    after_opaque = false;
}

// Puts it behind a hit.
void walk_on(Hit hit) {
    after_t = hit.t;
    after_triangle = hit.triangle;
    after_opaque = (FC.materials.at[FC.triangles.at[hit.triangle].material].flags & (MATERIAL_LAYER | MATERIAL_ALPHA_TESTED)) == 0;
}

#endif
