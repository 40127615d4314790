// Direct light at a receiver: next-event estimation over the lights of its row, all of them or N at random. To be included
// after light_choice.glsl and visibility.glsl. Counterpart of src/reference/direct.rs.
#ifndef DIRECT_LIGHT_GLSL
#define DIRECT_LIGHT_GLSL

#include "luminance.glsl"

// Number of the sample whose random numbers are drawn: the frame's, or the one that is shaded again.
uint drawn_index;

uvec2 random_bits(uint address, uint dimension) {
    return bits2(FC.sequence, random_key(FC.seed, address, dimension), drawn_index);
}

LightSample sampled(uint light, uint dimension, uint address, SurfaceHit at) {
    uvec2 bits = random_bits(address, dimension);
    vec2 u = vec2(unit_float(bits.x), unit_float(bits.y));
    return sample_light(FC.lights.at[light], at, u, point_sampling());
}

vec3 traced(LightSample s, SurfaceHit at, inout uvec2 counts) {
    if (max(s.value.x, max(s.value.y, s.value.z)) <= 0.0) {
        counts.y++;
        return vec3(0.0);
    }
    counts.x++;
    return visible(offset_point(at.position, at.geometric_normal), s) * s.value;
}

// One light resampled from candidates in proportion to what they give without visibility.
vec3 resampled(Chances chances, uint i, uint address, SurfaceHit at, inout uvec2 counts) {
    uint n = clamp(FC.light_candidates, 1, MAX_CANDIDATES);
    LightSample kept = LightSample(vec3(0.0), vec3(0.0), false);
    float kept_target = 0.0;
    float sum = 0.0;
    [[dont_unroll]] for (uint c = i * MAX_CANDIDATES; c < i * MAX_CANDIDATES + n; c++) {
        uvec2 bits = random_bits(address, DIM_CANDIDATE_PICK + c);
        Choice choice = choose_light(chances, at, bits.x);
        if (choice.light == NONE) continue;
        LightSample s = sampled(choice.light, DIM_CANDIDATE_POINT + c, address, at);
        float target = luminance(s.value);
        if (!(target > 0.0)) continue;
        float weight = target / choice.probability;
        sum += weight;
        if (unit_float(bits.y) * sum < weight) {
            kept = s;
            kept_target = target;
        }
    }
    vec3 value = traced(kept, at, counts);
    return kept_target > 0.0 ? value * (sum / (kept_target * float(n))) : vec3(0.0);
}

vec3 direct_light(SurfaceHit at, uint address, inout uvec2 counts) {
    Chances chances = chances_at(at);
    LightRow row = chances.row;
    vec3 sum = vec3(0.0);
    if (FC.random_lights == 0) {
        [[dont_unroll]] for (uint r = 0; r < row.run_count; r++) {
            LightRun run = FC.light_runs.at[row.first_run + r];
            [[dont_unroll]] for (uint light = run.first_light; light < run.first_light + run.count; light++) {
                sum += traced(sampled(light, DIM_EVERY_LIGHT + light, address, at), at, counts);
            }
        }
        return sum;
    }
    float share = 1.0 / float(FC.random_lights);
    [[dont_unroll]] for (uint i = 0; i < FC.random_lights; i++) {
        if (FC.light_sampling == SAMPLING_RESERVOIR) {
            sum += resampled(chances, i, address, at, counts) * share;
            continue;
        }
        Choice choice = choose_light(chances, at, random_bits(address, DIM_LIGHT_PICK + i).x);
        if (choice.light == NONE) continue;
        LightSample s = sampled(choice.light, DIM_LIGHT_POINT + i, address, at);
        sum += traced(s, at, counts) * (share / choice.probability);
    }
    return sum;
}

#endif
