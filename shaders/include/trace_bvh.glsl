// Own traversal: two levels, the lower one per mesh. Instance 0 is the world and stands in world space; the others hang
// in a binary tree over their bounds.

// A reciprocal that is never infinite, so that 0 * infinity cannot spoil slab tests of flat boxes.
vec3 safe_inverse(vec3 d) {
    const float tiny = 1e-20;
    vec3 s = vec3(d.x < 0.0 ? -1.0 : 1.0, d.y < 0.0 ? -1.0 : 1.0, d.z < 0.0 ? -1.0 : 1.0);
    return 1.0 / mix(d, s * tiny, lessThan(abs(d), vec3(tiny)));
}

#ifdef TRACE_BVH2
#define TREE_TRIANGLES FC.bvh2_triangles
#else
#define TREE_TRIANGLES FC.cwbvh_triangles
#endif

const uint NOT_OPAQUE_BIT = 0x80000000u;

// Möller–Trumbore on (v0, id), (e1, _), (e2, _). Accepts both sides.
bool intersect_triangle(vec4 v0, vec3 e1, vec3 e2, vec3 origin, vec3 direction, float t_max, out float t, out vec2 uv) {
    vec3 p = cross(direction, e2);
    float det = dot(e1, p);
    float inverse = 1.0 / det;
    vec3 s = origin - v0.xyz;
    float u = dot(s, p) * inverse;
    vec3 q = cross(s, e1);
    float v = dot(direction, q) * inverse;
    t = dot(e2, q) * inverse;
    uv = vec2(u, v);
    return det != 0.0 && u >= 0.0 && v >= 0.0 && u + v <= 1.0 && t > 0.0 && t <= t_max;
}

// Tests a triangle of a tree's own order; true where the hit is to be kept.
bool test_triangle(uint index, vec3 origin, vec3 direction, inout Hit hit) {
    vec4 v0 = TREE_TRIANGLES.at[index * 3];
    vec4 e1 = TREE_TRIANGLES.at[index * 3 + 1];
    vec4 e2 = TREE_TRIANGLES.at[index * 3 + 2];
    float t;
    vec2 uv;
    if (!intersect_triangle(v0, e1.xyz, e2.xyz, origin, direction, hit.t, t, uv)) return false;
    uint id = floatBitsToUint(v0.w);
    uint triangle = id & ~NOT_OPAQUE_BIT;
#ifdef TRACE_LAYERS
    if (t == hit.t && !(meets_layers && triangle < hit.triangle)) return false;
    if (meets_layers && !comes_after(t, triangle)) return false;
#else
    if (t == hit.t) return false;
#endif
#ifndef TRACE_OPAQUE
    if ((id & NOT_OPAQUE_BIT) != 0 && !candidate_counts(triangle, uv)) return false;
#endif
    hit.t = t;
    hit.triangle = triangle;
    hit.barycentrics = uv;
    return true;
}

#ifdef TRACE_BVH2
#include "trace_bvh2.glsl"
#else
#include "trace_cwbvh.glsl"
#endif

#ifdef TRACE_SINGLE_LEVEL

Hit trace(vec3 origin, vec3 direction, float t_max, bool any) {
    Hit hit;
    hit.triangle = NONE;
    hit.instance = 0;
    hit.t = t_max;
    trace_mesh(FC.mesh_trees.at[0], origin, direction, any, hit);
    return hit;
}

#else

Hit trace(vec3 origin, vec3 direction, float t_max, bool any) {
    Hit hit;
    hit.triangle = NONE;
    hit.t = t_max;
    vec3 inverse = safe_inverse(direction);
    // Pending nodes of the instance tree; a child below zero is an instance.
    int stack[24];
    int top = 0;
    int next_node = FC.instance_count > 1 ? int(FC.instance_root) : 0;
    bool pending = FC.instance_count > 1;
    uint instance = 0;
    if (FC.instance_count == 0) return hit;
    while (true) {
        vec3 o = origin;
        vec3 d = direction;
        Instance i = FC.instances.at[instance];
        if (i.identity == 0) {
            o = vec3(dot(i.world_to_object[0], vec4(origin, 1.0)), dot(i.world_to_object[1], vec4(origin, 1.0)),
                     dot(i.world_to_object[2], vec4(origin, 1.0)));
            d = vec3(dot(i.world_to_object[0].xyz, direction), dot(i.world_to_object[1].xyz, direction),
                     dot(i.world_to_object[2].xyz, direction));
        }
        if ((i.seen_by & ray_kind) != 0 && trace_mesh(FC.mesh_trees.at[i.mesh], o, d, any, hit)) {
            hit.instance = instance;
            if (any) return hit;
        }
        // Walk the instance tree to the next instance that the ray's remaining part may meet.
        bool found = false;
        while (pending) {
            if (next_node < 0) {
                instance = uint(-1 - next_node);
                found = true;
            } else {
                // Two children: (min, ref) (max, _) each.
                uint at = uint(next_node) * 4;
                vec4 lo0 = FC.instance_nodes.at[at];
                vec4 hi0 = FC.instance_nodes.at[at + 1];
                vec4 lo1 = FC.instance_nodes.at[at + 2];
                vec4 hi1 = FC.instance_nodes.at[at + 3];
                vec3 a = (lo0.xyz - origin) * inverse;
                vec3 b = (hi0.xyz - origin) * inverse;
                vec3 c = (lo1.xyz - origin) * inverse;
                vec3 e = (hi1.xyz - origin) * inverse;
                vec3 near0 = min(a, b), far0 = max(a, b), near1 = min(c, e), far1 = max(c, e);
                bool hit0 = max(max(near0.x, near0.y), max(near0.z, 0.0))
                         <= min(min(far0.x, far0.y), min(far0.z, hit.t)) * 1.0000004;
                bool hit1 = max(max(near1.x, near1.y), max(near1.z, 0.0))
                         <= min(min(far1.x, far1.y), min(far1.z, hit.t)) * 1.0000004;
                if (hit1 && top < 24) stack[top++] = floatBitsToInt(lo1.w);
                if (hit0 && top < 24) stack[top++] = floatBitsToInt(lo0.w);
            }
            if (top > 0) {
                next_node = stack[--top];
            } else {
                pending = false;
            }
            if (found) break;
        }
        if (!found) return hit;
    }
    return hit;
}

#endif
