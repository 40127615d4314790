#version 460
// A level of the denoiser's filter: edge-stopping à-trous wavelets (Dammertz et al. 2010; Schied et al. 2017, section 4.3).
//
// It keeps energy: c' = c + Σ w(p,q)·(c_q − c_p) with w(p,q) = w(q,p), so that what one pixel gives its neighbour gets (of the result
// shown; what is fed back is a mixture by pixel), and Σ w ≤ 3/4. A level takes the kernel (1 2 1) ⊗ (1 2 1) / 16 at 2^level pixels: all eight neighbours, since with four a level, which is
// faster, a lone bright sample became a lattice of dots.
//
// Unpacking is what costs, so each pixel is unpacked once by the work group that needs it, into shared memory. A group makes 32 columns
// of rows that are a step apart: with their neighbours these are 10 rows for 8, and rows are read as they lie in memory.
#extension GL_GOOGLE_include_directive : require
#include "prelude.glsl"
#include "gbuffer.glsl"
#include "channel.glsl"
#include "guide.glsl"
#include "luminance.glsl"
#include "packed.glsl"
#include "secondary_tiles.glsl"

layout(local_size_x = 32, local_size_y = 4) in;
layout(constant_id = 0) const int LEVEL = 0;

const int STEP = 1 << LEVEL;
// What a group makes, and what it reads for that.
const int WIDTH = 32;
const int ROWS = 8;
const int READ_WIDTH = WIDTH + 2 * STEP;
const int READ = READ_WIDTH * (ROWS + 2);

// Standard deviations of the difference that two pixels of one surface may have; variances that are hardly known come raised.
const float SIGMA_LUMINANCE = 1.0;
// Distance off each other's plane, in pixels at the surface's depth times the step.
const float SIGMA_PLANE = 0.5;
// How fast weights fall with 1 − cosine between normals.
const float NORMAL_FALL = 20.0;

// Frames up to which the first level's result is all that the next frame starts from.
const float FED_BACK = 7.0;

const float LOG2_E = 1.4426950408889634;
// Squared deviation of a pixel's luminance, in units of its weight's exponent, over its variance.
const float SQUARED = SIGMA_LUMINANCE * SIGMA_LUMINANCE / (LOG2_E * LOG2_E);

// Depth of a pixel that shows nothing: whatever is weighed against it weighs nothing.
const float EMPTY = 1e-30;

// A pixel; in shared memory as depth, normal (halves), deviation (the upper half of a float), luminance; red and blue.
struct Texel {
    float depth;
    vec3 normal;
    // Variance of the luminance in the unit of `SQUARED`: what differences are held against.
    float deviation;
    // Luminance, red and blue, from which green follows: the filter is linear.
    vec3 lrb;
};

shared bool group_branches;
shared uvec4 near_a[READ];
shared vec2 near_b[READ];

void keep(int at, Texel t) {
    uint last = (packHalf2x16(vec2(t.normal.z, 0.0)) & 0xffffu) | (floatBitsToUint(t.deviation) & 0xffff0000u);
    near_a[at] = uvec4(floatBitsToUint(t.depth), packHalf2x16(t.normal.xy), last, floatBitsToUint(t.lrb.x));
    near_b[at] = t.lrb.yz;
}

Texel kept(int at) {
    uvec4 a = near_a[at];
    vec3 normal = vec3(unpackHalf2x16(a.y), unpackHalf2x16(a.z).x);
    vec3 lrb = vec3(uintBitsToFloat(a.w), near_b[at]);
    return Texel(uintBitsToFloat(a.x), normal, uintBitsToFloat(a.z & 0xffff0000u), lrb);
}

vec3 colour_of(vec3 lrb) {
    return vec3(lrb.y, (lrb.x - 0.2126 * lrb.y - 0.0722 * lrb.z) / 0.7152, lrb.z);
}

uvec4 load(ivec2 p) {
    return (LEVEL & 1) == 0 ? imageLoad(filter_a, p) : imageLoad(filter_b, p);
}

void store(ivec2 p, vec3 colour, float variance) {
#ifdef SECONDARY
    if (LEVEL + 1 >= FC.secondary_levels) {
        imageStore(image_secondary, p, vec4(colour, 0.0));
        return;
    }
#endif
    uvec4 result = pack_colour(colour, variance);
    if ((LEVEL & 1) == 0) imageStore(filter_b, p, result);
    else imageStore(filter_a, p, result);
}

