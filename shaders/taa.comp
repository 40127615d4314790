#version 460
// Temporal anti-aliasing: the composed radiance, one place in each pixel per frame, blended with that of frames before.
//
// Linear light, weighted by 1/(1 + Y·exposure) so that bright edges do not win (Karis 2014). All pixels of a frame are looked at in
// the same place of theirs, which is not their centre: where view or scene change, what each shows at its centre is interpolated from
// its surroundings, or textures would tremble with the place. History is fetched with a cubic
// filter along the motion of the surface, at edges of the nearest one around, and held to the mean ± γ standard deviations of the
// pixel's surroundings in YCoCg (Salvi 2016). While view and scene stand still nothing is held back, and the result is the
// mean over the pixel.
#extension GL_GOOGLE_include_directive : require
#include "prelude.glsl"
#include "gbuffer.glsl"
#include "gradient.glsl"
#include "half_precision.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

// Least weight of a new frame, where the history lies on pixels, halfway between them, and while everything stands still.
const float LEAST_WEIGHT = 0.1;
const float LEAST_BETWEEN = 0.5;
const float LEAST_STILL = 1.0 / 256.0;
// Frames that a sky counts for which is the mean over its pixel.
const float SKY_FRAMES = 16.0;
// Farther away than so many times as far as a neighbour, and units, a pixel lies behind an edge.
const vec2 EDGE_DEPTHS = vec2(1.1, 1.0);

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

// Sharper than Catmull and Rom's, whose third number is −0.5: what is fetched again and again is blurred each time.
const float CUBIC = -0.75;

vec4 weights_of(float t) {
    float t2 = t * t;
    float t3 = t2 * t;
    return vec4(CUBIC * (t3 - 2.0 * t2 + t), (CUBIC + 2.0) * t3 - (CUBIC + 3.0) * t2 + 1.0,
                -(CUBIC + 2.0) * t3 + (2.0 * CUBIC + 3.0) * t2 - CUBIC * t, CUBIC * (t2 - t3));
}

// Radiance that the history shows at a place (pixel centres are whole numbers), and its frames: a cubic filter without its four
// corners, whose weights are next to nothing.
vec4 history_at(vec2 place) {
    ivec2 first = ivec2(floor(place));
    vec2 part = place - vec2(first);
    vec4 wx = weights_of(part.x);
    vec4 wy = weights_of(part.y);
    ivec2 last = ivec2(FC.size) - 1;
    vec3 sum = vec3(0.0);
    float frames = 1e9;
    [[unroll]] for (int y = 0; y < 4; y++) {
        [[unroll]] for (int x = 0; x < 4; x++) {
            if ((x == 0 || x == 3) && (y == 0 || y == 3)) continue;
            vec4 h = imageLoad(taa_before, clamp(first + ivec2(x - 1, y - 1), ivec2(0), last));
            sum += h.rgb * (wx[x] * wy[y]);
            if (x > 0 && x < 3 && y > 0 && y < 3) frames = min(frames, h.a);
        }
    }
    // All sixteen weights sum to 1.
    float corners = (wx.x + wx.w) * (wy.x + wy.w);
    return vec4(max(sum / (1.0 - corners), vec3(0.0)), frames);
}

// What the work group and the pixels around it show, compressed, and how far away; 0 where a sky is the mean over its pixel.
const int EDGE = 10;
shared vec4 around[EDGE * EDGE];

void read_around(ivec2 corner, float e) {
    for (int i = int(gl_LocalInvocationIndex); i < EDGE * EDGE; i += 64) {
        ivec2 q = clamp(corner + ivec2(i % EDGE, i / EDGE) - 1, ivec2(0), ivec2(FC.size) - 1);
        vec3 c = compress(imageLoad(image_composite, q).rgb, e);
        if (any(isnan(c)) || any(isinf(c))) c = vec3(0.0);
        around[i] = vec4(c, imageLoad(gbuffer_motion, q).z);
    }
}

// Standard deviation of the weights by which a frame is interpolated, pixels.
const float INTERPOLATION = 0.35;

// Weights of a pixel and its neighbours before and after it, along the image's sides: the same for all pixels.
shared vec3 interpolation[2];

void make_interpolation() {
    int side = int(gl_LocalInvocationIndex);
    if (side > 1) return;
    vec3 off = vec3(-1.0, 0.0, 1.0) + (FC.jitter[side] - 0.5);
    vec3 w = exp(off * off * (-0.5 / (INTERPOLATION * INTERPOLATION)));
    interpolation[side] = w / (w.x + w.y + w.z);
}

