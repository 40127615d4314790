#version 460
// Direct stage: next-event estimation over the lights of the receiver's row, all of them or N at random.
// Counterpart of src/reference/direct.rs.
#extension GL_GOOGLE_include_directive : require
#include "prelude.glsl"
#include "random.glsl"
#include "texture.glsl"
#include "trace.glsl"
#include "surface.glsl"
#include "light_sample.glsl"
#include "light_choice.glsl"
#include "visibility.glsl"
#include "ray_counts.glsl"
#include "gbuffer.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

uvec2 random_bits(uint address, uint dimension) {
    return bits2(FC.sequence, random_key(FC.seed, address, dimension), sample_index);
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
    return visible(offset_point(at.position, at.geometric_normal), s) ? s.value : vec3(0.0);
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

void main() {
    begin_counting();
    uvec2 pixel = gl_GlobalInvocationID.xy;
    uvec2 counts = uvec2(0);
    if (all(lessThan(pixel, FC.size))) {
        ivec2 p = ivec2(pixel);
        vec4 albedo = imageLoad(gbuffer_albedo, p);
        vec3 irradiance = vec3(0.0);
        if (albedo.a > 0.0 && albedo.rgb != vec3(0.0)) {
            uvec4 surface = imageLoad(gbuffer_surface, p);
            SurfaceHit at;
            at.position = imageLoad(gbuffer_position, p).xyz;
            at.shading_normal = unpack_normal(surface.x);
            at.geometric_normal = unpack_normal(surface.y);
            at.material = surface.z;
            at.row = surface.w;
            irradiance = FC.illumination == 0 ? vec3(1.0) : direct_light(at, pixel.x + (pixel.y << 16), counts);
        }
        imageStore(image_direct, p, vec4(irradiance, 0.0));
    }
    end_counting(counts);
}
