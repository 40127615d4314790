#version 460
// Resample stage: light candidates of every pixel, resampled together with what the pixel's surface had in the frame before
// (Bitterli et al. 2020, "Spatiotemporal Reservoir Resampling for Real-Time Ray Tracing with Dynamic Direct Lighting").
//
// Unbiased: the sample that is kept is weighed by the balance heuristic over all techniques that could have made it
// (their section 4.3), with shadow rays where visibility decides about that. Candidates are made without regard to
// visibility, a stored sample is one that was in view of its own receiver.
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

layout(local_size_x = 8, local_size_y = 8) in;

uvec2 random_bits(uint address, uint dimension) {
    return bits2(FC.sequence, random_key(FC.seed, address, dimension), sample_index);
}

// The reservoir that the surface at a point had in the frame before; its count is 0 where there is none.
Reservoir history_at(SurfaceHit at, float distance) {
    Reservoir none;
    none.count = 0.0;
    vec3 to = at.position - FC.old_eye;
    float depth = dot(to, FC.old_forward);
    if (FC.reuse_history == 0 || depth <= 0.0) return none;
    vec2 s = vec2(dot(to, FC.old_right) / FC.old_half_width, dot(to, FC.old_up) / FC.old_half_height) / depth;
    vec2 p = vec2(0.5 + 0.5 * s.x, 0.5 - 0.5 * s.y) * vec2(FC.size);
    if (any(lessThan(p, vec2(0.0))) || any(greaterThanEqual(p, vec2(FC.size)))) return none;
    Reservoir old = FC.reservoir_history.at[uint(p.y) * FC.size.x + uint(p.x)];
    if (old.count <= 0.0 || !alike(at, distance, old)) return none;
    return old;
}

void resample(SurfaceHit at, float distance, uint address, inout Reservoir kept, inout uvec2 counts) {
    Chances chances = chances_at(at);
    uint n = clamp(FC.light_candidates, 1, MAX_CANDIDATES);
    LightPoint point = NO_POINT;
    float target = 0.0;
    float sum = 0.0;
    uint pick = random_bits(address, DIM_CANDIDATE_PICK).x;
    uvec2 u = random_bits(address, DIM_CANDIDATE_POINT);
    [[dont_unroll]] for (uint c = 0; c < n; c++) {
        Choice choice = choose_light(chances, at, stratified(pick, c, n));
        if (choice.light == NONE) continue;
        LightPoint candidate = LightPoint(choice.light, vec2(unit_float(u.x), unit_float(u.y)));
        float t = luminance(sample_point(candidate, at).value);
        if (!(t > 0.0)) continue;
        float weight = t / choice.probability;
        sum += weight;
        if (independent(address, DIM_REUSE_KEEP + c) * sum < weight) {
            point = candidate;
            target = t;
        }
    }
    Reservoir old = history_at(at, distance);
    float old_count = min(old.count, float(FC.reuse_history * n));
    bool from_old = false;
    // The frame before did not know this frame's guests: what it has of its own is another light or the same elsewhere.
    if (old_count > 0.0 && old.weight > 0.0 && old.light < GUEST_LIGHT) {
        LightPoint candidate = LightPoint(old.light, old.point);
        float t = luminance(sample_point(candidate, at).value);
        float weight = t * old.weight * old_count;
        if (weight > 0.0) {
            sum += weight;
            if (independent(address, DIM_REUSE) * sum < weight) {
                point = candidate;
                target = t;
                from_old = true;
            }
        }
    }
    kept.count = float(n) + old_count;
    if (point.light == NONE) return;
    // Shadow rays: from the old receiver, where it might have made the new sample, and from the pixel's own.
    SurfaceHit before = receiver_of(old);
    float old_target = 0.0;
    LightSample seen;
    if (old_count > 0.0 && point.light < GUEST_LIGHT) {
        seen = sample_point(point, before);
        old_target = luminance(seen.value);
    }
    LightSample own = sample_point(point, at);
    bool in_view = false;
    [[dont_unroll]] for (uint ray = old_target > 0.0 && !from_old ? 0 : 1; ray < 2; ray++) {
        LightSample s = own;
        vec3 origin = offset_point(at.position, at.geometric_normal);
        if (ray == 0) {
            s = seen;
            origin = offset_point(before.position, before.geometric_normal);
        }
        counts.x++;
        bool free = visible(origin, s) != vec3(0.0);
        if (ray == 1) in_view = free;
        else if (!free) old_target = 0.0;
    }
    if (!in_view) return;
    float numerator = from_old ? old_target : target;
    float denominator = float(n) * target + old_count * old_target;
    kept.light = point.light;
    kept.point = point.u;
    kept.target = target;
    kept.weight = sum / target * (numerator / denominator);
}

void main() {
    begin_counting();
    uvec2 pixel = gl_GlobalInvocationID.xy;
    uvec2 counts = uvec2(0);
    if (all(lessThan(pixel, FC.size))) {
        ivec2 p = ivec2(pixel);
        vec4 albedo = imageLoad(gbuffer_albedo, p);
        Reservoir kept;
        kept.light = NONE;
        kept.point = vec2(0.0);
        kept.weight = 0.0;
        kept.target = 0.0;
        kept.count = 0.0;
        if (albedo.a > 0.0 && albedo.rgb != vec3(0.0)) {
            vec4 position = imageLoad(gbuffer_position, p);
            uvec4 surface = imageLoad(gbuffer_surface, p);
            kept.position = position.xyz;
            kept.shading_normal = surface.x;
            kept.geometric_normal = surface.y;
            kept.row = surface.w;
            resample(receiver_of(kept), position.w, pixel.x + (pixel.y << 16), kept, counts);
        }
        FC.reservoirs.at[pixel.y * FC.size.x + pixel.x] = kept;
    }
    end_counting(counts);
}
