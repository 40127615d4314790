// What the denoiser tells surfaces apart by, in 64 bits per pixel.
#ifndef GUIDE_GLSL
#define GUIDE_GLSL

struct Guide {
    // Distance along the view's axis; 0 where the pixel shows nothing that reflects.
    float depth;
    // Unit shading normal along the right, up and forward of the view of its frame.
    vec3 normal;
    // 8 bits of material and instance.
    uint id;
};

// Normals are kept by Lambert's azimuthal projection, whose centre faces the eye: unit vectors come of it without a square root of
// their length, and the one direction that it has no place for looks away from the eye.
const float NORMAL_STEPS = 4095.0;

// 12 bits each of the projection, which is within 2 of its centre.
uvec2 project_normal(vec3 n) {
    vec2 e = n.xy * sqrt(2.0 / max(1.0 - n.z, 1e-6));
    return uvec2(round(clamp(e * 0.25 + 0.5, 0.0, 1.0) * NORMAL_STEPS));
}

vec3 projected_normal(uvec2 bits) {
    // Numbers between 1 and 2 by their bits: conversions are slow.
    vec2 steps = uintBitsToFloat(0x3f800000u | (bits << 11)) - 1.0;
    vec2 e = steps * (4.0 * 4096.0 / NORMAL_STEPS) - 2.0;
    float f = dot(e, e);
    return vec3(e * sqrt(max(1.0 - 0.25 * f, 0.0)), 0.5 * f - 1.0);
}

// `normal` along the view's axes.
uvec4 pack_guide(float depth, vec3 normal, uint material, uint instance) {
    uvec2 n = project_normal(normal);
    uint id = ((material * 0x9e3779b1u) ^ (instance * 0x85ebca77u)) >> 24;
    uint low = floatBitsToUint(depth);
    uint high = n.x | (n.y << 12) | (id << 24);
    return uvec4(low & 0xffffu, low >> 16, high & 0xffffu, high >> 16);
}

Guide unpack_guide(uvec4 words) {
    uint high = words.z | (words.w << 16);
    vec3 normal = projected_normal(uvec2(high & 0xfffu, (high >> 12) & 0xfffu));
    return Guide(uintBitsToFloat(words.x | (words.y << 16)), normal, high >> 24);
}

// A direction along right, up and forward of this frame's view, and of the one before.
vec3 to_view(vec3 v) {
    return vec3(dot(v, FC.right), dot(v, FC.up), dot(v, FC.forward));
}

vec3 to_old_view(vec3 v) {
    return vec3(dot(v, FC.old_right), dot(v, FC.old_up), dot(v, FC.old_forward));
}

// The point at a depth behind a point of the image (pixels from the top left), along the view's axes.
vec3 view_point(vec2 p, float depth) {
    vec2 s = vec2(2.0 * p.x / float(FC.size.x) - 1.0, 1.0 - 2.0 * p.y / float(FC.size.y));
    return vec3(s * vec2(FC.half_width, FC.half_height), 1.0) * depth;
}

vec3 old_view_point(vec2 p, float depth) {
    vec2 s = vec2(2.0 * p.x / float(FC.size.x) - 1.0, 1.0 - 2.0 * p.y / float(FC.size.y));
    return vec3(s * vec2(FC.old_half_width, FC.old_half_height), 1.0) * depth;
}

// Where in their pixels rays went, pixels.
vec2 jitter_now() {
    return FC.jitter.x >= 0.0 ? FC.jitter : vec2(0.5);
}

vec2 jitter_before() {
    return FC.old_jitter.x >= 0.0 ? FC.old_jitter : vec2(0.5);
}

#endif
