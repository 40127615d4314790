#version 460
// Gradient stage of the denoiser: how much the light of a stratum has changed since the frame before. One of that frame's
// pixels is shaded again: the same surface point, where it has moved to, with the same random numbers, where samples are reused
// the same light sample, under this frame's lights. Where nothing has changed the difference is exactly nothing (Schied, Peters
// and Dachsbacher 2018, section 4).
//
// gradient_a: |Δ| of the luminance and the larger of the two, filtered apart; their ratio is the change.
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
#include "guide.glsl"
#include "moved.glsl"
#include "visibility.glsl"
#include "reservoir.glsl"
#include "direct_light.glsl"
#include "gradient.glsl"
#include "ray_counts.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

vec2 change_of(uvec2 stratum, inout uvec2 counts) {
    ivec2 p = ivec2(min(stratum * uint(STRATUM) + 1u, FC.size - 1u));
    vec2 place = vec2(p) + imageLoad(gbuffer_motion, p).xy;
    if (!(all(greaterThanEqual(place, vec2(-0.5))) && all(lessThan(place, vec2(FC.size) - 0.5)))) return vec2(0.0);
    uvec2 strata = strata_size();
    uvec2 old = uvec2(clamp(round(place), vec2(0.0), vec2(FC.size - 1u))) / uint(STRATUM);
    Stratum kept = FC.strata.at[old.y * strata.x + old.x];
    uvec4 object = imageLoad(gbuffer_object, p);
    // Of another surface nothing is learnt about this one.
    if (kept.row == NONE || kept.instance != object.y) return vec2(0.0);
    SurfaceHit at;
    at.position = kept.position;
    at.shading_normal = unpack_normal(kept.shading_normal);
    at.geometric_normal = unpack_normal(kept.geometric_normal);
    // Also where it has moved to another cluster's row: by the same list the same numbers draw the same lights.
    at.row = kept.row;
    Instance instance = FC.instances.at[object.y];
    if (instance.moves != 0) take_along(instance, at);
    if (deforms(object.x)) {
        // As the pixel's point moves; how it turns is not asked.
        Hit seen = Hit(0.0, object.x, object.y, unpackUnorm2x16(object.z));
        at.position = kept.position + (position_of(instance, seen) - old_position_of(instance, seen));
    }
    float now;
    if (FC.reservoirs_used != 0) {
        if (kept.light == NONE || kept.luminance <= 0.0) return vec2(0.0);
        LightSample s = sample_point(LightPoint(kept.light, kept.point), at);
        now = luminance(traced(s, at, counts)) * kept.weight;
    } else {
        drawn_index = kept.sample_index;
        drawn_least = FC.old_least_candidates;
        now = luminance(direct_light(at, kept.address, counts));
    }
    // What one device computes twice from the same numbers is the same but for the order of operations.
    float change = abs(now - kept.luminance);
    float most = max(now, kept.luminance);
    return vec2(change > 1e-3 * most ? change : 0.0, most);
}

void main() {
    begin_counting();
    uvec2 stratum = gl_GlobalInvocationID.xy;
    uvec2 counts = uvec2(0);
    if (all(lessThan(stratum, strata_size()))) {
        vec2 change = change_of(stratum, counts);
        imageStore(gradient_a, ivec2(stratum), vec4(change, 0.0, 0.0));
    }
    end_counting(counts);
}
