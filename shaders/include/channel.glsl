// The denoiser's channels, signals that are filtered apart: direct, and secondary where SECONDARY is defined.
#ifndef CHANNEL_GLSL
#define CHANNEL_GLSL

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

#endif
