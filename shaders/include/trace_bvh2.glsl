// Binary BVH: a node holds the boxes of its two children, (min, reference) (max, _) each. A reference with the top bit is
// a leaf: 4 bits number of triangles − 1, 27 bits the first of them.

const int BVH2_STACK = 64;
const uint BVH2_LEAF = 0x80000000u;

bool trace_mesh(MeshTree mesh, vec3 origin, vec3 direction, bool any, inout Hit hit) {
    vec3 inverse = safe_inverse(direction);
    vec3 scaled = -origin * inverse;
    uint stack[BVH2_STACK];
    int top = 0;
    uint at = mesh.bvh2_root;
    bool found = false;
    while (true) {
        // Down to a leaf in a loop of its own: threads that have one wait for their neighbours, and triangles are tested
        // together. With diverging rays that is a fifth faster than taking nodes and leaves as they come.
        bool leaf = true;
        while ((at & BVH2_LEAF) == 0) {
            uint node = (mesh.bvh2_node + at) * 4;
            vec4 lo0 = FC.bvh2_nodes.at[node];
            vec4 hi0 = FC.bvh2_nodes.at[node + 1];
            vec4 lo1 = FC.bvh2_nodes.at[node + 2];
            vec4 hi1 = FC.bvh2_nodes.at[node + 3];
            vec3 a = lo0.xyz * inverse + scaled;
            vec3 b = hi0.xyz * inverse + scaled;
            vec3 c = lo1.xyz * inverse + scaled;
            vec3 d = hi1.xyz * inverse + scaled;
            vec3 near0 = min(a, b), far0 = max(a, b), near1 = min(c, d), far1 = max(c, d);
            float enter0 = max(max(near0.x, near0.y), max(near0.z, 0.0));
            float leave0 = min(min(far0.x, far0.y), min(far0.z, hit.t));
            float enter1 = max(max(near1.x, near1.y), max(near1.z, 0.0));
            float leave1 = min(min(far1.x, far1.y), min(far1.z, hit.t));
            bool hit0 = enter0 <= leave0 * 1.000001;
            bool hit1 = enter1 <= leave1 * 1.000001;
            uint r0 = floatBitsToUint(lo0.w);
            uint r1 = floatBitsToUint(lo1.w);
            if (hit0 && hit1) {
                bool swap = enter1 < enter0;
                at = swap ? r1 : r0;
                if (top < BVH2_STACK) stack[top++] = swap ? r0 : r1;
                continue;
            }
            if (hit0 || hit1) {
                at = hit0 ? r0 : r1;
                continue;
            }
            if (top == 0) {
                leaf = false;
                break;
            }
            at = stack[--top];
        }
        if (!leaf) break;
        uint first = mesh.bvh2_triangle + (at & 0x07ffffffu);
        uint count = ((at >> 27) & 15u) + 1u;
        for (uint i = 0; i < count; i++) {
            if (test_triangle(first + i, origin, direction, hit)) {
                found = true;
                if (any) return true;
            }
        }
        if (top == 0) break;
        at = stack[--top];
    }
    return found;
}