// What the next frame starts from.
void store_history(ivec2 p, vec3 colour) {
    imageStore(channel_now, p, pack_colour(colour, 0.0));
}

// Column and row of the image where a group begins.
ivec2 corner_of_group() {
    ivec2 group = ivec2(gl_WorkGroupID.xy);
    return ivec2(group.x * WIDTH, (group.y / STEP) * (ROWS * STEP) + group.y % STEP);
}

// Whether something branches off in a pixel that the group makes.
bool branches_in_group(ivec2 corner) {
    const int ROWS_OF_TILES = STEP + 1;
    if (gl_LocalInvocationIndex == 0) group_branches = false;
    barrier();
    ivec2 tile = corner / 8 + ivec2(gl_LocalInvocationIndex % 4, gl_LocalInvocationIndex / 4);
    if (gl_LocalInvocationIndex < 4 * ROWS_OF_TILES && tile_branches(tile)) group_branches = true;
    barrier();
    return group_branches;
}

ivec2 place_of(ivec2 corner, int i) {
    return corner + ivec2(i % READ_WIDTH - STEP, (i / READ_WIDTH - 1) * STEP);
}

Texel unpacked(uvec4 guide_words, uvec4 colour_words) {
    Guide g = unpack_guide(guide_words);
    vec4 colour = unpack_colour(colour_words);
    float l = luminance(colour.rgb);
    // No two computations of the same give quite the same.
    return Texel(g.depth, g.normal, SQUARED * colour.a + 1e-8 * l * l + 1e-12, vec3(l, colour.r, colour.b));
}

// Units at depth 1 from a pixel to the one a step to the right and down.
vec2 step_aside() {
    return vec2(2.0 * FC.half_width, -2.0 * FC.half_height) / vec2(FC.size) * float(STEP);
}

// Most pixels that a thread reads: those of level 4.
const int MOST_READ = (WIDTH + 32) * (ROWS + 2) / 128;

void read_all(ivec2 corner) {
    // Everything is asked for at once: what this waits for is memory.
    uvec4 guides[MOST_READ];
    uvec4 colours[MOST_READ];
    int lane = int(gl_LocalInvocationIndex);
    ivec2 last = ivec2(FC.size) - 1;
    [[unroll]] for (int k = 0; k < MOST_READ; k++) {
        if (k * 128 >= READ) break;
        ivec2 p = clamp(place_of(corner, lane + k * 128), ivec2(0), last);
        guides[k] = imageLoad(channel_guide, p);
        colours[k] = load(p);
    }
    [[unroll]] for (int k = 0; k < MOST_READ; k++) {
        if (k * 128 >= READ) break;
        int i = lane + k * 128;
        ivec2 p = place_of(corner, i);
        Texel t = unpacked(guides[k], colours[k]);
        if (t.depth <= 0.0 || p != clamp(p, ivec2(0), last)) {
            t.depth = EMPTY;
            // Memory that nobody wrote may hold what is no number, which a weight of 0 would not take away.
            t.lrb = vec3(0.0);
        }
        if (i < READ) keep(i, t);
    }
}

// From this level on variances are means of many pixels' and known by themselves: see `fall_of`.
const int VARIANCE_KNOWN = 2;

// Exponents by which a pixel's weights fall: per unit off a plane, and its factor of that per unit of luminance.
struct Fall {
    float plane;
    float luminance;
};

// The pixel that is filtered.
struct Centre {
    Texel own;
    // The ray through it at depth 1, without its third component, which is 1.
    vec2 ray;
    // The normal's part along the ray, and how that changes a step to the right and down.
    float facing;
    vec2 aside;
    Fall fall;
    vec3 sum;
    float weights;
    float variance;
};

// Differences of luminance are held against the sum of two variances while a pixel's own hardly says anything: light that few
// samples find makes one in some pixels only. Later against their geometric mean, or a spot of light, as a lamp makes on
// the wall that it hangs on, would be spread over the dark around it, which is known well.
Fall fall_of(Texel t) {
    float luminance = LEVEL >= VARIANCE_KNOWN ? inversesqrt(sqrt(2.0 * t.deviation)) : 0.0;
    return Fall(LOG2_E / SIGMA_PLANE / step_aside().x / t.depth, luminance);
}

