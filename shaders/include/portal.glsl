// Mirrors and portals: where a view into one goes on. Counterpart of src/reference/portal.rs.
#ifndef PORTAL_GLSL
#define PORTAL_GLSL

// An affine map, three rows.
struct Map {
    vec4 rows[3];
};

vec3 mapped(Map m, vec3 v, float w) {
    vec4 q = vec4(v, w);
    return vec3(dot(m.rows[0], q), dot(m.rows[1], q), dot(m.rows[2], q));
}

Map identity_map() {
    return Map(vec4[3](vec4(1.0, 0.0, 0.0, 0.0), vec4(0.0, 1.0, 0.0, 0.0), vec4(0.0, 0.0, 1.0, 0.0)));
}

// First b, then a.
Map both_maps(Map a, Map b) {
    Map r;
    for (uint i = 0; i < 3; i++) {
        r.rows[i] = b.rows[0] * a.rows[i].x + b.rows[1] * a.rows[i].y + b.rows[2] * a.rows[i].z;
        r.rows[i].w += a.rows[i].w;
    }
    return r;
}

// Reflection at the plane through a point.
Map reflection_at(vec3 point, vec3 n) {
    float d = dot(n, point);
    return Map(vec4[3](vec4(1.0 - 2.0 * n.x * n.x, -2.0 * n.x * n.y, -2.0 * n.x * n.z, 2.0 * n.x * d),
                       vec4(-2.0 * n.y * n.x, 1.0 - 2.0 * n.y * n.y, -2.0 * n.y * n.z, 2.0 * n.y * d),
                       vec4(-2.0 * n.z * n.x, -2.0 * n.z * n.y, 1.0 - 2.0 * n.z * n.z, 2.0 * n.z * d)));
}

void reflect_at(vec3 point, vec3 n, inout Map virtual_) {
    virtual_ = both_maps(virtual_, reflection_at(point, n));
}

// What is seen beyond an interface looks as far away as it is, in the direction of the ray before: the shortest turn about
// the point from the one direction to the other is put behind.
void bends_at(vec3 point, vec3 before, vec3 after, inout Map virtual_) {
    vec3 axis = cross(after, before);
    float c = dot(after, before);
    float k = 1.0 / (1.0 + c);
    Map turn = Map(vec4[3](vec4(axis.x * axis.x * k + c, axis.x * axis.y * k - axis.z, axis.x * axis.z * k + axis.y, 0.0),
                           vec4(axis.y * axis.x * k + axis.z, axis.y * axis.y * k + c, axis.y * axis.z * k - axis.x, 0.0),
                           vec4(axis.z * axis.x * k - axis.y, axis.z * axis.y * k + axis.x, axis.z * axis.z * k + c, 0.0)));
    vec3 turned = mapped(turn, point, 0.0);
    for (uint i = 0; i < 3; i++) turn.rows[i].w = point[i] - turned[i];
    virtual_ = both_maps(virtual_, turn);
}

// Where a ray that meets a portal's surface goes on, and how what is there is seen from before: `virtual_` is put behind.
void go_through(uint surface, SurfaceHit s, inout vec3 origin, inout vec3 direction, inout Map virtual_) {
    Map back;
    bool mirror = true;
    [[dont_unroll]] for (uint i = 0; i < FC.portal_count; i++) {
        Portal portal = FC.portals.at[i];
        if (portal.surface != surface || portal.mirror != 0) continue;
        mirror = false;
        Map there = Map(portal.there);
        back = Map(portal.back);
        origin = mapped(there, s.position, 1.0);
        direction = normalize(mapped(there, direction, 0.0));
    }
    if (mirror) {
        vec3 n = s.geometric_normal;
        back = reflection_at(s.position, n);
        origin = offset_point(s.position, n);
        direction = normalize(direction - n * (2.0 * dot(n, direction)));
    }
    virtual_ = both_maps(virtual_, back);
}

#endif
