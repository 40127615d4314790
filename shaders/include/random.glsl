// Addressable random numbers: the same bits as src/scene/sampling.rs, which explains them.
#ifndef RANDOM_GLSL
#define RANDOM_GLSL

const uint SEQUENCE_RANDOM = 0;
const uint DIM_PIXEL = 0;
const uint DIM_LENS = 1;
const uint DIM_LAYER = 0x4000;
const uint DIM_BRANCH = 0x7000;
const uint DIM_LOBE = 0x5000;
const uint DIM_LOBE_PICK = 0x6000;
const uint DIM_LOBE_POINT = 0x6001;
const uint DIM_LIGHT_PICK = 16;
const uint DIM_LIGHT_POINT = 80;
const uint DIM_CANDIDATE_PICK = 0x1000;
const uint DIM_CANDIDATE_POINT = 0x2000;
const uint MAX_CANDIDATES = 32;
const uint DIM_REUSE = 0x3000;
const uint DIM_REUSE_KEEP = 0x3100;
const uint DIM_EVERY_LIGHT = 0x10000;

uint pcg(uint x) {
    uint state = x * 747796405u + 2891336453u;
    uint word = ((state >> ((state >> 28) + 4u)) ^ state) * 277803737u;
    return (word >> 22) ^ word;
}

uint random_key(uint seed, uint pixel, uint dimension) {
    return pcg(pixel + pcg(dimension + pcg(seed)));
}

uint laine_karras(uint x, uint seed) {
    x += seed;
    x ^= x * 0x6c50b47cu;
    x ^= x * 0xb82f1e52u;
    x ^= x * 0xc7afe638u;
    x ^= x * 0x8d22f6e6u;
    return x;
}

uint sobol1_reversed(uint x) {
    x ^= (x >> 16) & 0x0000ffffu;
    x ^= (x >> 8) & 0x00ff00ffu;
    x ^= (x >> 4) & 0x0f0f0f0fu;
    x ^= (x >> 2) & 0x33333333u;
    x ^= (x >> 1) & 0x55555555u;
    return x;
}

float unit_float(uint bits) {
    return float(bits >> 8) * (1.0 / 16777216.0);
}

uvec2 bits2(uint sequence, uint key, uint index) {
    if (sequence == SEQUENCE_RANDOM) {
        uint a = pcg(key ^ pcg(index));
        return uvec2(a, pcg(a ^ ((key << 16) | (key >> 16))));
    }
    uint shuffled = bitfieldReverse(laine_karras(bitfieldReverse(index), key));
    uint x = laine_karras(shuffled, pcg(key ^ 0x68bc21ebu));
    uint y = laine_karras(sobol1_reversed(shuffled), pcg(key ^ 0x02e5be93u));
    return uvec2(bitfieldReverse(x), bitfieldReverse(y));
}

uint stratified(uint bits, uint part, uint parts) {
    uint whole = (0u - parts) / parts + 1u;
    uint rest = (0u - parts) % parts;
    return part * whole + bits / parts + (part * rest + bits % parts) / parts;
}

// Bits that decide whether the c-th candidate is kept.
uint keep_bits(uint bits, uint c) {
    return c < 2 ? bits : pcg(bits + c);
}

vec2 sample2(uint sequence, uint key, uint index) {
    uvec2 bits = bits2(sequence, key, index);
    return vec2(unit_float(bits.x), unit_float(bits.y));
}

vec2 sample_disc(vec2 u) {
    float a = 2.0 * u.x - 1.0;
    float b = 2.0 * u.y - 1.0;
    if (a == 0.0 && b == 0.0) return vec2(0.0);
    float r;
    float phi;
    if (abs(a) > abs(b)) {
        r = a;
        phi = 0.785398163397448 * (b / a);
    } else {
        r = b;
        phi = 1.570796326794897 - 0.785398163397448 * (a / b);
    }
    return vec2(r * cos(phi), r * sin(phi));
}

vec2 sample_triangle_barycentrics(vec2 u) {
    if (u.y > u.x) {
        float x = u.x * 0.5;
        return vec2(x, u.y - x);
    }
    float y = u.y * 0.5;
    return vec2(u.x - y, y);
}

#endif
