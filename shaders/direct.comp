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
#include "gbuffer.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

shared uint shadow_rays;
shared uint shadow_skipped;

// Number of the k-th light of a row.
uint kth_light(LightRow row, uint k) {
    uint lo = 0;
    uint hi = row.run_count;
    [[dont_unroll]] while (hi - lo > 1) {
        uint mid = (lo + hi) >> 1;
        if (FC.light_runs.at[row.first_run + mid].before <= k) lo = mid; else hi = mid;
    }
    LightRun run = FC.light_runs.at[row.first_run + lo];
    return run.first_light + (k - run.before);
}

bool visible(SurfaceHit at, LightSample s) {
    vec3 origin = offset_point(at.position, at.geometric_normal);
    // One closest-hit walk would serve both; any-hit ends sooner for the many finite lights.
    if (!s.sky) return !trace_any(origin, s.target - origin, 1.0);
    Hit hit = trace_closest(origin, s.target, RAY_FAR);
    if (hit.triangle == NONE) return false;
    return (FC.materials.at[FC.triangles.at[hit.triangle].material].flags & MATERIAL_SKY) != 0;
}

vec3 sample_one(uint light, uint dimension, uint address, SurfaceHit at, inout uvec2 counts) {
    vec2 u = sample2(FC.sequence, random_key(FC.seed, address, dimension), sample_index);
    LightSample s = sample_light(FC.lights.at[light], at, u, FC.soft_shadows != 0);
    if (max(s.value.x, max(s.value.y, s.value.z)) <= 0.0) {
        counts.y++;
        return vec3(0.0);
    }
    counts.x++;
    return visible(at, s) ? s.value : vec3(0.0);
}

vec3 direct_light(SurfaceHit at, uint address, inout uvec2 counts) {
    LightRow row = FC.light_rows.at[FC.cull_lights == 0 ? FC.all_row : at.row];
    vec3 sum = vec3(0.0);
    if (FC.random_lights == 0) {
        [[dont_unroll]] for (uint r = 0; r < row.run_count; r++) {
            LightRun run = FC.light_runs.at[row.first_run + r];
            [[dont_unroll]] for (uint light = run.first_light; light < run.first_light + run.count; light++) {
                sum += sample_one(light, DIM_EVERY_LIGHT + light, address, at, counts);
            }
        }
    } else if (row.light_count > 0) {
        float weight = float(row.light_count) / float(FC.random_lights);
        [[dont_unroll]] for (uint i = 0; i < FC.random_lights; i++) {
            float u = sample2(FC.sequence, random_key(FC.seed, address, DIM_LIGHT_PICK + i), sample_index).x;
            uint k = min(uint(u * float(row.light_count)), row.light_count - 1);
            sum += sample_one(kth_light(row, k), DIM_LIGHT_POINT + i, address, at, counts) * weight;
        }
    }
    return sum;
}

// Adds to a 64-bit counter made of two words.
void count(uint counter, uint amount) {
    uint before = atomicAdd(FC.counters.at[counter * 2], amount);
    if (before + amount < before) atomicAdd(FC.counters.at[counter * 2 + 1], 1);
}

void main() {
    if (gl_LocalInvocationIndex == 0) {
        shadow_rays = 0;
        shadow_skipped = 0;
    }
    barrier();
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
    if (counts.x != 0) atomicAdd(shadow_rays, counts.x);
    if (counts.y != 0) atomicAdd(shadow_skipped, counts.y);
    barrier();
    if (gl_LocalInvocationIndex == 0) {
        if (shadow_rays != 0) count(0, shadow_rays);
        if (shadow_skipped != 0) count(1, shadow_skipped);
    }
}
