// The one interface to the scene's geometry: trace_closest and trace_any. Which backend stands behind it is decided when
// a shader is compiled: TRACE_RAYQUERY (the driver's structures) or TRACE_BVH (own traversal; TRACE_BVH2 selects the
// binary tree, which suits coherent rays, else the compressed 8-wide tree).
#ifndef TRACE_GLSL
#define TRACE_GLSL

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

#ifdef TRACE_RAYQUERY
#include "trace_rayquery.glsl"
#else
#include "trace_bvh.glsl"
#endif

// The nearest hit with 0 < t < t_max.
Hit trace_closest(vec3 origin, vec3 direction, float t_max) {
    return trace(origin, direction, t_max, false);
}

// Whether any hit lies at 0 < t < t_max.
bool trace_any(vec3 origin, vec3 direction, float t_max) {
    return trace(origin, direction, t_max, true).triangle != NONE;
}

#endif
