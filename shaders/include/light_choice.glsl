// Which light of a receiver's row to sample, and with what probability. Counterpart of src/reference/light_choice.rs,
// which explains it.
#ifndef LIGHT_CHOICE_GLSL
#define LIGHT_CHOICE_GLSL

#include "luminance.glsl"

const uint SAMPLING_UNIFORM = 0;
const uint SAMPLING_POWER = 1;
const uint SAMPLING_BVH = 2;
const uint SAMPLING_CELLS = 3;
const uint SAMPLING_RESERVOIR = 4;

struct Choice {
    // NONE where nothing can be chosen.
    uint light;
    float probability;
};

const Choice NO_CHOICE = Choice(NONE, 0.0);

// 32 random bits → 0..n.
uint scaled(uint bits, uint n) {
    uint high;
    uint low;
    umulExtended(bits, n, high, low);
    return high;
}

Choice choose_uniform(LightRow row, uint bits) {
    uint k = scaled(bits, row.light_count);
    uint lo = 0;
    uint hi = row.run_count;
    [[dont_unroll]] while (hi - lo > 1) {
        uint mid = (lo + hi) >> 1;
        if (FC.light_runs.at[row.first_run + mid].before <= k) lo = mid; else hi = mid;
    }
    LightRun run = FC.light_runs.at[row.first_run + lo];
    return Choice(run.first_light + (k - run.before), 1.0 / float(row.light_count));
}

Choice choose_power(LightRow row, uint bits) {
    uint x = scaled(bits, row.weight);
    uint lo = 0;
    uint hi = row.run_count;
    [[dont_unroll]] while (hi - lo > 1) {
        uint mid = (lo + hi) >> 1;
        if (FC.light_runs.at[row.first_run + mid].weight_before <= x) lo = mid; else hi = mid;
    }
    LightRun run = FC.light_runs.at[row.first_run + lo];
    x = x - run.weight_before + FC.light_weights.at[run.first_light];
    lo = run.first_light;
    hi = run.first_light + run.count;
    [[dont_unroll]] while (hi - lo > 1) {
        uint mid = (lo + hi) >> 1;
        if (FC.light_weights.at[mid] <= x) lo = mid; else hi = mid;
    }
    uint weight = FC.light_weights.at[lo + 1] - FC.light_weights.at[lo];
    return Choice(lo, float(weight) / float(row.weight));
}

// Cosine of an angle that has been made smaller by another, down to 0. The other is between 0 and π.
float widened(float cos_angle, float sin_by, float cos_by) {
    return cos_angle >= cos_by ? 1.0 : cos_angle * cos_by + sqrt(max(1.0 - cos_angle * cos_angle, 0.0)) * sin_by;
}

// Estimated irradiance/π that a node's lights give per strength. 0 only where the node cannot light the receiver.
float importance(LightNode node, SurfaceHit at) {
    vec3 to = node.centre - at.position;
    float highest = dot(at.shading_normal, to) + dot(abs(at.shading_normal), node.half_size);
    if (highest <= 0.0 || dot(node.axis, at.position) <= node.front) return 0.0;
    float d2 = dot(to, to);
    float r2 = dot(node.half_size, node.half_size);
    vec3 gap = max(abs(to) - node.half_size, vec3(0.0));
    float distance = max(0.5 * (d2 + dot(gap, gap)), 0.5 * r2);
    if (d2 <= r2) return 1.0 / distance;
    vec3 direction = to / sqrt(d2);
    float sin_sphere = sqrt(r2 / d2);
    float cos_sphere = sqrt(max(1.0 - r2 / d2, 0.0));
    float receiver = widened(dot(at.shading_normal, direction), sin_sphere, cos_sphere);
    if (receiver <= 0.0) return 0.0;
    if (node.cos_cone <= -1.0) return receiver / distance;
    float sin_cone = sqrt(max(1.0 - node.cos_cone * node.cos_cone, 0.0));
    float s = sin_cone * cos_sphere + node.cos_cone * sin_sphere;
    float c = node.cos_cone * cos_sphere - sin_cone * sin_sphere;
    float emitter = s <= 0.0 ? 1.0 : widened(-dot(node.axis, direction), s, c);
    return receiver * max(emitter, 0.0) / distance;
}

