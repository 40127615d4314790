// Shadow rays, and how the lights' points are sampled. Counterpart of src/reference/visibility.rs.
#ifndef VISIBILITY_GLSL
#define VISIBILITY_GLSL

// Whether a light sample is seen from a point in front of a surface.
bool visible(vec3 origin, LightSample s) {
    // One closest-hit walk would serve both; any-hit ends sooner for the many finite lights.
    if (!s.sky) return !trace_any(origin, s.target - origin, 1.0);
    Hit hit = trace_closest(origin, s.target, RAY_FAR);
    if (hit.triangle == NONE) return false;
    return (FC.materials.at[FC.triangles.at[hit.triangle].material].flags & MATERIAL_SKY) != 0;
}

// Lights chosen uniformly are sampled by area, as the thesis does.
uint point_sampling() {
    if (FC.soft_shadows == 0) return POINTS_CENTRE;
    return FC.light_sampling == SAMPLING_UNIFORM ? POINTS_AREA : POINTS_SOLID_ANGLE;
}

#endif
