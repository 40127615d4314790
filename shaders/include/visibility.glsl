// Shadow rays, and how the lights' points are sampled. Counterpart of src/reference/visibility.rs.
#ifndef VISIBILITY_GLSL
#define VISIBILITY_GLSL

#include "through.glsl"

// What the layers at t < t_max leave of light.
vec3 filtered(vec3 origin, vec3 direction, float t_max) {
    vec3 share = vec3(1.0);
    float t = 0.0;
    uint triangle = NONE;
    float len = length(direction);
    [[dont_unroll]] for (uint i = 0; i < MOST_LAYERS && share != vec3(0.0); i++) {
        Hit hit = trace_next(origin, direction, t_max, t, triangle);
        if (hit.triangle == NONE) break;
        uint flags = FC.materials.at[FC.triangles.at[hit.triangle].material].flags;
        if ((flags & MATERIAL_LAYER) == 0) break;
        if ((flags & MATERIAL_FILTER) != 0 && hit.t * len >= ON_RECEIVER) {
            share *= min(shaded_hit(hit, direction, 0.0).through, vec3(1.0));
        }
        t = hit.t;
        triangle = hit.triangle;
    }
    return share;
}

// Share of a light sample that reaches a point in front of a surface.
vec3 visible(vec3 origin, LightSample s) {
    // One closest-hit walk would serve both; any-hit ends sooner for the many finite lights.
    vec3 direction = s.target;
    float t_max = RAY_FAR;
    if (!s.sky) {
        direction = s.target - origin;
        t_max = 1.0;
        if (trace_any(origin, direction, t_max)) return vec3(0.0);
    } else {
        Hit hit = trace_closest(origin, direction, RAY_FAR);
        if (hit.triangle == NONE) return vec3(0.0);
        if ((FC.materials.at[FC.triangles.at[hit.triangle].material].flags & MATERIAL_SKY) == 0) return vec3(0.0);
        t_max = hit.t;
    }
    return met_filter ? filtered(origin, direction, t_max) : vec3(1.0);
}

// Lights chosen uniformly are sampled by area, as the thesis does.
uint point_sampling() {
    if (FC.soft_shadows == 0) return POINTS_CENTRE;
    return FC.light_sampling == SAMPLING_UNIFORM ? POINTS_AREA : POINTS_SOLID_ANGLE;
}

#endif