float sun_strength(Light light) {
    return max(luminance(light.radiance), 0.0);
}

float sun_importance(Light light, SurfaceHit at) {
    float cosine = widened(dot(at.shading_normal, light.p0), sin(light.p1.z), cos(light.p1.z));
    return max(cosine, 0.0) * sun_strength(light);
}

// The part of a row's runs that lies in a node: runs from..to, and the weight of the row's lights before the node and
// before its end.
struct Part {
    uint from;
    uint to;
    uint before;
    uint after;
};

// The parts in front of light `middle` and from it on.
void split_part(Part part, uint first_run, uint middle, out Part left, out Part right) {
    left = part;
    right = part;
    uint lo = part.from;
    uint hi = part.to;
    [[dont_unroll]] while (lo < hi) {
        uint mid = (lo + hi) >> 1;
        if (FC.light_runs.at[first_run + mid].first_light < middle) lo = mid + 1; else hi = mid;
    }
    left.to = lo;
    if (lo == part.from) {
        left.after = part.before;
        return;
    }
    LightRun run = FC.light_runs.at[first_run + lo - 1];
    uint end = run.first_light + run.count;
    uint weight = run.weight_before + FC.light_weights.at[min(middle, end)] - FC.light_weights.at[run.first_light];
    weight = clamp(weight, part.before, part.after);
    left.after = weight;
    right.from = end > middle ? lo - 1 : lo;
    right.before = weight;
}

// A random number that choices are made with, one after the other. Bits that choices have used up are replaced.
struct Chooser {
    float u;
    float grain;
    uint bits;
};

const float FINE = 1.0 / 16777216.0;
const float COARSE = 1.0 / 4096.0;

// True with probability p, 0 < p < 1.
bool take(inout Chooser chooser, float p) {
    bool taken = chooser.u < p;
    float share = taken ? p : 1.0 - p;
    chooser.u = taken ? chooser.u / p : (chooser.u - p) / (1.0 - p);
    chooser.grain /= share;
    if (chooser.grain > COARSE) {
        chooser.bits = pcg(chooser.bits);
        chooser.u += chooser.grain * unit_float(chooser.bits);
        chooser.grain = FINE;
    }
    chooser.u = clamp(chooser.u, 0.0, 1.0 - FINE);
    return taken;
}

const float SUN_SHARE = 0.5;
const float LEAST_SUN_SHARE = 1.0 / 1024.0;

// Sums of the suns' importances, and of what these would be if each stood overhead; where `wanted` >= 0, also the sun at
// which the first sum passes it.
vec2 walk_suns(uint first_run, Part suns, SurfaceHit at, float wanted, out Choice chosen) {
    chosen = NO_CHOICE;
    vec2 sum = vec2(0.0);
    [[dont_unroll]] for (uint r = suns.from; r < suns.to; r++) {
        LightRun run = FC.light_runs.at[first_run + r];
        [[dont_unroll]] for (uint i = max(run.first_light, FC.finite_lights); i < run.first_light + run.count; i++) {
            Light sun = FC.lights.at[i];
            float one = sun_importance(sun, at);
            sum += vec2(one, sun_strength(sun));
            if (wanted >= 0.0 && one > 0.0) {
                chosen = Choice(i, one);
                if (wanted < sum.x) return sum;
            }
        }
    }
    return sum;
}

float weigh(LightNode node, Part part, SurfaceHit at) {
    return part.after == part.before ? 0.0 : float(part.after - part.before) * importance(node, at);
}

