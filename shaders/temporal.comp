#version 460
// Temporal stage of the denoiser (A-SVGF: Schied, Peters and Dachsbacher 2018; SVGF: Schied et al. 2017, section 4.1 and 4.2):
// irradiance and moments of its luminance blended with those of the same surface in the frame before, and the variance of the
// result. Light that branches off (SECONDARY) is a signal of its own: radiance, held together by the surface that it branches off at, and
// moving as what is seen in that surface does.
//
// The weight of the new frame is the inverse of the number of frames, but not less than `rt_leastAlpha`; where the gradient
// says that the light has changed, it rises to 1 and the number of frames shrinks with it.
#extension GL_GOOGLE_include_directive : require
#include "prelude.glsl"
#include "gbuffer.glsl"
#include "channel.glsl"
#include "camera_motion.glsl"
#include "guide.glsl"
#include "luminance.glsl"
#include "packed.glsl"
#include "gradient.glsl"
#include "secondary_tiles.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

// Farther than this off the surface's plane a sample of the frame before belongs to another surface: a share of its depth
// and units.
const vec2 OFF_PLANE = vec2(0.004, 0.25);
const float LEAST_COSINE = 0.9;
// With fewer frames the variance is estimated over the surroundings.
const float FEW_FRAMES = 4.0;
const int SURROUNDINGS = 3;
// Where a pixel's own place in the frame before shows another surface, what the pixels around had counts as so many frames: light may
// end between them, and where a pixel shows now this surface, now that, theirs would be taken again and again.
const float FRAMES_AROUND = 1.0;
// A variance that so many samples tell of, all of which find light, is raised to twice its size.
const float WELL_KNOWN = 35.0;
// Of so many samples one at least is taken to find light.
const float RAREST = 16.0;
// How many standard errors the light that branches off may differ from its surroundings' where the scene has changed.
const float LAG = 3.0;

struct Past {
    vec3 irradiance;
    // Share of one sample's variance that the mean has.
    float share;
    vec2 moments;
    float frames;
};

Guide guide_at(ivec2 p) {
    return unpack_guide(imageLoad(channel_guide, p));
}

vec3 sample_at(ivec2 p) {
    return imageLoad(channel_sample, p).rgb;
}

void store_result(ivec2 p, uvec4 result) {
    imageStore(filter_a, p, result);
    // Where the filter has levels, the first one's result is what the next frame starts from.
    if (!IS_SECONDARY && FC.filter_levels == 0) imageStore(channel_now, p, result);
}

// A pixel's surface along the axes of the view before.
struct Before {
    uint id;
    vec3 normal;
    // Distance of its plane from the eye, along the normal, and the most that it may be off.
    float plane;
    float slack;
};

bool same_surface(ivec2 q, uvec4 guide_words, Before b) {
    Guide other = unpack_guide(guide_words);
    vec3 ray = old_view_point(vec2(q) + jitter_before(), 1.0);
    bool near = abs(other.depth * dot(ray, b.normal) - b.plane) < b.slack;
    return near && other.depth > 0.0 && other.id == b.id && dot(other.normal, b.normal) >= LEAST_COSINE;
}

bool inside(ivec2 q) {
    return all(greaterThanEqual(q, ivec2(0))) && all(lessThan(q, ivec2(FC.size)));
}

void add(inout Past past, inout float weights, vec4 moments, uvec4 colour, float weight) {
    moments = moments_of(moments);
    past.irradiance += unpack_colour(colour).rgb * weight;
    past.share += moments.w * weight;
    past.moments += moments.xy * weight;
    past.frames += moments.z * weight;
    weights += weight;
}

// Length of the way that what branches off at a pixel goes to the next surface, units: its own or the longest one near it, since in a
// frame not all pixels follow what branches off; 0 where none does.
float way_of(ivec2 p) {
    float own = imageLoad(channel_sample, p).a;
    if (own > 0.0) return own;
    for (int i = 0; i < 16; i++) {
        ivec2 q = clamp(p + 2 * ivec2(i & 3, i >> 2) - 3, ivec2(0), ivec2(FC.size) - 1);
        own = max(own, imageLoad(channel_sample, q).a);
    }
    return own;
}

