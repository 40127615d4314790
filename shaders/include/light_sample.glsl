// One sample of one light. Counterpart of src/reference/light_sample.rs, which says units and measures.
#ifndef LIGHT_SAMPLE_GLSL
#define LIGHT_SAMPLE_GLSL

#include "precise.glsl"

const float PI = 3.14159265358979;

// Lights of numbers from here on are the frame's own: see src/scene/guests.rs.
const uint GUEST_LIGHT = 0x80000000u;

// A light where it is now: what carries it may have moved. A guest that has left (a reservoir may remember it) is dark.
Light light_at(uint number) {
    if (number >= GUEST_LIGHT) {
        uint guest = number - GUEST_LIGHT;
        if (guest >= FC.guest_count) {
            return Light(LIGHT_SPHERE, 0, NONE, NONE, vec3(0.0), 0.0, vec3(0.0), NONE, vec3(0.0), 0, vec3(0.0), 1.0);
        }
        return FC.guest_lights.at[guest];
    }
    Light light = FC.lights.at[number];
    if (light.instance != NONE) {
        Instance carrier = FC.instances.at[light.instance];
        mat4x3 now = transpose(mat3x4(carrier.object_to_world[0], carrier.object_to_world[1], carrier.object_to_world[2]));
        light.p0 = now * vec4(light.p0, 1.0);
        if (light.kind == LIGHT_TRIANGLE) {
            light.p1 = now * vec4(light.p1, 0.0);
            light.p2 = now * vec4(light.p2, 0.0);
        }
    }
    return light;
}

// How the point of a light is sampled.
const uint POINTS_CENTRE = 0;
const uint POINTS_AREA = 1;
const uint POINTS_SOLID_ANGLE = 2;
const float SMALL_SOLID_ANGLE = 2e-3;
const float SMALL_SINE = 0.03;
const float LARGE_SOLID_ANGLE = 0.3;

struct LightSample {
    // Contribution to irradiance/π without visibility; zero where there is none.
    vec3 value;
    // Its part that is not the radiance which leaves the light: cosines, distance and the pdf of the position.
    float geometry;
    // Point, or direction to the sky.
    vec3 target;
    bool sky;
};

float receiver_cosine(SurfaceHit at, vec3 direction) {
    return dot(at.geometric_normal, direction) <= 0.0 ? 0.0 : max(dot(at.shading_normal, direction), 0.0);
}

// Orthonormal tangents of a unit vector (Duff et al. 2017).
void tangents(vec3 n, out vec3 t1, out vec3 t2) {
    float s = n.z >= 0.0 ? 1.0 : -1.0;
    float a = -1.0 / (s + n.z);
    float b = n.x * n.y * a;
    t1 = vec3(1.0 + s * n.x * n.x * a, s * b, -s * n.x);
    t2 = vec3(b, s + n.y * n.y * a, -n.y);
}

// How to sample a triangle by solid angle: see src/reference/light_sample.rs.
const uint SPHERICAL_UNIFORM = 0;
const uint SPHERICAL_AROUND = 1;
const uint SPHERICAL_SMALL = 2;

struct SphericalSample {
    uint kind;
    vec3 direction;
    float solid_angle;
};

