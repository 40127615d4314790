// Direct light at a receiver: next-event estimation over the lights of its row, all of them or N at random. To be included
// after light_choice.glsl and visibility.glsl. Counterpart of src/reference/direct.rs.
#ifndef DIRECT_LIGHT_GLSL
#define DIRECT_LIGHT_GLSL

#include "luminance.glsl"

// What a light sample is shown by: rt_lightTerm.
const uint TERM_VISIBILITY = 1;
const uint TERM_GEOMETRY = 2;
const uint TERM_EMISSION = 3;
// FC.solo_light of a number that no light has; NONE: all lights.
const uint NO_SUCH_LIGHT = 0xfffffffeu;

// Number of the sample whose random numbers are drawn: the frame's, or the one that is shaded again.
uint drawn_index;
// Least number of candidates for it.
uint drawn_least;

uvec2 random_bits(uint address, uint dimension) {
    return bits2(FC.sequence, random_key(FC.seed, address, dimension), drawn_index);
}

vec2 random_pair(uint address, uint dimension) {
    uvec2 bits = random_bits(address, dimension);
    return vec2(unit_float(bits.x), unit_float(bits.y));
}

#ifdef LIGHTS_LOBES
// Lobe of the receiver, which takes one more light sample; none where its width is 0.
Lobe light_lobe;
// The receiver's lobe alone is wanted.
bool lobe_alone;
const uint BRANCH_CANDIDATES = 2;
// Radiance over Fresnel's factor that the lobe reflects, as far as light samples find it.
vec3 lobe_light;

// What a light sample of the lobe counts: see src/reference/direct.rs.
vec3 lobe_weight(SurfaceHit at, Choice choice, LightSample s) {
    Light light = light_at(choice.light);
    vec3 to = s.sky ? s.target : s.target - at.position;
    vec3 direction = normalize(to);
    bool unseen = light.kind == LIGHT_SPHERE || light.kind == LIGHT_DOME;
    if (FC.shown_emission == 0 && unseen) return vec3(0.0);
    vec3 weight = vec3(PI * lobe_brdf(light_lobe, direction) / choice.probability);
    if (light.kind == LIGHT_TRIANGLE) {
        float cosine = abs(dot(normalize(cross(light.p1, light.p2)), direction));
        float own = choice.probability * dot(to, to) / max(cosine * light.size, 1.17549435e-38);
        weight *= FC.soft_shadows != 0 ? own / (own + lobe_pdf(light_lobe, direction)) : 0.0;
        weight *= shown_over_lit(FC.materials.at[light.material]) / (FC.shown_emission == 0 ? light.scale : 1.0);
    }
    return weight.x > 0.0 || weight.y > 0.0 || weight.z > 0.0 ? weight : vec3(0.0);
}
#endif

vec3 traced(LightSample s, SurfaceHit at, inout uvec2 counts) {
    if (max(s.value.x, max(s.value.y, s.value.z)) <= 0.0) {
        counts.y++;
        return vec3(0.0);
    }
    if (FC.light_term == TERM_GEOMETRY) return vec3(s.geometry);
    if (FC.light_term == TERM_EMISSION) return s.value / s.geometry;
    counts.x++;
    vec3 arrives = visible(offset_point(at.position, at.geometric_normal), s);
    return FC.light_term == TERM_VISIBILITY ? arrives : arrives * s.value;
}

