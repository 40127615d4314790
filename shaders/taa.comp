#version 460
// Temporal anti-aliasing: the composed radiance, one place in each pixel per frame, blended with that of frames before.
//
// Linear light, weighted by 1/(1 + Y·exposure) so that bright edges do not win (Karis 2014); history is fetched with a
// Catmull-Rom filter along the motion of the nearest surface around, and held to the mean ± γ standard deviations of the
// pixel's surroundings in YCoCg (Salvi 2016). While view and scene stand still nothing is held back, and the result is the
// mean over the pixel.
#extension GL_GOOGLE_include_directive : require
#include "prelude.glsl"
#include "gbuffer.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

// Least weight of a new frame, and while everything stands still.
const float LEAST_WEIGHT = 0.1;
const float LEAST_STILL = 1.0 / 256.0;

vec3 to_ycocg(vec3 c) {
    return vec3(dot(c, vec3(0.25, 0.5, 0.25)), dot(c, vec3(0.5, 0.0, -0.5)), dot(c, vec3(-0.25, 0.5, -0.25)));
}

vec3 from_ycocg(vec3 c) {
    float t = c.x - c.z;
    return vec3(t + c.y, c.x + c.z, t - c.y);
}

float exposure() {
    return FC.fixed_exposure > 0.0 ? FC.fixed_exposure : max(FC.exposure.at[0], 1e-3);
}

// Compressed radiance in YCoCg, and back: averages of it are not made by the brightest parts. Y is what is compressed by, so
// that nothing whose Y is bounded by a neighbour's expands to more than that.
vec3 compress(vec3 c, float e) {
    vec3 y = to_ycocg(c);
    return y / (1.0 + y.x * e);
}

vec3 expand(vec3 y, float e) {
    return from_ycocg(y / max(1.0 - y.x * e, 1e-6));
}

vec4 weights_of(float t) {
    float t2 = t * t;
    float t3 = t2 * t;
    return vec4(-0.5 * t3 + t2 - 0.5 * t, 1.5 * t3 - 2.5 * t2 + 1.0, -1.5 * t3 + 2.0 * t2 + 0.5 * t, 0.5 * t3 - 0.5 * t2);
}

// History at a place (pixel centres are whole numbers), compressed: Catmull-Rom, held to the range of the four nearest.
vec4 history_at(vec2 place, float e) {
    ivec2 first = ivec2(floor(place));
    vec2 part = place - vec2(first);
    vec4 wx = weights_of(part.x);
    vec4 wy = weights_of(part.y);
    vec3 sum = vec3(0.0);
    vec3 low = vec3(1e30);
    vec3 high = vec3(-1e30);
    float frames = 1e9;
    for (int y = 0; y < 4; y++) {
        for (int x = 0; x < 4; x++) {
            ivec2 q = clamp(first + ivec2(x - 1, y - 1), ivec2(0), ivec2(FC.size) - 1);
            vec4 h = imageLoad(taa_before, q);
            vec3 c = compress(h.rgb, e);
            sum += c * (wx[x] * wy[y]);
            if (x > 0 && x < 3 && y > 0 && y < 3) {
                frames = min(frames, h.a);
                low = min(low, c);
                high = max(high, c);
            }
        }
    }
    return vec4(clamp(sum, low, high), frames);
}

void main() {
    uvec2 pixel = gl_GlobalInvocationID.xy;
    if (any(greaterThanEqual(pixel, FC.size))) return;
    ivec2 p = ivec2(pixel);
    vec3 own = imageLoad(image_composite, p).rgb;
    if (any(isnan(own)) || any(isinf(own))) own = vec3(0.0);
    if (FC.history == 0) {
        imageStore(taa_now, p, vec4(own, 1.0));
        return;
    }
    if (FC.still != 0) {
        vec4 before = imageLoad(taa_before, p);
        float frames = before.a + 1.0;
        // Weights grow with the frame's number: early ones were denoised from fewer samples.
        imageStore(taa_now, p, vec4(mix(before.rgb, own, max(2.0 / (frames + 1.0), LEAST_STILL)), frames));
        return;
    }
    float e = exposure();
    vec3 mean = vec3(0.0);
    vec3 square = vec3(0.0);
    float brightest = 0.0;
    float nearest = 1e30;
    vec2 motion = imageLoad(gbuffer_motion, p).xy;
    for (int i = 0; i < 9; i++) {
        ivec2 q = clamp(p + ivec2(i % 3 - 1, i / 3 - 1), ivec2(0), ivec2(FC.size) - 1);
        vec3 c = compress(imageLoad(image_composite, q).rgb, e);
        if (any(isnan(c)) || any(isinf(c))) c = vec3(0.0);
        mean += c / 9.0;
        square += c * c / 9.0;
        brightest = max(brightest, c.x);
        vec3 m = imageLoad(gbuffer_motion, q).xyz;
        if (m.z > 0.0 && m.z < nearest) {
            nearest = m.z;
            motion = m.xy;
        }
    }
    vec2 place = vec2(p) + motion;
    vec4 result = vec4(own, 1.0);
    if (all(greaterThan(place, vec2(-0.5))) && all(lessThan(place, vec2(FC.size) - 0.5))) {
        vec4 before = history_at(place, e);
        vec3 reach = FC.taa_gamma * sqrt(max(square - mean * mean, vec3(0.0)));
        vec3 held = clamp(before.rgb, mean - reach, mean + reach);
        held.x = min(held.x, brightest);
        float frames = min(before.a + 1.0, 1.0 / LEAST_WEIGHT);
        // Linear light, each weighted by what compression leaves of it (Karis 2014).
        vec3 old = max(expand(held, e), vec3(0.0));
        float old_weight = (1.0 - 1.0 / frames) / (1.0 + to_ycocg(old).x * e);
        float own_weight = (1.0 / frames) / (1.0 + to_ycocg(own).x * e);
        result = vec4((old * old_weight + own * own_weight) / (old_weight + own_weight), frames);
    }
    imageStore(taa_now, p, result);
}