SphericalSample spherical_triangle(vec3 pa, vec3 pb, vec3 pc, float volume, vec2 u) {
    vec3 a = pa / length(pa);
    vec3 b = pb / length(pb);
    vec3 c = pc / length(pc);
    float ab = dot(a, b);
    float bc = dot(b, c);
    float ca = dot(c, a);
    float triple = abs(volume) / (length(pa) * length(pb) * length(pc));
    float solid_angle = 2.0 * precise_angle(triple, 1.0 + ab + bc + ca);
    // The longest edge is put opposite to a, whose own edges are then far from half a turn.
    if (ca < bc && ca < ab) {
        vec3 first = pa;
        pa = pb;
        pb = pc;
        pc = first;
        a = b;
        b = c;
        ab = bc;
    } else if (ab < bc) {
        vec3 first = pa;
        pa = pc;
        pc = pb;
        pb = first;
        b = a;
        a = c;
        ab = ca;
    }
    vec3 nb = cross(pa, pb - pa);
    vec3 nc = cross(pa, pc - pa);
    float length_b = length(nb);
    float length_c = length(nc);
    float lb = length_b / (length(pa) * length(pb));
    float lc = length_c / (length(pa) * length(pc));
    float cos_alpha = clamp(dot(nb, nc) / (length_b * length_c), -1.0, 1.0);
    float sin_alpha = triple / (lb * lc);
    bool usable = sin_alpha > SMALL_SINE;
    if (solid_angle <= (usable ? SMALL_SOLID_ANGLE : LARGE_SOLID_ANGLE)) {
        return SphericalSample(SPHERICAL_SMALL, vec3(0.0), 0.0);
    }
    if (!usable) return SphericalSample(SPHERICAL_AROUND, vec3(0.0), 0.0);
    vec2 half_area = precise_sin_cos(0.5 * solid_angle * u.x);
    float tan_ab = lb / (1.0 + ab);
    float x = half_area.x / (tan_ab * (sin_alpha * half_area.y - cos_alpha * half_area.x));
    vec3 on_edge = (a * (1.0 - x * x) + cross(nc, a) * (2.0 * x / length_c)) / (1.0 + x * x);
    vec3 chord = on_edge - b;
    float versine = 0.5 * dot(chord, chord);
    float drop = u.y * versine;
    vec3 across = chord + b * versine;
    float len = length(across);
    vec3 direction = b;
    if (len > 0.0) direction = b * (1.0 - drop) + across * (sqrt(max(drop * (2.0 - drop), 0.0)) / len);
    return SphericalSample(SPHERICAL_UNIFORM, normalize(direction), solid_angle);
}

struct TrianglePoint {
    vec2 barycentrics;
    vec3 position;
    vec3 direction;
    // On the side of the receiver.
    vec3 normal;
    // Contribution per radiance; 0 where there is none.
    float factor;
};

const float SMALL_EDGE_2 = 0.04;

TrianglePoint triangle_point(Light light, SurfaceHit at, vec2 u, uint points) {
    TrianglePoint r;
    r.factor = 0.0;
    vec3 e1 = light.p1;
    vec3 e2 = light.p2;
    r.normal = cross(e1, e2);
    float volume = dot(r.normal, at.position - light.p0);
    r.normal = normalize(r.normal);
    if (volume <= 0.0) {
        if ((light.flags & LIGHT_TWO_SIDED) == 0) return r;
        r.normal = -r.normal;
    }
    vec3 to_middle = light.p0 + (e1 + e2) * (1.0 / 3.0) - at.position;
    if (points == POINTS_SOLID_ANGLE && max(dot(e1, e1), dot(e2, e2)) > SMALL_EDGE_2 * dot(to_middle, to_middle)) {
        vec3 to = light.p0 - at.position;
        SphericalSample s = spherical_triangle(to, light.p0 + e1 - at.position, light.p0 + e2 - at.position, volume, u);
        if (s.kind != SPHERICAL_SMALL) {
            if (s.kind == SPHERICAL_UNIFORM) {
                r.direction = s.direction;
            } else {
                vec2 d = sample_disc(u);
                vec3 t1, t2;
                tangents(at.shading_normal, t1, t2);
                r.direction = t1 * d.x + t2 * d.y + at.shading_normal * sqrt(max(1.0 - d.x * d.x - d.y * d.y, 0.0));
            }
            vec3 across = cross(r.direction, e2);
            float determinant = dot(e1, across);
            if (determinant == 0.0) return r;
            vec3 from = at.position - light.p0;
            float b1 = dot(from, across) / determinant;
            float b2 = dot(r.direction, cross(from, e1)) / determinant;
            if (s.kind == SPHERICAL_AROUND) {
                bool met = b1 >= 0.0 && b2 >= 0.0 && b1 + b2 <= 1.0 && dot(r.direction, r.normal) < 0.0;
                r.factor = met && receiver_cosine(at, r.direction) > 0.0 ? 1.0 : 0.0;
            } else {
                b1 = clamp(b1, 0.0, 1.0);
                b2 = clamp(b2, 0.0, 1.0 - b1);
                r.factor = receiver_cosine(at, r.direction) * s.solid_angle / PI;
            }
            r.barycentrics = vec2(b1, b2);
            r.position = light.p0 + e1 * b1 + e2 * b2;
            return r;
        }
    }
    r.barycentrics = points == POINTS_CENTRE ? vec2(1.0 / 3.0) : sample_triangle_barycentrics(u);
    r.position = light.p0 + e1 * r.barycentrics.x + e2 * r.barycentrics.y;
    vec3 to_light = r.position - at.position;
    float d2 = dot(to_light, to_light);
    if (d2 <= 0.0) return r;
    r.direction = to_light / sqrt(d2);
    r.factor = receiver_cosine(at, r.direction) * max(-dot(r.normal, r.direction), 0.0) * light.size / (PI * d2);
    return r;
}

