// Irradiance and a variance in 64 bits: half of what plain floats take, for passes that memory bounds.
//
// Colours share an exponent and have 16 bits each: 2^-16 of the largest channel is the most that rounding changes. The variance
// has the highest 6 bits of an exponent and 2 of a mantissa: steps of 25% at most, and no logarithm to take.
#ifndef PACKED_GLSL
#define PACKED_GLSL

const int EXPONENT_BIAS = 100;
// Of a float's bits, what is left of the variance, and the least that is told from 0: 2^-40.
const uint VARIANCE_SHIFT = 21;
const uint VARIANCE_BIAS = (127u - 40u) << 2;

// Numbers that become floats, and the other way round, do so by their bits: beside a power of two 2^e a float counts in steps
// of 2^(e − 23). Conversions and functions of exponents are slow.
uint bits_of_power(int e) {
    return uint(e + 127) << 23;
}

uvec4 pack_colour(vec3 c, float variance) {
    float most = max(c.x, max(c.y, c.z));
    int e = clamp(int((floatBitsToUint(max(most, 0.0)) >> 23) & 0xffu) - 126, -EXPONENT_BIAS, 120);
    uint counts = bits_of_power(e + 7);
    uvec3 m = min(floatBitsToUint(max(c, vec3(0.0)) + uintBitsToFloat(counts)) - counts, uvec3(65535u));
    uint rounded = (floatBitsToUint(max(variance, 0.0)) + (1u << (VARIANCE_SHIFT - 1))) >> VARIANCE_SHIFT;
    uint v = uint(clamp(int(rounded) - int(VARIANCE_BIAS), 0, 255));
    return uvec4(m, uint(e + EXPONENT_BIAS) | (v << 8));
}

vec4 unpack_colour(uvec4 p) {
    uint v = p.w >> 8;
    float variance = uintBitsToFloat((v + VARIANCE_BIAS) << VARIANCE_SHIFT);
    uint counts = bits_of_power(int(p.w & 0xffu) - EXPONENT_BIAS);
    return vec4(uintBitsToFloat(counts | (p.xyz << 7)) - uintBitsToFloat(counts), v > 0u ? variance : 0.0);
}

#endif