Centre centre_of(Texel own, ivec2 p) {
    vec2 ray = view_point(vec2(p) + jitter_now(), 1.0).xy;
    float facing = dot(own.normal.xy, ray) + own.normal.z;
    return Centre(own, ray, facing, own.normal.xy * step_aside(), fall_of(own), vec3(0.0), 0.0, 0.0);
}

// Weight of the pixel so many steps away: the same seen from there. `fall`: its own.
float weight_of(Centre c, Texel other, Fall fall, int x, int y) {
    // Each pixel's distance off the other's plane.
    vec2 aside = step_aside();
    float deeper = other.depth - c.own.depth;
    float ahead = c.facing * deeper + (float(x) * c.aside.x + float(y) * c.aside.y) * other.depth;
    float facing = dot(other.normal.xy, c.ray) + other.normal.z;
    float back = facing * deeper + (float(x) * aside.x * other.normal.x + float(y) * aside.y * other.normal.y) * other.depth;
    // The kernel, 2^-3 and 2^-4, is a part of the exponent.
    float exponent = LOG2_E * NORMAL_FALL * dot(c.own.normal, other.normal)
                   - (LOG2_E * NORMAL_FALL + (x == 0 || y == 0 ? 3.0 : 4.0));
    exponent -= max(abs(ahead), abs(back)) * max(c.fall.plane, fall.plane);
    float unlike = LEVEL >= VARIANCE_KNOWN ? c.fall.luminance * fall.luminance : inversesqrt(c.own.deviation + other.deviation);
    exponent -= abs(c.own.lrb.x - other.lrb.x) * unlike;
    // One level of the secondary channel always runs: it brings the result to its place.
    if (IS_SECONDARY && FC.secondary_levels == 0) return 0.0;
    return exp2(exponent);
}

void take(inout Centre c, Texel other, float weight) {
    c.sum += weight * other.lrb;
    c.weights += weight;
    c.variance += weight * weight * other.deviation;
}

void finish(Centre c, ivec2 p) {
    if (any(greaterThanEqual(p, ivec2(FC.size)))) return;
    if (c.own.depth <= EMPTY) {
        if (IS_SECONDARY) return;
        store(p, vec3(0.0), 0.0);
        if (LEVEL == 0) store_history(p, vec3(0.0));
        return;
    }
    float rest = 1.0 - c.weights;
    vec3 filtered = colour_of(rest * c.own.lrb + c.sum);
    store(p, filtered, (rest * rest * c.own.deviation + c.variance) / SQUARED);
    if (LEVEL == 0) {
        // The next frame starts from this, less and less so the more frames there are: filtering the same history again and
        // again would spread it ever farther.
        float frames = imageLoad(channel_moments_now, p).z;
        float part = min(FED_BACK / max(frames, 1.0), 1.0);
        store_history(p, mix(colour_of(c.own.lrb), filtered, part * part));
    }
}

void main() {
    ivec2 corner = corner_of_group();
    if (IS_SECONDARY && !branches_in_group(corner)) return;
    read_all(corner);
    barrier();
    // Two pixels, one a step below the other, of the same pixels around them.
    int column = int(gl_LocalInvocationID.x);
    int row = 2 * int(gl_LocalInvocationID.y);
    ivec2 p = corner + ivec2(column, row * STEP);
    ivec2 q = p + ivec2(0, STEP);
    int at = (row + 1) * READ_WIDTH + column + STEP;
    Centre upper = centre_of(kept(at), p);
    Centre lower = centre_of(kept(at + READ_WIDTH), q);
    float shared_ = weight_of(upper, lower.own, lower.fall, 0, 1);
    take(upper, lower.own, shared_);
    take(lower, upper.own, shared_);
    [[unroll]] for (int y = -1; y <= 2; y++) {
        [[unroll]] for (int x = -1; x <= 1; x++) {
            if (x == 0 && (y == 0 || y == 1)) continue;
            Texel other = kept(at + y * READ_WIDTH + x * STEP);
            Fall fall = fall_of(other);
            if (y <= 1) take(upper, other, weight_of(upper, other, fall, x, y));
            if (y >= 0) take(lower, other, weight_of(lower, other, fall, x, y - 1));
        }
    }
    finish(upper, p);
    finish(lower, q);
}