LightSample sample_triangle_light(Light light, SurfaceHit at, vec2 u, uint points) {
    LightSample r = LightSample(vec3(0.0), 0.0, vec3(0.0), false);
    TrianglePoint p = triangle_point(light, at, u, points);
    if (!(p.factor > 0.0)) return r;
    if (light.kind == LIGHT_DOME) {
        if ((light.flags & LIGHT_EVEN) != 0) {
            r.value = light.radiance * p.factor;
            r.geometry = p.factor;
            r.target = offset_point(p.position, p.normal);
            return r;
        }
        if (p.direction.z <= 0.0) return r;
        float cos_elevation = sqrt(max(1.0 - p.direction.z * p.direction.z, 1e-8));
        r.geometry = p.factor / (PI * cos_elevation);
        r.value = light.radiance * r.geometry;
    } else {
        vec2 uv = uv_at(light.triangle, p.barycentrics);
        r.value = emitted(FC.materials.at[light.material], uv, p.position, p.direction) * (p.factor * light.scale);
        r.geometry = p.factor;
    }
    r.target = offset_point(p.position, p.normal);
    return r;
}

LightSample sample_sphere_light(Light light, SurfaceHit at, vec2 u, bool soft) {
    LightSample r = LightSample(vec3(0.0), 0.0, vec3(0.0), false);
    vec3 to_centre = light.p0 - at.position;
    float d2 = dot(to_centre, to_centre);
    float r2 = light.size * light.size;
    if (d2 <= r2) return r;
    float d = sqrt(d2);
    vec3 axis = to_centre / d;
    float sin2 = r2 / d2;
    float cone = sin2 / (1.0 + sqrt(max(1.0 - sin2, 0.0)));
    vec3 direction = axis;
    float reach = d - light.size;
    if (soft) {
        float drop = u.x * cone;
        float c = 1.0 - drop;
        float s2 = drop * (2.0 - drop);
        float phi = 2.0 * PI * u.y;
        vec3 t1, t2;
        tangents(axis, t1, t2);
        float s = sqrt(max(s2, 0.0));
        direction = axis * c + t1 * (s * cos(phi)) + t2 * (s * sin(phi));
        reach = d * c - sqrt(max(r2 - d2 * s2, 0.0));
    }
    float cosine = receiver_cosine(at, direction);
    if (cosine <= 0.0) return r;
    if ((light.flags & LIGHT_NO_COSINE) != 0) cosine = 1.0;
    if ((light.flags & LIGHT_LINEAR) != 0) {
        r.geometry = max(light.p2.z - d * light.p2.y, 0.0) * cosine;
    } else {
        r.geometry = 2.0 * cone * cosine;
    }
    if ((light.flags & LIGHT_SPOT) != 0) {
        float along = -dot(to_centre, light.p1);
        float off = length(-to_centre - light.p1 * along);
        float edge = along > 0.0 ? (light.p2.x * along - off) / 32.0 : 0.0;
        r.geometry *= clamp(edge, 0.0, 1.0);
    }
    r.value = light.radiance * r.geometry;
    r.target = at.position + direction * reach;
    return r;
}

LightSample sky_sample(SurfaceHit at, float azimuth, float elevation, vec3 value) {
    vec3 direction = vec3(cos(azimuth) * cos(elevation), sin(azimuth) * cos(elevation), sin(elevation));
    float cosine = receiver_cosine(at, direction);
    return LightSample(value * cosine, cosine, direction, true);
}

LightSample sample_light(Light light, SurfaceHit at, vec2 u, uint points) {
    LightSample r;
    bool soft = points != POINTS_CENTRE;
    if (light.kind == LIGHT_TRIANGLE || light.kind == LIGHT_DOME) {
        r = sample_triangle_light(light, at, u, points);
    } else if (light.kind == LIGHT_SPHERE) {
        r = sample_sphere_light(light, at, u, soft);
    } else {
        vec2 p = soft ? sample_disc(u) : vec2(0.0);
        r = sky_sample(at, light.p1.x + p.x * light.p1.z, light.p1.y + p.y * light.p1.z, light.radiance);
    }
    // A value that is not finite would stay in every history it enters: it is rejected where it arises.
    if (any(isnan(r.value)) || any(isinf(r.value))) r.value = vec3(0.0);
    return r;
}

#endif
