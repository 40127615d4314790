#version 460
// Output: exposure, tone map and sRGB encoding, or one of the frame's intermediate images.
#extension GL_GOOGLE_include_directive : require
#include "prelude.glsl"
#include "random.glsl"
#include "gbuffer.glsl"
#include "tonemap.glsl"
#include "ambient.glsl"
#include "gradient.glsl"
#include "shown.glsl"
#include "packed.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

// A colour for a number; black for none.
vec3 number_colour(uint n) {
    if (n == NONE) return vec3(0.0);
    uint h = pcg(n + 1);
    return vec3(h & 255u, (h >> 8) & 255u, (h >> 16) & 255u) / 255.0;
}

vec3 displayed(vec3 radiance) {
    float exposure = FC.fixed_exposure > 0.0 ? FC.fixed_exposure : FC.exposure.at[0];
    if (any(isnan(radiance)) || any(isinf(radiance))) radiance = vec3(0.0);
    return encode_srgb(clamp(tone_map(clamp(radiance * exposure, vec3(0.0), vec3(1e4)), FC.tonemap), vec3(0.0), vec3(1.0)));
}

vec3 final_radiance(ivec2 p) {
    return accumulated > 0 ? imageLoad(image_mean, p).rgb / float(accumulated) : shown_radiance(p);
}

// One of the frame's intermediate images.
vec3 intermediate(ivec2 p) {
    vec4 filtered = FC.denoised == 0 ? vec4(imageLoad(image_direct, p).rgb, 0.0)
                                     : unpack_colour(FC.denoised == 2 ? imageLoad(filter_b, p) : imageLoad(filter_a, p));
    vec4 moments = FC.denoised != 0 ? imageLoad(moments_now, p) : vec4(0.0);
    vec4 position = imageLoad(gbuffer_position, p);
    uvec4 surface = imageLoad(gbuffer_surface, p);
    switch (FC.view) {
        case 1: return encode_srgb(clamp(imageLoad(gbuffer_albedo, p).rgb, 0.0, 1.0));
        case 2: return unpack_normal(surface.x) * 0.5 + 0.5;
        case 3: return unpack_normal(surface.y) * 0.5 + 0.5;
        case 4: return vec3(position.w / (position.w + 512.0));
        case 5: return fract(position.xyz / 256.0);
        case 6: return number_colour(imageLoad(gbuffer_object, p).w);
        case 7: return number_colour(surface.z);
        case 8: return displayed(imageLoad(image_direct, p).rgb);
        case 9: return displayed(imageLoad(image_emission, p).rgb);
        case 10: return displayed(ambient_at(position.xyz, unpack_normal(surface.x)));
        case 12: return vec3(moments.z > 0.0 ? mix(max(1.0 / moments.z, FC.least_alpha), 1.0, gradient_at(p)) : 0.0);
        case 13: return vec3(moments.z / (moments.z + 20.0));
        case 14: return displayed(vec3(sqrt(filtered.a)));
        case 15: return displayed(vec3(moments.xy, 0.0));
        case 16: return vec3(gradient_at(p));
        case 17: return vec3(imageLoad(gbuffer_motion, p).xy / 32.0 + 0.5, 0.5);
        case 23: return displayed(FC.branches_off != 0 ? imageLoad(image_secondary, p).rgb : vec3(0.0));
        // The denoised irradiance, and the levels of the filter: the last one that runs is what is shown.
        case 11:
        default: return displayed(filtered.rgb);
    }
}

void main() {
    uvec2 pixel = gl_GlobalInvocationID.xy;
    if (any(greaterThanEqual(pixel, FC.size))) return;
    ivec2 p = ivec2(pixel);
    vec3 shown = FC.view == 0 ? displayed(final_radiance(p)) : intermediate(p);
    imageStore(image_display, p, vec4(shown, 1.0));
}
