// One sample of one light. Counterpart of src/reference/light_sample.rs, which says units and measures.
#ifndef LIGHT_SAMPLE_GLSL
#define LIGHT_SAMPLE_GLSL

const float PI = 3.14159265358979;

struct LightSample {
    // Contribution to irradiance/π without visibility; zero where there is none.
    vec3 value;
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

LightSample sample_triangle_light(Light light, SurfaceHit at, vec2 u, bool soft) {
    LightSample r = LightSample(vec3(0.0), vec3(0.0), false);
    vec2 b = soft ? sample_triangle_barycentrics(u) : vec2(1.0 / 3.0);
    vec3 point = light.p0 + light.p1 * b.x + light.p2 * b.y;
    vec3 to_light = point - at.position;
    float d2 = dot(to_light, to_light);
    if (d2 <= 0.0) return r;
    vec3 direction = to_light / sqrt(d2);
    float cos_receiver = receiver_cosine(at, direction);
    vec3 normal = normalize(cross(light.p1, light.p2));
    float cos_light = -dot(normal, direction);
    bool two_sided = (light.flags & LIGHT_TWO_SIDED) != 0;
    if (cos_receiver <= 0.0 || (cos_light <= 0.0 && !two_sided) || cos_light == 0.0) return r;
    vec3 radiance = emitted(FC.materials.at[light.material], uv_at(light.triangle, b), direction);
    r.value = radiance * (cos_receiver * abs(cos_light) * light.size / (PI * d2));
    r.target = offset_point(point, cos_light > 0.0 ? normal : -normal);
    return r;
}

LightSample sample_sphere_light(Light light, SurfaceHit at, vec2 u, bool soft) {
    LightSample r = LightSample(vec3(0.0), vec3(0.0), false);
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
        r.value = light.radiance * (max(light.p2.z - d * light.p2.y, 0.0) * cosine);
    } else {
        r.value = light.radiance * (2.0 * cone * cosine);
    }
    if ((light.flags & LIGHT_SPOT) != 0) {
        float along = -dot(to_centre, light.p1);
        float off = length(-to_centre - light.p1 * along);
        float edge = along > 0.0 ? (light.p2.x * along - off) / 32.0 : 0.0;
        r.value *= clamp(edge, 0.0, 1.0);
    }
    r.target = at.position + direction * reach;
    return r;
}

LightSample sky_sample(SurfaceHit at, float azimuth, float elevation, vec3 value) {
    vec3 direction = vec3(cos(azimuth) * cos(elevation), sin(azimuth) * cos(elevation), sin(elevation));
    return LightSample(value * receiver_cosine(at, direction), direction, true);
}

LightSample sample_light(Light light, SurfaceHit at, vec2 u, bool soft) {
    LightSample r;
    if (light.kind == LIGHT_TRIANGLE) {
        r = sample_triangle_light(light, at, u, soft);
    } else if (light.kind == LIGHT_SPHERE) {
        r = sample_sphere_light(light, at, u, soft);
    } else if (light.kind == LIGHT_SUN) {
        vec2 p = soft ? sample_disc(u) : vec2(0.0);
        r = sky_sample(at, light.p1.x + p.x * light.p1.z, light.p1.y + p.y * light.p1.z, light.radiance);
    } else {
        r = sky_sample(at, 2.0 * PI * u.x, 0.5 * PI * u.y, light.radiance);
    }
    // A value that is not finite would stay in every history it enters: it is rejected where it arises.
    if (any(isnan(r.value)) || any(isinf(r.value))) r.value = vec3(0.0);
    return r;
}

#endif
