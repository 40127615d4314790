// The denoiser's gradients: one per stratum of 3 x 3 pixels.
#ifndef GRADIENT_GLSL
#define GRADIENT_GLSL

#include "gbuffer.glsl"

const int STRATUM = 3;

uvec2 strata_size() {
    return (FC.size + uint(STRATUM) - 1u) / uint(STRATUM);
}

// A change by a quarter makes history worthless. Gradients have no noise of their own: a sample is shaded twice with the same
// numbers.
const float GAIN = 4.0;

// Change of the light at a pixel, 0..1.
float gradient_at(ivec2 p) {
    if (FC.changed == 0) return 0.0;
    vec2 g = imageLoad(gradient_a, p / STRATUM).xy;
    return g.y > 0.0 ? clamp(GAIN * g.x / g.y, 0.0, 1.0) : 0.0;
}

#endif
