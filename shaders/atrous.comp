#version 460
// A level of the denoiser's filter: edge-stopping à-trous wavelets (Dammertz et al. 2010; Schied et al. 2017, section 4.3).
//
// It keeps energy: c' = c + Σ w(p,q)·(c_q − c_p) with w(p,q) = w(q,p), so that what one pixel gives its neighbour gets (of the result
// shown; what is fed back is a mixture by pixel), and
// Σ w ≤ 3/4. A level takes the kernel (1 2 1) ⊗ (1 2 1) / 16 at 2^level pixels.
#extension GL_GOOGLE_include_directive : require
#include "prelude.glsl"
#include "gbuffer.glsl"
#include "guide.glsl"
#include "luminance.glsl"
#include "packed.glsl"

layout(local_size_x = 16, local_size_y = 8) in;

// Standard deviations of the difference that two pixels of one surface may have.
const float SIGMA_LUMINANCE = 4.0;
// Distance off each other's plane, in pixels at the surface's depth times the step.
const float SIGMA_PLANE = 0.5;
// How fast weights fall with 1 − cosine between normals.
const float NORMAL_FALL = 20.0;

// Frames up to which the first level's result is all that the next frame starts from.
const float FED_BACK = 7.0;

// All eight: with four a level, which is faster, a lone bright sample became a lattice of dots.
const int TAPS = 8;

ivec2 neighbour(int i) {
    int k = i < 4 ? i : i + 1;
    return ivec2(k % 3 - 1, k / 3 - 1) << level;
}

float kernel(int i) {
    ivec2 d = neighbour(i);
    return d.x == 0 || d.y == 0 ? 0.125 : 0.0625;
}

uvec4 load(ivec2 p) {
    return (level & 1u) == 0 ? imageLoad(filter_a, p) : imageLoad(filter_b, p);
}

void main() {
    uvec2 pixel = gl_GlobalInvocationID.xy;
    if (any(greaterThanEqual(pixel, FC.size))) return;
    ivec2 p = ivec2(pixel);
    // Everything is asked for at once: the time goes into waiting for memory.
    uvec4 guides[TAPS];
    uvec4 colours[TAPS];
    ivec2 last = ivec2(FC.size) - 1;
    [[unroll]] for (int i = 0; i < TAPS; i++) {
        ivec2 q = clamp(p + neighbour(i), ivec2(0), last);
        guides[i] = imageLoad(guide, q);
        colours[i] = load(q);
    }
    uvec4 packed_ = load(p);
    Guide g = unpack_guide(imageLoad(guide, p));
    uvec4 result = packed_;
    if (g.depth > 0.0) {
        vec4 own = unpack_colour(packed_);
        float l = luminance(own.rgb);
        // The ray through this pixel at depth 1, what it changes by from pixel to pixel, and the plane that it meets.
        vec3 ray = view_point(vec2(p) + jitter_now(), 1.0);
        vec2 per_pixel = vec2(2.0 * FC.half_width, -2.0 * FC.half_height) / vec2(FC.size);
        float facing = dot(g.normal, ray);
        float off_scale = 1.0 / (SIGMA_PLANE * per_pixel.x * float(1u << level));
        vec3 change = vec3(0.0);
        float weights = 0.0;
        float variance = 0.0;
        [[unroll]] for (int i = 0; i < TAPS; i++) {
            ivec2 q = p + neighbour(i);
            Guide other = unpack_guide(guides[i]);
            vec4 theirs = unpack_colour(colours[i]);
            float their_l = luminance(theirs.rgb);
            // Each pixel's distance off the other's plane.
            vec2 aside = per_pixel * vec2(neighbour(i));
            float between = facing * (other.depth - g.depth) + dot(g.normal.xy, aside) * other.depth;
            float back = dot(other.normal, ray) * (other.depth - g.depth) + dot(other.normal.xy, aside) * other.depth;
            float off = max(abs(between), abs(back));
            float deviation = SIGMA_LUMINANCE * sqrt(own.a + theirs.a) + 1e-6 + 1e-4 * (l + their_l);
            float unlike = abs(l - their_l) / deviation + off * off_scale / min(g.depth, other.depth)
                         + NORMAL_FALL * (1.0 - dot(g.normal, other.normal));
            bool counts = other.depth > 0.0 && q == clamp(q, ivec2(0), last);
            float weight = counts ? kernel(i) * exp(-unlike) : 0.0;
            change += weight * (theirs.rgb - own.rgb);
            weights += weight;
            variance += weight * weight * theirs.a;
        }
        result = pack_colour(own.rgb + change, (1.0 - weights) * (1.0 - weights) * own.a + variance);
    }
    if ((level & 1u) == 0) imageStore(filter_b, p, result);
    else imageStore(filter_a, p, result);
    if (level == 0) {
        // The next frame starts from this, less and less so the more frames there are: filtering the same history again and
        // again would spread it ever farther.
        float part = min(FED_BACK / max(imageLoad(moments_now, p).z, 1.0), 1.0);
        part *= part;
        vec4 filtered = unpack_colour(result);
        vec4 own = unpack_colour(packed_);
        imageStore(irradiance_now, p, pack_colour(mix(own.rgb, filtered.rgb, part), 0.0));
    }
}
