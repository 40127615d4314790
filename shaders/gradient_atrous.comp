#version 460
// A level of the filter over gradients: à-trous with (1 2 1) ⊗ (1 2 1) between strata of the same plane. Changes and what they
// are shares of are filtered alike, so that strata without light have no say.
#extension GL_GOOGLE_include_directive : require
#include "prelude.glsl"
#include "gbuffer.glsl"
#include "guide.glsl"
#include "gradient.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

const float LEAST_COSINE = 0.9;
const float OFF_PLANE = 0.01;

ivec2 middle(ivec2 stratum) {
    return min(stratum * STRATUM + 1, ivec2(FC.size) - 1);
}

void main() {
    ivec2 s = ivec2(gl_GlobalInvocationID.xy);
    ivec2 strata = ivec2(strata_size());
    if (any(greaterThanEqual(s, strata))) return;
    Guide g = unpack_guide(imageLoad(guide, middle(s)));
    vec3 at = view_point(vec2(middle(s)) + jitter_now(), g.depth);
    vec3 normal = g.normal;
    vec2 sum = vec2(0.0);
    for (int i = 0; i < 9; i++) {
        ivec2 d = ivec2(i % 3 - 1, i / 3 - 1);
        ivec2 q = s + d * (1 << level);
        if (any(lessThan(q, ivec2(0))) || any(greaterThanEqual(q, strata))) continue;
        Guide other = unpack_guide(imageLoad(guide, middle(q)));
        vec3 there = view_point(vec2(middle(q)) + jitter_now(), other.depth);
        bool alike = d == ivec2(0) || (other.depth > 0.0 && dot(other.normal, g.normal) > LEAST_COSINE
            && abs(dot(there - at, normal)) < OFF_PLANE * g.depth);
        if (!alike) continue;
        vec2 theirs = ((level & 1u) == 0 ? imageLoad(gradient_a, q) : imageLoad(gradient_b, q)).xy;
        sum += theirs * float((2 - abs(d.x)) * (2 - abs(d.y))) / 16.0;
    }
    if ((level & 1u) == 0) imageStore(gradient_b, s, vec4(sum, 0.0, 0.0));
    else imageStore(gradient_a, s, vec4(sum, 0.0, 0.0));
}
