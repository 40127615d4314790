// Exposure and tone map. Counterpart of src/render/tonemap.rs.
#ifndef TONEMAP_GLSL
#define TONEMAP_GLSL

#include "luminance.glsl"

const float GAME_EXPOSURE = 255.0 / 64.0;
const float KEY = 0.12;
const float LUMINANCE_FLOOR = 1e-4;
const uint EXPOSURE_CELLS = 32;
const float DARK_SHARE = 1.0 / 16.0;
const vec2 EXPOSURE_RANGE = vec2(0.05, 16.0);

vec3 tone_map(vec3 x, uint curve) {
    if (curve == 0) return (x * (2.51 * x + 0.03)) / (x * (2.43 * x + 0.59) + 0.14);
    if (curve == 1) return x / (1.0 + x);
    return x;
}

vec3 encode_srgb(vec3 x) {
    return mix(x * 12.92, 1.055 * pow(max(x, vec3(1e-8)), vec3(1.0 / 2.4)) - 0.055, greaterThan(x, vec3(0.0031308)));
}

#endif
