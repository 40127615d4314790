#version 460
// Reuse stage: every pixel's reservoir resampled together with those of some neighbours, and shaded. Its result is what the
// next frame starts from.
//
// Unbiased in the same way as resample.comp, which explains it: here all techniques make samples that are in view of their
// receivers.
#extension GL_GOOGLE_include_directive : require
#define TRACE_LAYERS
#include "prelude.glsl"
#include "random.glsl"
#include "texture.glsl"
#include "trace.glsl"
#include "surface.glsl"
#include "light_sample.glsl"
#include "light_choice.glsl"
#include "gbuffer.glsl"
#include "visibility.glsl"
#include "reservoir.glsl"
#include "ray_counts.glsl"
#include "strata.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

const uint MOST_NEIGHBOURS = 4;
const float LARGEST_RADIUS = 24.0;

// Number of a neighbour's reservoir, NONE where it has no use.
uint neighbour(uvec2 pixel, uint address, uint j, SurfaceHit at, float distance) {
    uvec2 bits = bits2(FC.sequence, random_key(FC.seed, address, DIM_REUSE + 1 + j), sample_index);
    vec2 offset = sample_disc(vec2(unit_float(bits.x), unit_float(bits.y))) * LARGEST_RADIUS;
    ivec2 q = ivec2(floor(vec2(pixel) + 0.5 + offset));
    if (any(lessThan(q, ivec2(0))) || any(greaterThanEqual(q, ivec2(FC.size))) || q == ivec2(pixel)) return NONE;
    uint index = uint(q.y) * FC.size.x + uint(q.x);
    Reservoir other = FC.reservoirs.at[index];
    return other.count > 0.0 && alike(at, distance, other) ? index : NONE;
}

vec3 reuse(uvec2 pixel, float distance, inout Reservoir own, inout uvec2 counts) {
    SurfaceHit at = receiver_of(own);
    uint address = pixel.x + (pixel.y << 16);
    LightPoint point = LightPoint(own.light, own.point);
    float target = own.target;
    float own_count = own.count;
    float sum = own.weight * own.target * own.count;
    uint source = NONE;
    uint neighbours[MOST_NEIGHBOURS];
    uint wanted = min(FC.reuse_neighbours, MOST_NEIGHBOURS);
    [[dont_unroll]] for (uint j = 0; j < wanted; j++) {
        neighbours[j] = neighbour(pixel, address, j, at, distance);
        if (neighbours[j] == NONE) continue;
        Reservoir other = FC.reservoirs.at[neighbours[j]];
        own.count += other.count;
        if (!(other.weight > 0.0)) continue;
        LightPoint candidate = LightPoint(other.light, other.point);
        float t = luminance(sample_point(candidate, at).value);
        float weight = t * other.weight * other.count;
        if (!(weight > 0.0)) continue;
        sum += weight;
        if (independent(address, DIM_REUSE + 1 + MOST_NEIGHBOURS + j) * sum < weight) {
            point = candidate;
            target = t;
            source = j;
        }
    }
    own.weight = 0.0;
    own.light = point.light;
    own.point = point.u;
    own.target = target;
    if (point.light == NONE || !(sum > 0.0)) return vec3(0.0);
    LightSample s = sample_point(point, at);
    float numerator = target;
    float denominator = own_count * target;
    // The first ray asks for the pixel itself, then one for each technique that could have made the sample. Its own sample is
    // known to arrive, but not in which colour.
    vec3 share = vec3(1.0);
    [[dont_unroll]] for (uint k = source == NONE && FC.light_filters == 0 ? 1 : 0; k < 1 + wanted; k++) {
        vec3 origin = offset_point(at.position, at.geometric_normal);
        LightSample asked = s;
        float t = 0.0;
        float count = 0.0;
        if (k > 0) {
            uint j = k - 1;
            if (neighbours[j] == NONE) continue;
            Reservoir other = FC.reservoirs.at[neighbours[j]];
            if (j == source) {
                numerator = other.target;
                denominator += other.count * other.target;
                continue;
            }
            SurfaceHit there = receiver_of(other);
            asked = sample_point(point, there);
            t = luminance(asked.value);
            if (!(t > 0.0)) continue;
            count = other.count;
            origin = offset_point(there.position, there.geometric_normal);
        }
        counts.x++;
        vec3 arrives = visible(origin, asked);
        bool free = arrives != vec3(0.0);
        if (k == 0 && !free) return vec3(0.0);
        if (k == 0) share = arrives;
        if (k > 0 && free) denominator += count * t;
    }
    own.weight = sum / target * (numerator / denominator);
    return s.value * share * own.weight;
}

void main() {
    begin_counting();
    uvec2 pixel = gl_GlobalInvocationID.xy;
    uvec2 counts = uvec2(0);
    if (all(lessThan(pixel, FC.size))) {
        ivec2 p = ivec2(pixel);
        uint index = pixel.y * FC.size.x + pixel.x;
        Reservoir own = FC.reservoirs.at[index];
        vec3 irradiance = vec3(0.0);
        if (own.count > 0.0) irradiance = reuse(pixel, imageLoad(gbuffer_position, p).w, own, counts);
        FC.reservoir_history.at[index] = own;
        imageStore(image_direct, p, vec4(irradiance, 0.0));
        if (stands_for_stratum(pixel)) {
            Stratum kept;
            kept.position = own.position;
            kept.shading_normal = own.shading_normal;
            kept.geometric_normal = own.geometric_normal;
            kept.row = own.count > 0.0 ? own.row : NONE;
            kept.light = own.light;
            kept.point = own.point;
            kept.weight = own.weight;
            keep_stratum(pixel, kept, irradiance);
        }
    }
    end_counting(counts);
}