// Lights sampled by all ways in one loop: what is chosen differs, not how it is sampled and traced. Compilers copy a function
// to every call, and these are large.
vec3 direct_light(SurfaceHit at, uint address, inout uvec2 counts) {
    Chances chances = chances_at(at);
    LightRow row = chances.row;
    bool solo = FC.solo_light != NONE;
    bool every = solo || FC.random_lights == 0;
    bool resampled = !every && FC.light_sampling == SAMPLING_RESERVOIR;
    uint count = every ? row.light_count + FC.guest_count : FC.random_lights;
    if (solo) count = FC.solo_light == NO_SUCH_LIGHT ? 0 : 1;
    // One light of several candidates is kept in proportion to what each gives without visibility.
#ifdef LIGHTS_LOBES
    // What branches off is followed now and then only.
    uint candidates = FC.light_candidates * BRANCH_CANDIDATES;
#else
    uint candidates = FC.light_candidates;
#endif
    if (chances.cell.count > MANY_ENTRIES) candidates *= 2;
    uint n = resampled ? clamp(max(candidates, drawn_least), 1, MAX_CANDIDATES) : 1;
    float share = every ? 1.0 : 1.0 / float(FC.random_lights);
    uint r = 0;
    uint in_run = 0;
    vec3 sum = vec3(0.0);
    uint diffuse_count = count;
    uint first = 0;
#ifdef LIGHTS_LOBES
    lobe_light = vec3(0.0);
    if (light_lobe.alpha > 0.0 && FC.solo_light != NO_SUCH_LIGHT) count++;
    if (lobe_alone) first = diffuse_count;
#endif
    [[dont_unroll]] for (uint i = first; i < count; i++) {
        bool for_lobe = i == diffuse_count;
        Choice picked = NO_CHOICE;
        LightSample kept = LightSample(vec3(0.0), 0.0, vec3(0.0), false);
        float kept_target = 0.0;
        float weights = 0.0;
        bool at_random = for_lobe || !every;
        uvec2 bits = uvec2(0);
        vec2 u = vec2(0.0);
        if (at_random) {
            uint pick = DIM_LIGHT_PICK + i;
            uint point = DIM_LIGHT_POINT + i;
            if (resampled) {
                pick = DIM_CANDIDATE_PICK + i;
                point = DIM_CANDIDATE_POINT + i;
            }
#ifdef LIGHTS_LOBES
            if (for_lobe) {
                pick = DIM_LOBE_PICK;
                point = DIM_LOBE_POINT;
            }
#endif
            bits = random_bits(address, pick);
            u = random_pair(address, point);
        }
        [[dont_unroll]] for (uint c = 0; c < (for_lobe ? 1 : n); c++) {
            Choice choice;
            float keep = 0.0;
            uint points = point_sampling();
#ifdef LIGHTS_LOBES
            if (for_lobe) {
                choice = choose_for_lobe(row, lobe_cell(at.row, light_cell_place(at.position, at.geometric_normal)), bits.x);
                if (solo) choice = Choice(FC.solo_light, 1.0);
                if (choice.light == NONE) continue;
                if (points == POINTS_SOLID_ANGLE) points = POINTS_AREA;
            } else
#endif
            if (solo) {
                choice = Choice(FC.solo_light, 1.0);
            } else if (every && i >= row.light_count) {
                choice.light = GUEST_LIGHT + (i - row.light_count);
                choice.probability = 1.0;
            } else if (every) {
                LightRun run = FC.light_runs.at[row.first_run + r];
                choice.light = run.first_light + in_run;
                choice.probability = 1.0;
                in_run++;
                if (in_run >= run.count) {
                    in_run = 0;
                    r++;
                }
            } else {
                choice = choose_light(chances, at, stratified(bits.x, c, n));
                if (choice.light == NONE) continue;
                keep = unit_float(keep_bits(bits.y, c));
            }
            picked = choice;
            if (!at_random) u = random_pair(address, DIM_EVERY_LIGHT + choice.light);
            LightSample s = sample_light(light_at(choice.light), at, u, points);
            float target = luminance(s.value);
            if (!(target > 0.0)) continue;
            float weight = target / choice.probability;
            weights += weight;
            if (for_lobe || !resampled || keep * weights < weight) {
                kept = s;
                kept_target = target;
            }
        }
#ifdef LIGHTS_LOBES
        if (for_lobe) {
            vec3 weight = kept_target > 0.0 ? lobe_weight(at, picked, kept) : vec3(0.0);
            if (kept_target > 0.0 && weight == vec3(0.0)) continue;
            lobe_light = traced(kept, at, counts) * weight;
            continue;
        }
#endif
        vec3 value = traced(kept, at, counts);
        if (kept_target > 0.0) sum += value * (weights / (kept_target * float(n)) * share);
    }
    return sum;
}

#endif
