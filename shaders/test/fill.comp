#version 460
// Fills a buffer behind an address: word i = base + i (or + i*i).
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_buffer_reference : require
#extension GL_EXT_scalar_block_layout : require
#include "test_common.glsl"

layout(local_size_x_id = 0) in;
layout(constant_id = 1) const uint BASE = 0;
layout(push_constant, scalar) uniform Push { Words target; uint count; uint pad; };

void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i >= count) return;
#ifdef SQUARES
    target.word[i] = BASE + i * i;
#else
    target.word[i] = BASE + i;
#endif
}
