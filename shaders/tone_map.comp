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

void main() {
    uvec2 pixel = gl_GlobalInvocationID.xy;
    if (any(greaterThanEqual(pixel, FC.size))) return;
    ivec2 p = ivec2(pixel);
    float exposure = FC.fixed_exposure > 0.0 ? FC.fixed_exposure : FC.exposure.at[0];
    vec3 radiance = accumulated > 0 ? imageLoad(image_mean, p).rgb / float(accumulated)
                                    : shown_radiance(p);
    if (FC.view == 8) radiance = imageLoad(image_direct, p).rgb;
    if (FC.view == 9) radiance = imageLoad(image_emission, p).rgb;
    if (FC.view == 10) {
        radiance = ambient_at(imageLoad(gbuffer_position, p).xyz, unpack_normal(imageLoad(gbuffer_surface, p).x));
    }
    if (FC.view == 23) radiance = imageLoad(image_secondary, p).rgb;
    vec4 moments = FC.denoised != 0 ? imageLoad(moments_now, p) : vec4(0.0);
    vec4 filtered = FC.denoised == 0 ? vec4(imageLoad(image_direct, p).rgb, 0.0)
                                     : unpack_colour(FC.denoised == 2 ? imageLoad(filter_b, p) : imageLoad(filter_a, p));
    if (FC.view == 11 || (FC.view >= 18 && FC.view < 23)) radiance = filtered.rgb;
    if (FC.view == 14) radiance = vec3(sqrt(filtered.a));
    if (FC.view == 15) radiance = vec3(moments.x, sqrt(moments.y), 0.0);
    if (any(isnan(radiance)) || any(isinf(radiance))) radiance = vec3(0.0);
    vec3 shown = encode_srgb(clamp(tone_map(clamp(radiance * exposure, vec3(0.0), vec3(1e4)), FC.tonemap), vec3(0.0), vec3(1.0)));
    uvec4 surface = imageLoad(gbuffer_surface, p);
    uvec4 object = imageLoad(gbuffer_object, p);
    vec4 position = imageLoad(gbuffer_position, p);
    if (FC.view == 1) shown = encode_srgb(clamp(imageLoad(gbuffer_albedo, p).rgb, 0.0, 1.0));
    if (FC.view == 2) shown = unpack_normal(surface.x) * 0.5 + 0.5;
    if (FC.view == 3) shown = unpack_normal(surface.y) * 0.5 + 0.5;
    if (FC.view == 4) shown = vec3(position.w / (position.w + 512.0));
    if (FC.view == 5) shown = fract(position.xyz / 256.0);
    if (FC.view == 6) shown = number_colour(object.w);
    if (FC.view == 7) shown = number_colour(surface.z);
    if (FC.view == 12) shown = vec3(moments.z > 0.0 ? mix(max(1.0 / moments.z, FC.least_alpha), 1.0, gradient_at(p)) : 0.0);
    if (FC.view == 13) shown = vec3(moments.z / (moments.z + 20.0));
    if (FC.view == 16) shown = vec3(gradient_at(p));
    if (FC.view == 17) shown = vec3(imageLoad(gbuffer_motion, p).xy / 32.0 + 0.5, 0.5);
    imageStore(image_display, p, vec4(shown, 1.0));
}
