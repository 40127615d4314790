// The denoiser's channels, signals that are filtered apart: direct, and secondary where SECONDARY is defined.
#ifndef CHANNEL_GLSL
#define CHANNEL_GLSL

#include "half_precision.glsl"

#ifdef SECONDARY
const bool IS_SECONDARY = true;
#define channel_guide secondary_guide
#define channel_old_guide old_secondary_guide
#define channel_sample image_secondary
#define channel_now secondary_radiance_now
#define channel_before secondary_radiance_before
#define channel_moments_now secondary_moments_now
#define channel_moments_before secondary_moments_before
#else
const bool IS_SECONDARY = false;
#define channel_guide guide
#define channel_old_guide old_guide
#define channel_sample image_direct
#define channel_now irradiance_now
#define channel_before irradiance_before
#define channel_moments_now moments_now
#define channel_moments_before moments_before
#endif

// Moments are kept in half precision, of whose squares little would be left of a difference: first and second moment of the
// luminance, frames and share, of and to what is kept.
vec4 moments_of(vec4 kept) {
    return vec4(kept.x, kept.x * kept.x + kept.y * kept.y, kept.zw);
}

vec4 kept_moments(vec2 moments, float frames, float share) {
    float deviation = sqrt(max(moments.y - moments.x * moments.x, 0.0));
    return vec4(min(vec2(moments.x, deviation), vec2(MOST_KEPT)), min(frames, MOST_FRAMES), share);
}

#endif
