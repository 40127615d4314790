// The images of a view (the thesis's Table 6.4, with numbers in integer images and motion in pixels).
//
// | image | holds |
// |---|---|
// | albedo | linear reflectance; a: 1 where the ray hit something |
// | position | world position; distance along the ray |
// | surface | shading normal and geometric normal (octahedral, 2 x 16 bits), material, light row |
// | object | global triangle, instance, barycentrics (2 x 16 bits), PVS cluster |
// | view | direction of the ray |
// | motion | previous − current image position, pixels, y down; distance along the ray, 0 where a sky is the mean over its pixel; view depth in the frame before |
// | emission | radiance emitted towards the eye |
// | share | share of the surface's light that comes through the layers before it |
// | layers | radiance of those layers |
// | secondary | radiance of all that branches off: reflections, but for those that the pixel shows alone; until it is denoised, length of the brightest branch's way, units, 0 where none was followed |
// | direct | irradiance/π by direct light, not multiplied with the albedo |
// | composite | radiance of the pixel |
// | mean, compensation | accumulated radiance: see composite.comp |
// | mean_direct, mean_emission, mean_layers | accumulated shares |
// | display | encoded output |
// | filter_a, filter_b | denoiser: irradiance/π, or radiance that branches off; variance of its luminance, raised by what is not known of it (packed.glsl) |
// | gradient_a, gradient_b | one texel per stratum of 3 x 3 pixels: |Δ| of the luminance; the larger luminance |
// | guide | view depth (0: nothing that reflects), shading normal (2 x 12 bits), 8 bits of material and instance |
// | irradiance | history: irradiance/π (packed.glsl) |
// | moments | history: mean and standard deviation of the luminance; frames; share of one sample's variance that their mean has (channel.glsl) |
// | taa | history: radiance; frames |
// | taa_mean | the same, in full precision, while view and scene stand still |
// | secondary_guide | as guide, of the first surface that something branches off at |
// | secondary_radiance, secondary_moments | history of secondary, as irradiance and moments |
#ifndef GBUFFER_GLSL
#define GBUFFER_GLSL

layout(set = 1, binding = 0, rgba32f) uniform image2D gbuffer_albedo;
layout(set = 1, binding = 1, rgba32f) uniform image2D gbuffer_position;
layout(set = 1, binding = 2, rgba32ui) uniform uimage2D gbuffer_surface;
layout(set = 1, binding = 3, rgba32ui) uniform uimage2D gbuffer_object;
layout(set = 1, binding = 4, rgba32f) uniform image2D gbuffer_view;
layout(set = 1, binding = 5, rgba32f) uniform image2D gbuffer_motion;
layout(set = 1, binding = 6, rgba32f) uniform image2D image_emission;
layout(set = 1, binding = 7, rgba32f) uniform image2D image_direct;
layout(set = 1, binding = 8, rgba32f) uniform image2D image_composite;
layout(set = 1, binding = 9, rgba32f) uniform image2D image_mean;
layout(set = 1, binding = 10, rgba32f) uniform image2D image_compensation;
layout(set = 1, binding = 11, rgba32f) uniform image2D image_mean_direct;
layout(set = 1, binding = 12, rgba32f) uniform image2D image_mean_emission;
layout(set = 1, binding = 13, rgba8) uniform image2D image_display;
layout(set = 1, binding = 14, rgba16ui) uniform uimage2D filter_a;
layout(set = 1, binding = 15, rgba16ui) uniform uimage2D filter_b;
layout(set = 1, binding = 16, rgba32f) uniform image2D gradient_a;
layout(set = 1, binding = 17, rgba32f) uniform image2D gradient_b;
layout(set = 1, binding = 18, rgba32f) uniform image2D image_share;
layout(set = 1, binding = 19, rgba32f) uniform image2D image_layers;
layout(set = 1, binding = 20, rgba32f) uniform image2D image_mean_layers;
layout(set = 1, binding = 21, rgba32f) uniform image2D image_secondary;
layout(set = 1, binding = 22, rgba32f) uniform image2D taa_mean;
layout(set = 1, binding = 23, rgba16ui) uniform uimage2D guide;
layout(set = 1, binding = 24, rgba16ui) uniform uimage2D old_guide;
layout(set = 1, binding = 25, rgba16ui) uniform uimage2D irradiance_now;
layout(set = 1, binding = 26, rgba16ui) uniform uimage2D irradiance_before;
layout(set = 1, binding = 27, rgba16f) uniform image2D moments_now;
layout(set = 1, binding = 28, rgba16f) uniform image2D moments_before;
layout(set = 1, binding = 29, rgba16f) uniform image2D taa_now;
layout(set = 1, binding = 30, rgba16f) uniform image2D taa_before;
layout(set = 1, binding = 31, rgba16ui) uniform uimage2D secondary_guide;
layout(set = 1, binding = 32, rgba16ui) uniform uimage2D old_secondary_guide;
layout(set = 1, binding = 33, rgba16ui) uniform uimage2D secondary_radiance_now;
layout(set = 1, binding = 34, rgba16ui) uniform uimage2D secondary_radiance_before;
layout(set = 1, binding = 35, rgba16f) uniform image2D secondary_moments_now;
layout(set = 1, binding = 36, rgba16f) uniform image2D secondary_moments_before;

// Octahedral map of a unit vector to 2 x 16 bits (Meyer et al. 2010).
uint pack_normal(vec3 n) {
    n /= abs(n.x) + abs(n.y) + abs(n.z);
    vec2 p = n.z >= 0.0 ? n.xy : (1.0 - abs(n.yx)) * vec2(n.x >= 0.0 ? 1.0 : -1.0, n.y >= 0.0 ? 1.0 : -1.0);
    return packSnorm2x16(p);
}

vec3 unpack_normal(uint bits) {
    vec2 p = unpackSnorm2x16(bits);
    vec3 n = vec3(p, 1.0 - abs(p.x) - abs(p.y));
    if (n.z < 0.0) n.xy = (1.0 - abs(n.yx)) * vec2(n.x >= 0.0 ? 1.0 : -1.0, n.y >= 0.0 ? 1.0 : -1.0);
    return normalize(n);
}

#endif
