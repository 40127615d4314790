// Compressed 8-wide BVH (Ylitie, Karras, Laine 2017) in the layout of the crate obvhs: five uvec4 a node; child planes
// are interleaved minimum and maximum per axis; octant bits are x = 4, y = 2, z = 1.

const int CWBVH_STACK = 24;

uint sign_extend_s8x4(uint x) {
    return ((x >> 7) & 0x01010101u) * 0xffu;
}

uint byte_of(uint word, int i) {
    return bitfieldExtract(word, i * 8, 8);
}

uint cwbvh_children(uvec4 n0, uvec4 n1, uvec4 n2, uvec4 n3, uvec4 n4, vec3 origin, vec3 inverse, bvec3 negative,
                    uint octant4, float t_max) {
    vec3 extent = vec3(uintBitsToFloat(byte_of(n0.w, 0) << 23), uintBitsToFloat(byte_of(n0.w, 1) << 23),
                       uintBitsToFloat(byte_of(n0.w, 2) << 23)) * inverse;
    vec3 start = (uintBitsToFloat(n0.xyz) - origin) * inverse;
    uint mask = 0;
    [[unroll]] for (int half_ = 0; half_ < 2; half_++) {
        uint meta4 = half_ == 0 ? n1.z : n1.w;
        uint inner4 = (meta4 & (meta4 << 1)) & 0x10101010u;
        uint inner_mask4 = sign_extend_s8x4(inner4 << 3);
        uint bit_index4 = (meta4 ^ (octant4 & inner_mask4)) & 0x1f1f1f1fu;
        uint child_bits4 = (meta4 >> 5) & 0x07070707u;
        uint min_x = half_ == 0 ? n2.x : n2.y;
        uint max_x = half_ == 0 ? n2.z : n2.w;
        uint min_y = half_ == 0 ? n3.x : n3.y;
        uint max_y = half_ == 0 ? n3.z : n3.w;
        uint min_z = half_ == 0 ? n4.x : n4.y;
        uint max_z = half_ == 0 ? n4.z : n4.w;
        uint near_x = negative.x ? max_x : min_x;
        uint far_x = negative.x ? min_x : max_x;
        uint near_y = negative.y ? max_y : min_y;
        uint far_y = negative.y ? min_y : max_y;
        uint near_z = negative.z ? max_z : min_z;
        uint far_z = negative.z ? min_z : max_z;
        [[unroll]] for (int j = 0; j < 4; j++) {
            vec3 lo = vec3(byte_of(near_x, j), byte_of(near_y, j), byte_of(near_z, j)) * extent + start;
            vec3 hi = vec3(byte_of(far_x, j), byte_of(far_y, j), byte_of(far_z, j)) * extent + start;
            float enter = max(max(lo.x, lo.y), max(lo.z, 0.0));
            float leave = min(min(hi.x, hi.y), min(hi.z, t_max));
            if (enter <= leave * 1.0000004) {
                mask |= byte_of(child_bits4, j) << byte_of(bit_index4, j);
            }
        }
    }
    return mask;
}

// Shortens hit; true where something nearer was found. With `any` the first one found ends the walk.
bool trace_mesh(MeshTree mesh, vec3 origin, vec3 direction, bool any, inout Hit hit) {
    vec3 inverse = safe_inverse(direction);
    bvec3 negative = lessThan(direction, vec3(0.0));
    uint octant4 = (negative.x ? 0u : 0x04040404u) | (negative.y ? 0u : 0x02020202u) | (negative.z ? 0u : 0x01010101u);
    uvec2 stack[CWBVH_STACK];
    int top = 0;
    // (first child node, hit bits | internal mask) and (first triangle, hit bits).
    uvec2 nodes = uvec2(0, 0x80000000u);
    bool found = false;
    while (true) {
        uvec2 leafs;
        if ((nodes.y & 0xff000000u) != 0) {
            uint bits = nodes.y;
            int offset = findMSB(bits);
            nodes.y &= ~(1u << offset);
            uint base = nodes.x;
            if ((nodes.y & 0xff000000u) != 0 && top < CWBVH_STACK) stack[top++] = nodes;
            uint slot = uint(offset - 24) ^ (octant4 & 0xffu);
            uint relative = bitCount(bits & ~(0xffffffffu << slot));
            uint at = (mesh.cwbvh_node + base + relative) * 5;
            uvec4 n0 = FC.cwbvh_nodes.at[at];
            uvec4 n1 = FC.cwbvh_nodes.at[at + 1];
            uvec4 n2 = FC.cwbvh_nodes.at[at + 2];
            uvec4 n3 = FC.cwbvh_nodes.at[at + 3];
            uvec4 n4 = FC.cwbvh_nodes.at[at + 4];
            uint mask = cwbvh_children(n0, n1, n2, n3, n4, origin, inverse, negative, octant4, hit.t);
            nodes = uvec2(n1.x, (mask & 0xff000000u) | (n0.w >> 24));
            leafs = uvec2(n1.y, mask & 0x00ffffffu);
        } else {
            leafs = nodes;
            nodes = uvec2(0);
        }
        while (leafs.y != 0) {
            int offset = findMSB(leafs.y);
            leafs.y &= ~(1u << offset);
            uint index = mesh.cwbvh_triangle + leafs.x + uint(offset);
            if (test_triangle(index, origin, direction, hit)) {
                found = true;
                if (any) return true;
            }
        }
        if ((nodes.y & 0xff000000u) == 0) {
            if (top == 0) break;
            nodes = stack[--top];
        }
    }
    return found;
}
