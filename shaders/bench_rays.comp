#version 460
// Traversal and nothing else: rays from a buffer, hit records to another.
#extension GL_GOOGLE_include_directive : require
#include "prelude.glsl"
#include "texture.glsl"
#include "trace.glsl"
#include "bench_rays.glsl"

layout(local_size_x = 64) in;

// Any hit instead of the nearest.
layout(constant_id = 0) const bool ANY_HIT = false;

void main() {
    uint index = ray_index();
    vec4 from = rays.at[index * 2];
    vec3 direction = rays.at[index * 2 + 1].xyz;
    Hit hit;
    hit.t = 0.0;
    hit.triangle = NONE;
    hit.instance = NONE;
    hit.barycentrics = vec2(0.0);
    if (from.w > 0.0) hit = trace(from.xyz, direction, from.w, ANY_HIT);
    hits.at[index] = uvec4(floatBitsToUint(hit.t), hit.triangle, hit.instance, packUnorm2x16(hit.barycentrics));
}
