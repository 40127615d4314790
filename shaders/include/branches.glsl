// Ways that a path may go: what a surface reflects by itself, and where it goes on. Counterpart of
// src/reference/branches.rs, which explains it. Where FOLLOWS_BRANCHES is defined, what branches off is put on a stack; else
// it is only counted.
#ifndef BRANCHES_GLSL
#define BRANCHES_GLSL

#include "luminance.glsl"
#include "optics.glsl"

const float LEAST_BRANCH = 1.0 / 1024.0;
const uint MOST_BRANCHES = 64;
// `rt_maxDepth` at its most: a path has no more branches, and each of them fewer.
const uint STACK_SIZE = 16;

const uint SECONDARY_OFF = 0;
const uint SECONDARY_BOTH = 2;

struct Path {
    vec3 origin;
    vec3 direction;
    vec3 share;
    float travelled;
    uint depth;
    uint address;
    // Of the direction, solid angle, where a lobe chose it; 0 where the lobe's surface takes no light samples; negative where
    // no lobe did.
    float pdf;
    // Light row of the lobe's surface, and its place among light cells.
    uint row;
    uint place;
};

uint branch_address(uint address, uint n) {
    return pcg(address + 0x9e3779b9u * (n + 1));
}

// All ways that branched off the eye ray.
uint branch_count = 0;
#ifdef FOLLOWS_BRANCHES
Path branch_stack[STACK_SIZE];
uint branch_top = 0;

void push_branch(Path p) {
    if (branch_top < STACK_SIZE) branch_stack[branch_top++] = p;
}
#endif

// Whether the `n`-th branch of a path is followed, of which `share` reaches the eye, and how much it counts then: in frames
// that are shown as they come faint ones are followed now and then, and count the more.
bool survives(Path path, uint n, vec3 share, out float weight) {
    weight = 1.0;
    if (FC.branch_share <= 0.0) return true;
    float p = min(luminance(share) / FC.branch_share, 1.0);
    if (p >= 1.0) return true;
    weight = 1.0 / max(p, 1e-6);
    uint bits = bits2(FC.sequence, random_key(FC.seed, path.address, DIM_BRANCH + n), sample_index).x;
    return unit_float(bits) < p;
}

const uint REFLECTS_NOT = 0;
const uint REFLECTS_SMOOTH = 1;
const uint REFLECTS_GLOSSY = 2;

uint split(Material material, inout SurfaceHit s, vec3 direction, vec3 share) {
    float cosine = -dot(s.shading_normal, direction);
    uint kind = REFLECTS_SMOOTH;
    vec3 reflected_ = vec3(0.0);
    if ((material.flags & MATERIAL_DIELECTRIC) != 0) {
        float f = (material.flags & MATERIAL_PANE) != 0 ? fresnel_pane(cosine, material.ior)
                                                        : fresnel(cosine, s.front ? 1.0 / material.ior : material.ior);
        reflected_ = vec3(f);
    } else if (s.specular != vec3(0.0)) {
        kind = REFLECTS_GLOSSY;
        reflected_ = schlick(s.specular, cosine);
    } else {
        return REFLECTS_NOT;
    }
    if (luminance(share * reflected_) < LEAST_BRANCH) {
        s.specular = vec3(0.0);
        return REFLECTS_NOT;
    }
    s.specular = reflected_;
    vec3 rest = 1.0 - reflected_;
    s.albedo *= rest;
    s.glow *= rest;
    s.through *= rest;
    return kind;
}

void unsplit(inout SurfaceHit s) {
    s.albedo = min(s.albedo + s.specular, vec3(1.0));
    s.specular = vec3(0.0);
}

Lobe lobe_of(Material material, SurfaceHit s, vec3 direction) {
    return Lobe(s.shading_normal, -direction, material.lobe);
}

void mirrored(SurfaceHit s, vec3 direction, out vec3 origin, out vec3 back) {
    back = reflected(direction, s.shading_normal);
    if (dot(back, s.geometric_normal) <= 0.0) back = reflected(direction, s.geometric_normal);
    back = normalize(back);
    origin = offset_point(s.position, s.geometric_normal);
}

// Zero where nothing gets through, or nothing bends.
vec3 bent(Material material, SurfaceHit s, vec3 direction) {
    if ((material.flags & (MATERIAL_DIELECTRIC | MATERIAL_PANE)) != MATERIAL_DIELECTRIC) return vec3(0.0);
    float eta = s.front ? 1.0 / material.ior : material.ior;
    vec3 d = refracted(direction, s.shading_normal, eta);
    if (dot(d, s.geometric_normal) < 0.0) return d;
    d = refracted(direction, s.geometric_normal, eta);
    return dot(d, s.geometric_normal) < 0.0 ? d : vec3(0.0);
}

