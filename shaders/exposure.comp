#version 460
// Automatic exposure: the log-average luminance of the image, summed in a fixed order so that equal images give equal
// exposures. One work group; each thread sums a stripe.
#extension GL_GOOGLE_include_directive : require
#include "prelude.glsl"
#include "gbuffer.glsl"
#include "tonemap.glsl"
#include "shown.glsl"

layout(local_size_x = 128) in;

shared float sums[128];
shared float lit[EXPOSURE_CELLS * EXPOSURE_CELLS];

// The sum over all lanes, the same for each.
float total(float own) {
    uint lane = gl_LocalInvocationIndex;
    sums[lane] = own;
    barrier();
    for (uint half_ = 64; half_ > 0; half_ >>= 1) {
        if (lane < half_) sums[lane] += sums[lane + half_];
        barrier();
    }
    float sum = sums[0];
    barrier();
    return sum;
}

void main() {
    uint lane = gl_LocalInvocationIndex;
    // Cells are averaged before the logarithm is taken: noise, most of it black pixels, must not raise the exposure.
    uvec2 cells = min(FC.size, uvec2(EXPOSURE_CELLS));
    float sum = 0.0;
    uint n = cells.x * cells.y;
    [[dont_unroll]] for (uint i = lane; i < n; i += 128) {
        uvec2 cell = uvec2(i % cells.x, i / cells.x);
        uvec2 first = cell * FC.size / cells;
        uvec2 extent = max((cell + 1u) * FC.size / cells - first, uvec2(1));
        float mean = 0.0;
        // Sixteen loads at once: one after the other they are what this pass would wait for.
        [[unroll]] for (uint k = 0; k < 16; k++) {
            ivec2 p = ivec2(first + uvec2(k % 4, k / 4) * extent / 4);
            vec3 c = accumulated > 0 ? imageLoad(image_mean, p).rgb / float(accumulated) : shown_radiance(p);
            float l = luminance(c);
            mean += isnan(l) || isinf(l) ? 0.0 : l;
        }
        lit[i] = mean / 16.0;
        sum += lit[i];
    }
    float dark = total(sum) / float(n) * DARK_SHARE;
    float logs = 0.0, weights = 0.0;
    [[dont_unroll]] for (uint i = lane; i < n; i += 128) {
        float weight = dark > 0.0 ? min(lit[i] / dark, 1.0) : 1.0;
        logs += weight * log(max(lit[i], LUMINANCE_FLOOR));
        weights += weight;
    }
    logs = total(logs);
    weights = total(weights);
    if (lane == 0) {
        float average = exp(logs / max(weights, 1.17549435e-38));
        float wanted = clamp(sqrt(GAME_EXPOSURE * KEY / average), EXPOSURE_RANGE.x, EXPOSURE_RANGE.y);
        float before = FC.exposure.at[0];
        FC.exposure.at[0] = before > 0.0 ? before * pow(wanted / before, FC.exposure_blend) : wanted;
    }
}