vec4 blended(ivec2 p, vec3 own, float e) {
    int centre = (int(gl_LocalInvocationID.y) + 1) * EDGE + int(gl_LocalInvocationID.x) + 1;
    vec3 mean = vec3(0.0);
    vec3 square = vec3(0.0);
    vec3 interpolated = vec3(0.0);
    vec3 wx = interpolation[0];
    vec3 wy = interpolation[1];
    float brightest = 0.0;
    float nearest = 1e30;
    ivec2 nearest_at = ivec2(0);
    [[unroll]] for (int y = -1; y <= 1; y++) {
        [[unroll]] for (int x = -1; x <= 1; x++) {
            vec4 c = around[centre + y * EDGE + x];
            mean += c.rgb / 9.0;
            square += c.rgb * c.rgb / 9.0;
            interpolated += c.rgb * (wx[x + 1] * wy[y + 1]);
            brightest = max(brightest, c.x);
            if (c.w > 0.0 && c.w < nearest) {
                nearest = c.w;
                nearest_at = ivec2(x, y);
            }
        }
    }
    if (nearest == 1e30) return vec4(own, SKY_FRAMES);
    // The mean of compressed radiance is that of radiance with the weights above.
    own = max(expand(interpolated, e), vec3(0.0));
    // On the surface itself every pixel moves by its own: to take its neighbour's would shift it a little in each frame.
    float own_depth = around[centre].w;
    if (own_depth > 0.0 && own_depth < nearest * EDGE_DEPTHS.x + EDGE_DEPTHS.y) nearest_at = ivec2(0);
    ivec2 q = clamp(p + nearest_at, ivec2(0), ivec2(FC.size) - 1);
    vec2 place = vec2(p) + imageLoad(gbuffer_motion, q).xy;
    if (!(all(greaterThan(place, vec2(-0.5))) && all(lessThan(place, vec2(FC.size) - 0.5)))) return vec4(own, 1.0);
    vec4 before = history_at(place);
    vec3 reach = FC.taa_gamma * sqrt(max(square - mean * mean, vec3(0.0)));
    vec3 held = clamp(compress(before.rgb, e), mean - reach, mean + reach);
    held.x = min(held.x, brightest);
    // What is fetched from between pixels is blurred: it counts the less.
    vec2 off = place - round(place);
    float between = 2.0 * max(abs(off.x), abs(off.y));
    // And what shows light that has changed since counts the less, as in the denoiser's history.
    float kept = FC.denoised != 0 ? before.a * (1.0 - gradient_at(p)) : before.a;
    float frames = min(kept + 1.0, 1.0 / mix(LEAST_WEIGHT, LEAST_BETWEEN, between));
    // Linear light, each weighted by what compression leaves of it (Karis 2014).
    vec3 old = max(expand(held, e), vec3(0.0));
    float old_weight = (1.0 - 1.0 / frames) / (1.0 + to_ycocg(old).x * e);
    float own_weight = (1.0 / frames) / (1.0 + to_ycocg(own).x * e);
    return vec4((old * old_weight + own * own_weight) / (old_weight + own_weight), frames);
}

void main() {
    ivec2 p = ivec2(gl_GlobalInvocationID.xy);
    bool inside = all(lessThan(gl_GlobalInvocationID.xy, FC.size));
    bool blends = FC.history != 0 && FC.still == 0;
    float e = exposure();
    if (blends) {
        read_around(ivec2(gl_WorkGroupID.xy) * 8, e);
        make_interpolation();
        barrier();
    }
    if (!inside) return;
    vec3 own = imageLoad(image_composite, p).rgb;
    if (any(isnan(own)) || any(isinf(own))) own = vec3(0.0);
    vec4 result = vec4(own, 1.0);
    if (blends) {
        result = blended(p, own, e);
    } else if (FC.history != 0) {
        vec4 before = FC.still == 1 ? imageLoad(taa_before, p) : imageLoad(taa_mean, p);
        float frames = before.a + 1.0;
        // Weights grow with the frame's number: early ones were denoised from fewer samples.
        result = vec4(mix(before.rgb, own, max(2.0 / (frames + 1.0), LEAST_STILL)), frames);
    }
    // In half precision small parts of new frames would be lost to rounding.
    if (FC.still != 0) imageStore(taa_mean, p, result);
    imageStore(taa_now, p, vec4(min(result.rgb, vec3(MOST_KEPT)), min(result.a, MOST_FRAMES)));
}
