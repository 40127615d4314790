// Strata of the denoiser's gradients: of every 3 x 3 pixels, what one of them was shaded with, for the next frame (Schied,
// Peters and Dachsbacher 2018, section 4.1: the seed goes with the sample). The stages that shade call this where everything is
// at hand.
#ifndef STRATA_GLSL
#define STRATA_GLSL

#include "gbuffer.glsl"
#include "gradient.glsl"
#include "luminance.glsl"

// Whether a pixel is the one of its stratum: any of the nine, another one from frame to frame.
bool stands_for_stratum(uvec2 pixel) {
    if (FC.denoised == 0) return false;
    uvec2 stratum = pixel / uint(STRATUM);
    uint which = pcg(stratum.x + (stratum.y << 16) + pcg(sample_index)) % uint(STRATUM * STRATUM);
    uvec2 chosen = min(stratum * uint(STRATUM) + uvec2(which % uint(STRATUM), which / uint(STRATUM)), FC.size - 1u);
    return pixel == chosen;
}

// Keeps a pixel's shading. `kept` holds receiver and light sample; instance, address, index and luminance are filled in.
void keep_stratum(uvec2 pixel, Stratum kept, vec3 irradiance) {
    kept.instance = imageLoad(gbuffer_object, ivec2(pixel)).y;
    kept.address = pixel.x + (pixel.y << 16);
    kept.sample_index = sample_index;
    kept.luminance = luminance(irradiance);
    uvec2 stratum = pixel / uint(STRATUM);
    FC.strata.at[stratum.y * strata_size().x + stratum.x] = kept;
}

#endif