#ifdef FOLLOWS_BRANCHES
// Puts the direction that a surface's lobe chooses on the stack.
void push_lobe(Path from, Material material, SurfaceHit s, vec3 direction, uint n, vec3 share, float distance_, bool sampled_) {
    Lobe lobe = lobe_of(material, s, direction);
    vec2 u = sample2(FC.sequence, random_key(FC.seed, from.address, DIM_LOBE + n), sample_index);
    float weight;
    vec3 back = sample_lobe(lobe, u, weight);
    if (weight <= 0.0 || dot(back, s.geometric_normal) <= 0.0) return;
    push_branch(Path(offset_point(s.position, s.geometric_normal), back, share * s.specular * weight, distance_,
                     from.depth + 1, branch_address(from.address, n), sampled_ ? lobe_pdf(lobe, back) : 0.0, s.row,
                     light_cell_place(s.position, s.geometric_normal)));
}

// Probability that a light is chosen for a lobe: 0 for lights outside its row.
float lobe_chance(uint row_, uint place, uint light) {
    LightRow row = FC.light_rows.at[FC.cull_lights == 0 ? FC.all_row : row_];
    LightCell cell = lobe_cell(row_, place);
    float weight = float(FC.light_weights.at[light + 1] - FC.light_weights.at[light]);
    if (cell.count != 0) {
        float sum = 0.0;
        [[dont_unroll]] for (uint i = cell.first; i < cell.first + cell.count; i++) {
            CellEntry e = FC.cell_entries.at[i];
            if (light < e.first_light || light >= e.first_light + e.light_count) continue;
            sum += e.light_count == 1 ? e.probability : e.probability * (weight / float(e.weight));
        }
        return sum;
    }
    uint lo = 0;
    uint hi = row.run_count;
    [[dont_unroll]] while (lo < hi) {
        uint mid = (lo + hi) >> 1;
        if (FC.light_runs.at[row.first_run + mid].first_light <= light) lo = mid + 1; else hi = mid;
    }
    if (lo == 0 || row.weight == 0) return 0.0;
    LightRun run = FC.light_runs.at[row.first_run + lo - 1];
    return light >= run.first_light + run.count ? 0.0 : weight / float(row.weight);
}
#endif

const float SHOWN_SUN = 4.0 * 64.0 / 255.0;

// Radiance of the suns' discs in a direction: see src/reference/branches.rs.
vec3 suns_seen(vec3 direction) {
    float azimuth = atan(direction.y, direction.x);
    float elevation = asin(clamp(direction.z, -1.0, 1.0));
    vec3 sum = vec3(0.0);
    uint count = FC.light_rows.at[FC.all_row].light_count;
    [[dont_unroll]] for (uint i = FC.finite_lights; i < count; i++) {
        Light sun = FC.lights.at[i];
        float across = azimuth - sun.p1.x;
        across -= 2.0 * PI * round(across / (2.0 * PI));
        float off = elevation - sun.p1.y;
        float r2 = sun.p1.z * sun.p1.z;
        if (across * across + off * off > r2) continue;
        vec3 radiance = sun.radiance / (r2 * max(cos(elevation), 1e-4));
        float most = max(radiance.x, max(radiance.y, radiance.z));
        sum += FC.shown_emission == 0 ? radiance * min(SHOWN_SUN / max(most, 1.17549435e-38), 1.0) : radiance;
    }
    return sum;
}

// Radiance that a path gets from a surface by itself: see src/reference/branches.rs.
vec3 emission_met(float pdf, Path path, SurfaceHit s, Hit hit, vec3 direction) {
    vec3 seen = emission_seen(s, direction);
    // Light samples of a lobe have found the suns.
    bool sunny = FC.draw_sun != 0 && pdf <= 0.0 && (FC.materials.at[s.material].flags & MATERIAL_SKY) != 0;
    if (sunny) {
        vec3 suns = suns_seen(direction);
#ifdef WHOLE_PIXELS
        if (suns != vec3(0.0)) met_sun = true;
#endif
        seen += suns;
    }
#ifdef FOLLOWS_BRANCHES
    uint number = pdf >= 0.0 ? FC.triangle_lights.at[hit.triangle] : NONE;
    if (number != NONE) {
        Material material = FC.materials.at[s.material];
        bool sky = (material.flags & MATERIAL_SKY) != 0;
        if (!s.front && !sky && (material.flags & MATERIAL_TWO_SIDED_EMISSION) == 0) return seen;
        vec3 glow = sky ? vec3(0.0) : s.glow;
        Light light = FC.lights.at[number];
        vec3 radiance = seen - glow;
        if (FC.shown_emission != 0) radiance = emitted(material, s.uv, s.position, direction) * light.scale;
        float cosine = -dot(s.geometric_normal, direction);
        float weight = 1.0;
        if (pdf > 0.0 && FC.soft_shadows != 0 && cosine > 0.0) {
            float other = lobe_chance(path.row, path.place, number) * hit.t * hit.t / (cosine * light.size);
            weight = pdf / (pdf + other);
        }
        return glow + radiance * weight;
    }
#endif
    return seen;
}

#endif
