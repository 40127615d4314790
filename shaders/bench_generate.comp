#version 460
// Rays for `bench rays`: through the pixel centres (RAYS_PRIMARY), or from what those hit to a point on one of the target
// triangles (RAYS_SHADOW), or into the hemisphere with the cosine's density (RAYS_DIFFUSE).
#extension GL_GOOGLE_include_directive : require
#include "prelude.glsl"
#include "random.glsl"
#include "camera.glsl"
#include "bench_rays.glsl"

layout(local_size_x = 64) in;

const float BENCH_FAR = 1e30;
// Distance of new origins from the surface, units: well above the rounding of hit points.
const float SURFACE_OFFSET = 0.05;

#ifndef RAYS_PRIMARY
layout(set = 1, binding = 2, std430) restrict readonly buffer PrimaryRays { vec4 at[]; } primary_rays;
layout(set = 1, binding = 3, std430) restrict readonly buffer PrimaryHits { uvec4 at[]; } primary_hits;
// (first vertex, _) (edge, _) (edge, _)
layout(set = 1, binding = 4, std430) restrict readonly buffer Targets { vec4 at[]; } targets;

// Unit geometric normal in world space.
vec3 world_normal(uint triangle, uint instance) {
    Triangle t = FC.triangles.at[triangle];
    vec3 v0 = FC.positions.at[t.vertices[0]];
    vec3 e1 = FC.positions.at[t.vertices[1]] - v0;
    vec3 e2 = FC.positions.at[t.vertices[2]] - v0;
    Instance i = FC.instances.at[instance];
    if (i.identity == 0) {
        vec3 a = e1, b = e2;
        for (int row = 0; row < 3; row++) {
            e1[row] = dot(i.object_to_world[row].xyz, a);
            e2[row] = dot(i.object_to_world[row].xyz, b);
        }
    }
    return normalize(cross(e1, e2));
}
#endif

void main() {
    uint index = ray_index();
#ifdef RAYS_PRIMARY
    uvec2 local = uvec2(gl_LocalInvocationIndex & 7u, gl_LocalInvocationIndex >> 3);
    uvec2 pixel = gl_WorkGroupID.xy * 8 + local;
    vec3 origin, direction;
    camera_ray(pixel, 0, origin, direction);
    store_ray(index, origin, direction, all(lessThan(pixel, FC.size)) ? BENCH_FAR : -1.0);
#else
    vec3 from = primary_rays.at[index * 2].xyz;
    vec3 arrived = primary_rays.at[index * 2 + 1].xyz;
    uvec4 hit = primary_hits.at[index];
    if (hit.y == NONE) {
        store_ray(index, from, arrived, -1.0);
        return;
    }
    vec3 normal = world_normal(hit.y, hit.z);
    normal = dot(normal, arrived) > 0.0 ? -normal : normal;
    vec3 origin = from + arrived * uintBitsToFloat(hit.x) + normal * SURFACE_OFFSET;
    vec2 u = sample2(SEQUENCE_RANDOM, random_key(FC.seed, index, DIM_LIGHT_POINT), 0);
#ifdef RAYS_SHADOW
    uint pick = pcg(random_key(FC.seed, index, DIM_LIGHT_PICK)) % (uint(targets.at.length()) / 3) * 3;
    vec2 b = sample_triangle_barycentrics(u);
    vec3 way = targets.at[pick].xyz + targets.at[pick + 1].xyz * b.x + targets.at[pick + 2].xyz * b.y - origin;
    float distance = length(way);
    // Short of the target, which is geometry itself.
    store_ray(index, origin, way / max(distance, 1e-6), distance * 0.999);
#else
    vec2 disc = sample_disc(u);
    vec3 side = normalize(abs(normal.x) < 0.5 ? cross(normal, vec3(1, 0, 0)) : cross(normal, vec3(0, 1, 0)));
    vec3 direction = side * disc.x + cross(normal, side) * disc.y + normal * sqrt(max(1.0 - dot(disc, disc), 0.0));
    store_ray(index, origin, normalize(direction), BENCH_FAR);
#endif
#endif
}
