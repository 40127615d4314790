// Shadow rays, and how the lights' points are sampled. Counterpart of src/reference/visibility.rs.
#ifndef VISIBILITY_GLSL
#define VISIBILITY_GLSL

#include "through.glsl"

// Share of a light sample that reaches a point in front of a surface. The blocker is looked for first, then layers that take
// something from the light are walked through, by one and the same call: compilers copy the traversal to every call.
vec3 visible(vec3 origin, LightSample s) {
    vec3 direction = s.sky ? s.target : s.target - origin;
    float t_max = s.sky ? RAY_FAR : 1.0;
    float len = length(direction);
    vec3 share = vec3(1.0);
    bool walks = false;
    met_filter = false;
    begin_walk();
    [[dont_unroll]] for (uint i = 0; i <= MOST_LAYERS; i++) {
        meets_layers = walks;
        // One closest-hit walk would serve both; any-hit ends sooner for the many finite lights.
        Hit hit = trace(origin, direction, t_max, !s.sky && !walks);
        meets_layers = false;
        uint flags = hit.triangle == NONE ? 0 : FC.materials.at[FC.triangles.at[hit.triangle].material].flags;
        if (!walks) {
            if (s.sky ? (flags & MATERIAL_SKY) == 0 : hit.triangle != NONE) return vec3(0.0);
            if (!met_filter) return share;
            if (s.sky) t_max = hit.t;
            walks = true;
            continue;
        }
        if (hit.triangle == NONE || (flags & MATERIAL_LAYER) == 0) break;
        if ((flags & MATERIAL_FILTER) != 0 && hit.t * len >= ON_RECEIVER) {
            share *= min(shaded_hit(hit, direction, 0.0, 0.0).through, vec3(1.0));
        }
        if (share == vec3(0.0)) break;
        walk_on(hit);
    }
    return share;
}

// Lights chosen uniformly are sampled by area, as the thesis does.
uint point_sampling() {
    if (FC.soft_shadows == 0) return POINTS_CENTRE;
    return FC.light_sampling == SAMPLING_UNIFORM ? POINTS_AREA : POINTS_SOLID_ANGLE;
}

#endif
