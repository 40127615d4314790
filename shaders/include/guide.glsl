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

const float NORMAL_STEPS = 4095.0;

// `normal` along the view's axes.
uvec4 pack_guide(float depth, vec3 normal, uint material, uint instance) {
    normal /= abs(normal.x) + abs(normal.y) + abs(normal.z);
    vec2 side = vec2(normal.x >= 0.0 ? 1.0 : -1.0, normal.y >= 0.0 ? 1.0 : -1.0);
    vec2 o = normal.z >= 0.0 ? normal.xy : (1.0 - abs(normal.yx)) * side;
    uvec2 n = uvec2(round(clamp(o * 0.5 + 0.5, 0.0, 1.0) * NORMAL_STEPS));
    uint id = ((material * 0x9e3779b1u) ^ (instance * 0x85ebca77u)) >> 24;
    uint low = floatBitsToUint(depth);
    uint high = n.x | (n.y << 12) | (id << 24);
    return uvec4(low & 0xffffu, low >> 16, high & 0xffffu, high >> 16);
}

Guide unpack_guide(uvec4 words) {
    uint high = words.z | (words.w << 16);
    vec2 o = vec2(high & 0xfffu, (high >> 12) & 0xfffu) / NORMAL_STEPS * 2.0 - 1.0;
    vec3 n = vec3(o, 1.0 - abs(o.x) - abs(o.y));
    vec2 side = vec2(n.x >= 0.0 ? 1.0 : -1.0, n.y >= 0.0 ? 1.0 : -1.0);
    if (n.z < 0.0) n.xy = (1.0 - abs(n.yx)) * side;
    return Guide(uintBitsToFloat(words.x | (words.y << 16)), normalize(n), high >> 24);
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