// What the surface of a pixel had in the frame before; no frames where it was not seen.
Past past_of(ivec2 p, Guide g) {
    Past past = Past(vec3(0.0), 1.0, vec2(0.0), 0.0);
    if (FC.history == 0) return past;
    // From the depth rather than the G-buffer's position and motion: memory is what bounds this pass.
    vec3 here = view_point(vec2(p) + jitter_now(), g.depth);
    vec3 point = FC.eye + FC.right * here.x + FC.up * here.y + FC.forward * here.z;
    // Reflected in a plane, things move as their images behind it do.
    vec3 shown = point;
    if (IS_SECONDARY && FC.still == 0) shown += (point - FC.eye) * (way_of(p) / length(here));
    vec2 motion = FC.still != 0 ? vec2(0.0) : motion_of(shown);
    if (abs(motion.x) > float(FC.size.x) || abs(motion.y) > float(FC.size.y)) return past;
    vec3 at = to_old_view(point - FC.old_eye);
    if (!IS_SECONDARY && FC.moving != 0) {
        vec4 m = imageLoad(gbuffer_motion, p);
        motion = m.xy;
        vec2 s = (vec2(p) + jitter_now() + motion) / vec2(FC.size) * 2.0 - 1.0;
        at = vec3(s.x * FC.old_half_width, -s.y * FC.old_half_height, 1.0) * m.w;
        if (abs(motion.x) > float(FC.size.x) || abs(motion.y) > float(FC.size.y)) return past;
    }
    vec3 normal = to_old_view(FC.right * g.normal.x + FC.up * g.normal.y + FC.forward * g.normal.z);
    Before b = Before(g.id, normal, dot(at, normal), OFF_PLANE.x * at.z + OFF_PLANE.y);
    Past sum = Past(vec3(0.0), 0.0, vec2(0.0), 0.0);
    float weights = 0.0;
    vec2 place = vec2(p) + motion;
    ivec2 first = ivec2(floor(place));
    vec2 part = place - vec2(first);
    // All four are asked for at once, then what passes.
    uvec4 guides[4];
    float shares[4];
    [[unroll]] for (int i = 0; i < 4; i++) {
        ivec2 step_ = ivec2(i & 1, i >> 1);
        vec2 near = mix(1.0 - part, part, vec2(step_));
        shares[i] = near.x * near.y;
        if (shares[i] <= 1e-3 || !inside(first + step_)) shares[i] = 0.0;
        guides[i] = shares[i] > 0.0 ? imageLoad(channel_old_guide, first + step_) : uvec4(0);
    }
    vec4 moments[4];
    uvec4 colours[4];
    [[unroll]] for (int i = 0; i < 4; i++) {
        ivec2 q = first + ivec2(i & 1, i >> 1);
        if (!same_surface(q, guides[i], b)) shares[i] = 0.0;
        moments[i] = shares[i] > 0.0 ? imageLoad(channel_moments_before, q) : vec4(0.0);
        colours[i] = shares[i] > 0.0 ? imageLoad(channel_before, q) : uvec4(0);
    }
    [[unroll]] for (int i = 0; i < 4; i++) add(sum, weights, moments[i], colours[i], shares[i]);
    bool around = weights < 0.05;
    if (around) {
        // Hardly any of the four nearest shows the surface: its edge may have run between them.
        ivec2 centre = ivec2(round(place));
        [[dont_unroll]] for (int i = 0; i < 9; i++) {
            ivec2 q = centre + ivec2(i % 3 - 1, i / 3 - 1);
            if (!inside(q) || !same_surface(q, imageLoad(channel_old_guide, q), b)) continue;
            add(sum, weights, imageLoad(channel_moments_before, q), imageLoad(channel_before, q), 0.1);
        }
    }
    if (weights <= 0.0) return past;
    float frames = sum.frames / weights;
    if (around) frames = min(frames, FRAMES_AROUND);
    return Past(sum.irradiance / weights, sum.share / weights, sum.moments / weights, frames);
}

// Mean and second moment of the luminance of this frame's samples around a pixel on the same surface.
vec3 surroundings(ivec2 p, Guide g, int reach, bool itself) {
    vec3 at = view_point(vec2(p) + jitter_now(), g.depth);
    vec3 normal = g.normal;
    vec3 sum = vec3(0.0);
    if (itself) {
        float l = luminance(sample_at(p));
        sum = vec3(l, l * l, 1.0);
    }
    // Every other pixel is enough, of so wide a square.
    [[dont_unroll]] for (int y = -reach; y <= reach; y += 2) {
        [[dont_unroll]] for (int x = -reach; x <= reach; x += 2) {
            ivec2 q = p + ivec2(x, y);
            if (any(lessThan(q, ivec2(0))) || any(greaterThanEqual(q, ivec2(FC.size)))) continue;
            Guide other = guide_at(q);
            if (other.depth <= 0.0 || dot(other.normal, g.normal) < LEAST_COSINE) continue;
            vec3 there = view_point(vec2(q) + jitter_now(), other.depth);
            if (abs(dot(there - at, normal)) > OFF_PLANE.x * at.z + OFF_PLANE.y) continue;
            float l = luminance(sample_at(q));
            sum += vec3(l, l * l, 1.0);
        }
    }
    return sum;
}