Choice descend(uint first_run, Part part, SurfaceHit at, float probability, inout Chooser chooser) {
    uint here = 0;
    LightNode node = FC.light_nodes.at[0];
    [[dont_unroll]] while (node.right != 0) {
        LightNode l = FC.light_nodes.at[here + 1];
        LightNode r = FC.light_nodes.at[node.right];
        Part left;
        Part right;
        split_part(part, first_run, r.first, left, right);
        float wl = weigh(l, left, at);
        float wr = weigh(r, right, at);
        if (wl <= 0.0 && wr <= 0.0) return NO_CHOICE;
        bool take_left;
        if (wr <= 0.0) {
            take_left = true;
        } else if (wl <= 0.0) {
            take_left = false;
        } else {
            float p = clamp(wl / (wl + wr), FINE, 1.0 - FINE);
            take_left = take(chooser, p);
            probability *= take_left ? p : 1.0 - p;
        }
        here = take_left ? here + 1 : node.right;
        if (take_left) {
            node = l;
            part = left;
        } else {
            node = r;
            part = right;
        }
    }
    return Choice(node.first, probability);
}

Choice choose_by_tree(LightRow row, SurfaceHit at, uint bits) {
    Part finite;
    Part suns;
    split_part(Part(0, row.run_count, 0, row.weight), row.first_run, FC.finite_lights, finite, suns);
    Chooser chooser = Chooser(unit_float(bits), FINE, bits);
    Choice choice;
    vec2 sums = walk_suns(row.first_run, suns, at, -1.0, choice);
    float total_sun = sums.x;
    float sun_share = max(SUN_SHARE * total_sun / max(sums.y, 1.17549435e-38), LEAST_SUN_SHARE);
    float root = finite.after != finite.before ? importance(FC.light_nodes.at[0], at) : 0.0;
    float probability = 1.0;
    if (total_sun > 0.0 && (root <= 0.0 || take(chooser, sun_share))) {
        if (root > 0.0) probability = sun_share;
        walk_suns(row.first_run, suns, at, chooser.u * total_sun, choice);
        choice.probability = probability * (choice.probability / total_sun);
        return choice;
    }
    if (root <= 0.0) return NO_CHOICE;
    if (total_sun > 0.0) probability = 1.0 - sun_share;
    return descend(row.first_run, finite, at, probability, chooser);
}

// Cube and facing of a receiver: see src/scene/light_cells.rs.
const float CELL_SIZE = 128.0;
const float CELL_LIFT = 5.37;

uint light_cell_place(vec3 position, vec3 normal) {
    ivec3 cube = ivec3(floor((position + normal * CELL_LIFT) / CELL_SIZE));
    vec3 a = abs(normal) * vec3(1.03, 1.0, 1.07);
    uint axis = a.z >= a.x && a.z >= a.y ? 2 : a.x >= a.y ? 0 : 1;
    uint facing = 2 * axis + (normal[axis] < 0.0 ? 1 : 0);
    uint place = (uint(cube.x) & 1023u) | (uint(cube.y) & 1023u) << 10 | (uint(cube.z) & 511u) << 20;
    return place << 3 | facing;
}

// The light cell of a receiver; one without entries where there is none.
// Cells of more entries get twice the candidates.
const uint MANY_ENTRIES = 64;

LightCell find_light_cell(uint row, uint place) {
    LightCell none = LightCell(0, 0, 0, 0);
    if (FC.cell_mask == NONE) return none;
    uint at = pcg(row ^ pcg(place)) & FC.cell_mask;
    [[dont_unroll]] while (true) {
        LightCell cell = FC.light_cells.at[at];
        if (cell.count == 0 || (cell.row == row && cell.place == place)) return cell;
        at = (at + 1) & FC.cell_mask;
    }
    return none;
}

