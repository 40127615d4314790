#version 460
// Composition: what the pixel shows, in linear radiance, and its accumulation over frames.
//
// Accumulation keeps a compensated sum (Kahan), so that rounding stays near one unit in the last place of the mean at any
// number of samples, and the sum of squared deviations (Welford) for the variance of the mean:
// mean.rgb = sum, mean.a = sum of squared deviations averaged over the channels, compensation.rgb = what rounding left.
#extension GL_GOOGLE_include_directive : require
#include "prelude.glsl"
#include "gbuffer.glsl"
#include "ambient.glsl"
#include "packed.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

void add_compensated(inout vec3 sum, inout vec3 lost, vec3 value) {
    precise vec3 y = value - lost;
    precise vec3 t = sum + y;
    precise vec3 low = (t - sum) - y;
    lost = low;
    sum = t;
}

void main() {
    uvec2 pixel = gl_GlobalInvocationID.xy;
    if (any(greaterThanEqual(pixel, FC.size))) return;
    ivec2 p = ivec2(pixel);
    vec4 albedo = imageLoad(gbuffer_albedo, p);
    vec3 irradiance = imageLoad(image_direct, p).rgb;
    if (FC.denoised == 1) irradiance = unpack_colour(imageLoad(filter_a, p)).rgb;
    if (FC.denoised == 2) irradiance = unpack_colour(imageLoad(filter_b, p)).rgb;
    if (FC.illumination != 0 && FC.ambient != AMBIENT_OFF && albedo.rgb != vec3(0.0)) {
        irradiance += ambient_at(imageLoad(gbuffer_position, p).xyz, unpack_normal(imageLoad(gbuffer_surface, p).x));
    }
    vec3 direct = albedo.rgb * irradiance;
    vec3 emission = imageLoad(image_emission, p).rgb;
    if (FC.illumination == 0 && albedo.rgb != vec3(0.0)) emission = vec3(0.0);
    vec3 share = imageLoad(image_share, p).rgb;
    vec3 layers = imageLoad(image_layers, p).rgb;
    if (FC.branches_off != 0) layers += imageLoad(image_secondary, p).rgb;
    direct *= share;
    emission *= share;
    vec3 radiance = direct + emission + layers;
    imageStore(image_composite, p, vec4(radiance, albedo.a));
    if (accumulated == 0) return;
    vec4 mean = vec4(0.0);
    vec4 compensation = vec4(0.0);
    vec3 sum_direct = vec3(0.0);
    vec3 sum_emission = vec3(0.0);
    vec3 sum_layers = vec3(0.0);
    if (accumulated > 1) {
        mean = imageLoad(image_mean, p);
        compensation = imageLoad(image_compensation, p);
        sum_direct = imageLoad(image_mean_direct, p).rgb;
        sum_emission = imageLoad(image_mean_emission, p).rgb;
        sum_layers = imageLoad(image_mean_layers, p).rgb;
        vec3 delta = radiance - mean.rgb / float(accumulated - 1);
        mean.a += dot(delta, delta) * (float(accumulated - 1) / float(accumulated)) / 3.0;
    }
    add_compensated(mean.rgb, compensation.rgb, radiance);
    imageStore(image_mean, p, mean);
    imageStore(image_compensation, p, compensation);
    imageStore(image_mean_direct, p, vec4(sum_direct + direct, 0.0));
    imageStore(image_mean_emission, p, vec4(sum_emission + emission, 0.0));
    imageStore(image_mean_layers, p, vec4(sum_layers + layers, 0.0));
}
