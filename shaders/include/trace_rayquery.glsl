// Traversal by VK_KHR_ray_query. Geometry 0 of a bottom level is opaque, geometry 1 alpha-tested or a layer.
layout(set = 0, binding = 0) uniform accelerationStructureEXT top_level;

uint global_triangle(uint instance, uint geometry, uint primitive) {
    Instance i = FC.instances.at[instance];
    uint first = geometry == 0 ? 0 : FC.mesh_trees.at[i.mesh].opaque_count;
    return i.first_triangle + first + primitive;
}

Hit trace(vec3 origin, vec3 direction, float t_max, bool any) {
    Hit hit;
    hit.triangle = NONE;
    hit.t = t_max;
    rayQueryEXT query;
    uint flags = any ? gl_RayFlagsTerminateOnFirstHitEXT : gl_RayFlagsNoneEXT;
#ifdef TRACE_OPAQUE
    flags |= gl_RayFlagsOpaqueEXT;
#endif
    float t_min = 0.0;
#ifdef TRACE_LAYERS
    // Opaque hits are taken without asking: what lies at the distance of an opaque hit before is left out with it.
    if (meets_layers) t_min = after_opaque ? after_t * 1.0000004 : after_t;
#endif
    rayQueryInitializeEXT(query, top_level, flags, ray_kind, origin, t_min, direction, t_max);
    while (rayQueryProceedEXT(query)) {
        if (rayQueryGetIntersectionTypeEXT(query, false) != gl_RayQueryCandidateIntersectionTriangleEXT) continue;
        uint triangle = global_triangle(uint(rayQueryGetIntersectionInstanceCustomIndexEXT(query, false)),
                                        uint(rayQueryGetIntersectionGeometryIndexEXT(query, false)),
                                        uint(rayQueryGetIntersectionPrimitiveIndexEXT(query, false)));
#ifdef TRACE_LAYERS
        if (meets_layers && !comes_after(rayQueryGetIntersectionTEXT(query, false), triangle)) continue;
#endif
        if (candidate_counts(triangle, rayQueryGetIntersectionBarycentricsEXT(query, false))) {
            rayQueryConfirmIntersectionEXT(query);
        }
    }
    if (rayQueryGetIntersectionTypeEXT(query, true) == gl_RayQueryCommittedIntersectionTriangleEXT) {
        hit.t = rayQueryGetIntersectionTEXT(query, true);
        hit.instance = uint(rayQueryGetIntersectionInstanceCustomIndexEXT(query, true));
        hit.triangle = global_triangle(hit.instance, uint(rayQueryGetIntersectionGeometryIndexEXT(query, true)),
                                       uint(rayQueryGetIntersectionPrimitiveIndexEXT(query, true)));
        hit.barycentrics = rayQueryGetIntersectionBarycentricsEXT(query, true);
    }
    return hit;
}
