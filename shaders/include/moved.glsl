// Where what moves was in the frame before, and where what was there is now.
#ifndef MOVED_GLSL
#define MOVED_GLSL

#include "deform.glsl"

// A point of a mesh in world space.
vec3 placed(vec4 rows[3], vec3 corners[3], vec2 b) {
    vec4 q = vec4(corners[0] * (1.0 - b.x - b.y) + corners[1] * b.x + corners[2] * b.y, 1.0);
    return vec3(dot(rows[0], q), dot(rows[1], q), dot(rows[2], q));
}

// Where a point was in the frame before.
vec3 old_position_of(Instance i, Hit hit) {
    Triangle t = FC.triangles.at[hit.triangle];
    vec3 p[3];
    for (uint k = 0; k < 3; k++) {
        uint vertex = t.vertices[k];
        p[k] = vertex >= FC.first_dynamic_vertex ? deformed(vertex, true).position
                                                 : FC.positions.at[vertex];
    }
    return placed(i.old_object_to_world, p, hit.barycentrics);
}

// Where it is in this one.
vec3 position_of(Instance i, Hit hit) {
    Triangle t = FC.triangles.at[hit.triangle];
    vec3 p[3] = vec3[3](FC.positions.at[t.vertices[0]], FC.positions.at[t.vertices[1]], FC.positions.at[t.vertices[2]]);
    return placed(i.object_to_world, p, hit.barycentrics);
}

// Whether the triangle's vertices move by themselves.
bool deforms(uint triangle) {
    return FC.triangles.at[triangle].vertices[0] >= FC.first_dynamic_vertex;
}

// Takes a point of the frame before along with its instance.
void take_along(Instance i, inout SurfaceHit at) {
    // One that could move but stands leaves the point exactly where it is: an inverse would to rounding.
    if (i.object_to_world == i.old_object_to_world) return;
    mat4 before = transpose(mat4(i.old_object_to_world[0], i.old_object_to_world[1], i.old_object_to_world[2], vec4(0.0, 0.0, 0.0, 1.0)));
    mat4x3 now = transpose(mat3x4(i.object_to_world[0], i.object_to_world[1], i.object_to_world[2]));
    at.position = now * (inverse(before) * vec4(at.position, 1.0));
    // They turn and scale evenly.
    mat3 turn = mat3(now) * transpose(mat3(before));
    at.shading_normal = normalize(turn * at.shading_normal);
    at.geometric_normal = normalize(turn * at.geometric_normal);
}

#endif
