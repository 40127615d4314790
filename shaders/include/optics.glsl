// Reflection and refraction. Counterpart of src/scene/optics.rs, which explains it.
#ifndef OPTICS_GLSL
#define OPTICS_GLSL

#include "light_sample.glsl"

float fresnel(float cosine, float eta) {
    float c = clamp(cosine, 0.0, 1.0);
    float sin2 = eta * eta * (1.0 - c * c);
    if (sin2 >= 1.0) return 1.0;
    float t = sqrt(1.0 - sin2);
    float s = (eta * c - t) / (eta * c + t);
    float p = (c - eta * t) / (c + eta * t);
    return 0.5 * (s * s + p * p);
}

float fresnel_pane(float cosine, float ior) {
    float f = fresnel(cosine, 1.0 / ior);
    return 2.0 * f / (1.0 + f);
}

// Zero where nothing gets through.
vec3 refracted(vec3 direction, vec3 normal, float eta) {
    float c = -dot(normal, direction);
    float k = 1.0 - eta * eta * (1.0 - c * c);
    return k > 0.0 ? normalize(direction * eta + normal * (eta * c - sqrt(k))) : vec3(0.0);
}

vec3 reflected(vec3 direction, vec3 normal) {
    return direction - normal * (2.0 * dot(normal, direction));
}

vec3 schlick(vec3 at_normal, float cosine) {
    float x = 1.0 - clamp(cosine, 0.0, 1.0);
    float x2 = x * x;
    return at_normal + (1.0 - at_normal) * (x2 * x2 * x);
}

struct Lobe {
    vec3 normal;
    vec3 view;
    // 0: none.
    float alpha;
};

float lobe_cosine(Lobe l) {
    return max(dot(l.normal, l.view), 1e-4);
}

float lobe_lambda(Lobe l, float cosine) {
    float c2 = cosine * cosine;
    return 0.5 * (sqrt(1.0 + l.alpha * l.alpha * ((1.0 - c2) / c2)) - 1.0);
}

float lobe_density(Lobe l, vec3 half_) {
    float c = dot(l.normal, half_);
    float a2 = l.alpha * l.alpha;
    vec3 off = half_ - l.normal * c;
    float d = c * c * a2 + dot(off, off);
    return c > 0.0 ? a2 / (PI * d * d) : 0.0;
}

// Weight 0 below the surface.
vec3 sample_lobe(Lobe l, vec2 u, out float weight) {
    vec3 t1, t2;
    tangents(l.normal, t1, t2);
    float cosine = lobe_cosine(l);
    vec3 v = vec3(dot(l.view, t1), dot(l.view, t2), cosine);
    vec3 stretched = normalize(vec3(l.alpha * v.xy, v.z));
    float across = dot(stretched.xy, stretched.xy);
    vec3 a = across > 0.0 ? vec3(-stretched.y, stretched.x, 0.0) / sqrt(across) : vec3(1.0, 0.0, 0.0);
    vec3 b = cross(stretched, a);
    float r = sqrt(u.x);
    float phi = 2.0 * PI * u.y;
    float s = 0.5 * (1.0 + stretched.z);
    float x = r * cos(phi);
    float y = (1.0 - s) * sqrt(max(1.0 - x * x, 0.0)) + s * r * sin(phi);
    vec3 h = a * x + b * y + stretched * sqrt(max(1.0 - x * x - y * y, 0.0));
    h = normalize(vec3(l.alpha * h.xy, max(h.z, 0.0)));
    vec3 half_ = t1 * h.x + t2 * h.y + l.normal * h.z;
    vec3 direction = normalize(reflected(-l.view, half_));
    float out_ = dot(l.normal, direction);
    weight = 0.0;
    if (out_ <= 0.0) return direction;
    float to_view = lobe_lambda(l, cosine);
    weight = (1.0 + to_view) / (1.0 + to_view + lobe_lambda(l, out_));
    return direction;
}

float lobe_pdf(Lobe l, vec3 direction) {
    vec3 sum = l.view + direction;
    if (dot(l.normal, direction) <= 0.0 || sum == vec3(0.0)) return 0.0;
    float c = lobe_cosine(l);
    return lobe_density(l, normalize(sum)) / ((1.0 + lobe_lambda(l, c)) * 4.0 * c);
}

float lobe_brdf(Lobe l, vec3 direction) {
    float out_ = dot(l.normal, direction);
    vec3 sum = l.view + direction;
    if (out_ <= 0.0 || sum == vec3(0.0)) return 0.0;
    float c = lobe_cosine(l);
    float masking = 1.0 + lobe_lambda(l, c) + lobe_lambda(l, out_);
    return lobe_density(l, normalize(sum)) / (4.0 * c * out_ * masking);
}

#endif