Choice choose_by_cell(LightCell cell, uint bits) {
    uint from = cell.first;
    uint to = cell.first + cell.count;
    [[dont_unroll]] while (to - from > 1) {
        uint mid = (from + to) >> 1;
        if (FC.cell_bounds.at[mid] <= bits) from = mid; else to = mid;
    }
    CellEntry entry = FC.cell_entries.at[from];
    if (entry.light_count == 1) return Choice(entry.first_light, entry.probability);
    uint x = scaled(pcg(bits), entry.weight) + FC.light_weights.at[entry.first_light];
    uint lo = entry.first_light;
    uint hi = entry.first_light + entry.light_count;
    [[dont_unroll]] while (hi - lo > 1) {
        uint mid = (lo + hi) >> 1;
        if (FC.light_weights.at[mid] <= x) lo = mid; else hi = mid;
    }
    uint weight = FC.light_weights.at[lo + 1] - FC.light_weights.at[lo];
    return Choice(lo, entry.probability * (float(weight) / float(entry.weight)));
}

// The light cell that lights for a lobe are chosen by.
LightCell lobe_cell(uint row, uint place) {
    if (FC.cull_lights == 0) return LightCell(0, 0, 0, 0);
    return find_light_cell(row, place);
}

// The light of a lobe: by cell where there is one, else by power.
Choice choose_for_lobe(LightRow row, LightCell cell, uint bits) {
    if (cell.count != 0) return choose_by_cell(cell, bits);
    return row.weight != 0 ? choose_power(row, bits) : NO_CHOICE;
}

// What lights are chosen by, for one receiver.
struct Chances {
    LightRow row;
    LightCell cell;
};

Chances chances_at(SurfaceHit at) {
    uint row = FC.cull_lights == 0 ? FC.all_row : at.row;
    Chances chances = Chances(FC.light_rows.at[row], LightCell(0, 0, 0, 0));
    if (FC.light_sampling >= SAMPLING_CELLS && FC.cull_lights != 0) {
        chances.cell = find_light_cell(row, light_cell_place(at.position, at.geometric_normal));
    }
    return chances;
}

Choice choose_of_map(Chances chances, SurfaceHit at, uint bits) {
    if (chances.row.light_count == 0) return NO_CHOICE;
    if (FC.light_sampling == SAMPLING_UNIFORM) return choose_uniform(chances.row, bits);
    if (FC.light_sampling == SAMPLING_POWER) return choose_power(chances.row, bits);
    if (chances.cell.count != 0) return choose_by_cell(chances.cell, bits);
    return choose_by_tree(chances.row, at, bits);
}

// What a guest may give to a receiver.
float guest_importance(Light light, SurfaceHit at) {
    vec3 to = light.p0 - at.position;
    if (dot(to, at.geometric_normal) + light.size <= 0.0) return 0.0;
    float reach = light.size * light.size;
    return luminance(light.radiance) * reach / max(dot(to, to), reach);
}

// A guest in proportion to its importance; `sum`: of all.
Choice choose_guest(SurfaceHit at, float u, out float sum) {
    sum = 0.0;
    [[dont_unroll]] for (uint i = 0; i < FC.guest_count; i++) sum += guest_importance(FC.guest_lights.at[i], at);
    Choice chosen = NO_CHOICE;
    float below = 0.0;
    [[dont_unroll]] for (uint i = 0; i < FC.guest_count && sum > 0.0; i++) {
        float one = guest_importance(FC.guest_lights.at[i], at);
        below += one;
        if (one > 0.0) chosen = Choice(GUEST_LIGHT + i, one / sum);
        if (u * sum < below) break;
    }
    return chosen;
}

// A quarter of all choices: see src/scene/guests.rs.
const uint GUEST_BITS = 1u << 30;

// Chooses with 32 random bits.
Choice choose_light(Chances chances, SurfaceHit at, uint bits) {
    float share = 1.0;
    if (FC.guest_count != 0) {
        bool only = chances.row.light_count == 0;
        float sum;
        Choice guest = choose_guest(at, only ? unit_float(bits) : unit_float(bits << 2), sum);
        if (only) return guest;
        if (guest.light != NONE) {
            float taken = float(GUEST_BITS) / 4294967296.0;
            if (bits < GUEST_BITS) return Choice(guest.light, guest.probability * taken);
            share = 1.0 - taken;
            bits = pcg(bits);
        }
    }
    Choice choice = choose_of_map(chances, at, bits);
    choice.probability *= share;
    return choice;
}

#endif
