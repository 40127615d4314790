#version 460
// One ray per invocation; writes instance custom index, geometry, primitive (or ~0) and the bits of t.
#extension GL_EXT_ray_query : require
#extension GL_EXT_buffer_reference : require
#extension GL_EXT_scalar_block_layout : require

struct Ray { vec3 origin; float t_min; vec3 direction; float t_max; };
layout(buffer_reference, scalar) readonly buffer Rays { Ray ray[]; };
layout(buffer_reference, scalar) writeonly buffer Hits { uvec4 hit[]; };
layout(local_size_x = 32) in;
layout(set = 0, binding = 0) uniform accelerationStructureEXT scene;
layout(push_constant, scalar) uniform Push { Rays rays; Hits hits; uint count; uint mask; };

void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i >= count) return;
    Ray ray = rays.ray[i];
    rayQueryEXT query;
    rayQueryInitializeEXT(query, scene, gl_RayFlagsOpaqueEXT, mask, ray.origin, ray.t_min, ray.direction, ray.t_max);
    while (rayQueryProceedEXT(query)) {}
    uvec4 hit = uvec4(~0u);
    if (rayQueryGetIntersectionTypeEXT(query, true) == gl_RayQueryCommittedIntersectionTriangleEXT) {
        hit.x = uint(rayQueryGetIntersectionInstanceCustomIndexEXT(query, true));
        hit.y = uint(rayQueryGetIntersectionGeometryIndexEXT(query, true));
        hit.z = uint(rayQueryGetIntersectionPrimitiveIndexEXT(query, true));
        hit.w = floatBitsToUint(rayQueryGetIntersectionTEXT(query, true));
    }
    hits.hit[i] = hit;
}