// Variance of the mean of samples that have these moments, as high as it may be. `share`: of one sample's variance, what the mean has.
// Second moment over first moment² is how many samples there are for one that finds light, were all light alike: 1 / share samples are
// worth so many times fewer (Kish's effective sample size).
float variance_of_mean(vec2 moments, float share) {
    float rare = min(moments.y / max(moments.x * moments.x, 1e-20), RAREST);
    return max(moments.y - moments.x * moments.x, 0.0) * share * (1.0 + WELL_KNOWN * rare * share);
}

// How much the light at a pixel has changed since the frame before, 0..1.
float change_at(ivec2 p, Guide g, Past past) {
    if (!IS_SECONDARY) return gradient_at(p);
    if (FC.changed == 0 || past.frames <= 0.0) return 0.0;
    // No sample of the frame before is taken again here: what the surroundings show now has to do.
    vec3 around = surroundings(p, g, SURROUNDINGS, true);
    vec2 mean = around.xy / max(around.z, 1.0);
    // As the samples before spread, too: where none of the few around found light, their own spread is nothing.
    float spread = max(mean.y - mean.x * mean.x, past.moments.y - past.moments.x * past.moments.x);
    float error = sqrt(max(spread, 0.0) / max(around.z, 1.0));
    float before = luminance(past.irradiance);
    float off = abs(before - mean.x) - LAG * error;
    return off > 0.0 ? clamp(off / max(before, mean.x), 0.0, 1.0) : 0.0;
}

void main() {
    uvec2 pixel = gl_GlobalInvocationID.xy;
    if (any(greaterThanEqual(pixel, FC.size))) return;
    ivec2 p = ivec2(pixel);
    if (IS_SECONDARY && !tile_branches(p / 8)) return;
    Guide g = guide_at(p);
    if (g.depth <= 0.0) {
        // What the other channel's images hold where its guide is empty counts for nothing.
        if (IS_SECONDARY) return;
        store_result(p, uvec4(0));
        imageStore(channel_moments_now, p, kept_moments(vec2(0.0), 0.0, 1.0));
        return;
    }
    vec3 sampled = sample_at(p);
    // History keeps what it is given for ever.
    if (any(isnan(sampled)) || any(isinf(sampled))) sampled = vec3(0.0);
    if (FC.fireflies > 0.0) {
        // Without the sample itself, which would raise the bound that it is held against.
        vec3 around = surroundings(p, g, SURROUNDINGS, false);
        float own = luminance(sampled);
        vec2 others = around.xy / max(around.z, 1.0);
        float most = others.x + FC.fireflies * sqrt(max(others.y - others.x * others.x, 0.0));
        if (around.z > 3.0 && own > most) sampled *= most / own;
    }
    float l = luminance(sampled);
    Past past = past_of(p, g);
    float change = change_at(p, g, past);
    float frames = past.frames * (1.0 - change) + 1.0;
    float alpha = past.frames <= 0.0 ? 1.0 : mix(max(1.0 / frames, FC.least_alpha), 1.0, change);
    vec3 irradiance = mix(past.irradiance, sampled, alpha);
    vec2 moments = mix(past.moments, vec2(l, l * l), alpha);
    float share = (1.0 - alpha) * (1.0 - alpha) * past.share + alpha * alpha;
    float variance = variance_of_mean(moments, share);
    if (frames < FEW_FRAMES) {
        vec3 around = surroundings(p, g, SURROUNDINGS, true);
        variance = max(variance, variance_of_mean(around.xy / max(around.z, 1.0), share));
    }
    store_result(p, pack_colour(irradiance, variance));
    imageStore(channel_moments_now, p, kept_moments(moments, frames, share));
    // A pixel of each 16 x 16 tells for all of them how long their history is.
    if (!IS_SECONDARY && ((p.x | p.y) & 15) == 0) {
        atomicAdd(FC.counters.at[4], uint(min(frames, 4096.0)));
        atomicAdd(FC.counters.at[5], 1);
    }
}
