#version 460
// Deform stage: dynamic triangles where the clock has them, in the scene's vertices and in both trees' own orders.
#extension GL_GOOGLE_include_directive : require
#include "prelude.glsl"
#include "program.glsl"
#include "deform.glsl"

layout(local_size_x = 64) in;

layout(buffer_reference, scalar, buffer_reference_align = 4) buffer WritePositions { vec3 at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) buffer WriteAttributes { VertexAttributes at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 16) buffer WriteFloats4 { vec4 at[]; };

void main() {
    uint index = gl_GlobalInvocationID.x;
    if (index >= FC.dynamic_triangles_count) return;
    DynamicTriangle t = FC.dynamic_triangles.at[index];
    vec3 p[3];
    for (uint i = 0; i < 3; i++) {
        uint vertex = FC.triangles.at[t.triangle].vertices[i];
        // Triangles that share a vertex write the same to it.
        Moved v = deformed(vertex, false);
        p[i] = v.position;
        WritePositions(FC.positions).at[vertex] = v.position;
        WriteAttributes(FC.attributes).at[vertex].normal = v.normal;
    }
    vec3 e1 = p[1] - p[0], e2 = p[2] - p[0];
    // The identity of the triangle stands beside its first corner and stays.
    WriteFloats4 wide = WriteFloats4(FC.cwbvh_triangles);
    WriteFloats4 binary = WriteFloats4(FC.bvh2_triangles);
    wide.at[t.cwbvh * 3].xyz = p[0];
    wide.at[t.cwbvh * 3 + 1].xyz = e1;
    wide.at[t.cwbvh * 3 + 2].xyz = e2;
    binary.at[t.bvh2 * 3].xyz = p[0];
    binary.at[t.bvh2 * 3 + 1].xyz = e1;
    binary.at[t.bvh2 * 3 + 2].xyz = e2;
}
