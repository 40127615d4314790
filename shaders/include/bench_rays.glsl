// Ray and hit buffers of `bench rays`. Work group (x, y) holds the 8 x 8 pixels of that tile, row by row.
#ifndef BENCH_RAYS_GLSL
#define BENCH_RAYS_GLSL

// A ray is (origin, t_max) (direction, 0); t_max < 0 where there is none.
layout(set = 1, binding = 0, std430) restrict buffer Rays { vec4 at[]; } rays;
// (t, triangle, instance, barycentrics); triangle is NONE for a miss.
layout(set = 1, binding = 1, std430) restrict buffer Hits { uvec4 at[]; } hits;

const uint TILE_RAYS = 64;

// Number of this invocation's ray.
uint ray_index() {
    return (gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x) * TILE_RAYS + gl_LocalInvocationIndex;
}

void store_ray(uint index, vec3 origin, vec3 direction, float t_max) {
    rays.at[index * 2] = vec4(origin, t_max);
    rays.at[index * 2 + 1] = vec4(direction, 0.0);
}

#endif
