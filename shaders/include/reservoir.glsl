// Reservoirs of light samples, and reuse of them between pixels and frames.
//
// A sample is a light and the two random numbers of the point on it: it means the same to every receiver, so that handing
// it on needs no Jacobian (reuse in primary sample space, the identity shift of Lin et al. 2022, "Generalized Resampled
// Importance Sampling"). The target of a receiver is the luminance of what the sample gives it without visibility.
#ifndef RESERVOIR_GLSL
#define RESERVOIR_GLSL

#include "luminance.glsl"

struct LightPoint {
    // NONE for no sample.
    uint light;
    vec2 u;
};

const LightPoint NO_POINT = LightPoint(NONE, vec2(0.0));

// A stored reservoir as a candidate for somebody else's: its receiver, and its own sample.
SurfaceHit receiver_of(Reservoir r) {
    SurfaceHit at;
    at.position = r.position;
    at.shading_normal = unpack_normal(r.shading_normal);
    at.geometric_normal = unpack_normal(r.geometric_normal);
    at.row = r.row;
    return at;
}

LightSample sample_point(LightPoint p, SurfaceHit at) {
    return sample_light(light_at(p.light), at, p.u, point_sampling());
}

// A number for a decision between samples. Such numbers must not depend on those of earlier frames, which made the samples
// that are decided between: points of a sequence that is well spread over frames would bias the result.
float independent(uint address, uint dimension) {
    return unit_float(bits2(SEQUENCE_RANDOM, random_key(FC.seed, address, dimension), sample_index).x);
}

// Receivers whose samples are worth having: near each other in space for how far away they are, and facing alike.
const float MOST_OFF_PLANE = 0.02;
const float LEAST_COSINE = 0.9;

bool alike(SurfaceHit at, float distance, Reservoir other) {
    vec3 between = other.position - at.position;
    vec3 normal = unpack_normal(other.geometric_normal);
    return abs(dot(between, at.geometric_normal)) < MOST_OFF_PLANE * distance
        && dot(normal, at.geometric_normal) > LEAST_COSINE;
}

#endif
