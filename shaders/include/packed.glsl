// Irradiance and a variance in 64 bits: half of what plain floats take, for passes that memory bounds.
//
// Colours share an exponent and have 16 bits each: 2^-16 of the largest channel is the most that rounding changes. The variance
// has 8 bits of its logarithm, steps of 19%.
#ifndef PACKED_GLSL
#define PACKED_GLSL

const int EXPONENT_BIAS = 100;
const float LOG_STEPS = 4.0;
const float LOG_BIAS = 160.0;

// 2^e by its bits: the built-in functions for exponents take many instructions.
float power_of_two(int e) {
    return uintBitsToFloat(uint(e + 127) << 23);
}

uvec4 pack_colour(vec3 c, float variance) {
    float most = max(c.x, max(c.y, c.z));
    int e = clamp(int((floatBitsToUint(max(most, 0.0)) >> 23) & 0xffu) - 126, -EXPONENT_BIAS, 126);
    uvec3 m = uvec3(clamp(c * power_of_two(16 - e) + 0.5, vec3(0.0), vec3(65535.0)));
    uint v = variance > 0.0 ? uint(clamp(log2(variance) * LOG_STEPS + (LOG_BIAS + 0.5), 1.0, 255.0)) : 0u;
    return uvec4(m, uint(e + EXPONENT_BIAS) | (v << 8));
}

vec4 unpack_colour(uvec4 p) {
    uint v = p.w >> 8;
    float variance = exp2((float(v) - LOG_BIAS) / LOG_STEPS);
    return vec4(vec3(p.xyz) * power_of_two(int(p.w & 0xffu) - EXPONENT_BIAS - 16), v > 0u ? variance : 0.0);
}

#endif
