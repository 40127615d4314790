// From the eye through layers to the surface that is shaded: src/reference/layers.rs explains it.
#ifndef LAYERS_GLSL
#define LAYERS_GLSL

#include "luminance.glsl"
#include "through.glsl"
#include "fog.glsl"
#include "portal.glsl"
#include "branches.glsl"

const float LEAST_SHARE = 1e-5;

// What a path comes to.
struct Seen {
    SurfaceHit surface;
    // Its triangle is NONE where nothing is shaded.
    Hit hit;
    // Share of the surface's light that comes through the layers.
    vec3 share;
    // Radiance that the surface emits, before the layers.
    vec3 emission;
    // Radiance of the layers.
    vec3 layers;
    // Direction in which it is met.
    vec3 direction;
    // Its lobe is to be lit, too.
    bool glossy;
    // Where the surface is seen: through mirrors, portals and water that is not where it is.
    Map place;
    // Length of the way to it, units.
    float distance;
};

#ifdef NOTES_INTERFACE
// The first surface at which something branches off the eye ray, or may, as it is seen: guide.glsl.
uvec4 interface_guide = uvec4(0);

void note_interface(Map place, SurfaceHit s) {
    if (interface_guide != uvec4(0)) return;
    float depth = dot(mapped(place, s.position, 1.0) - FC.eye, FC.forward);
    interface_guide = pack_guide(depth, to_view(mapped(place, s.shading_normal, 0.0)), s.material, 0);
}
#else
void note_interface(Map place, SurfaceHit s) {}
#endif

float chance_on(uint address, uint dimension) {
    return unit_float(bits2(FC.sequence, random_key(FC.seed, address, dimension), sample_index).x);
}

Seen see(Path path) {
    vec3 origin = path.origin;
    vec3 direction = path.direction;
    Seen out_;
    out_.hit.triangle = NONE;
    out_.hit.t = 0.0;
    out_.share = path.share;
    out_.emission = vec3(0.0);
    out_.layers = vec3(0.0);
    out_.direction = direction;
    out_.glossy = false;
    out_.place = identity_map();
    out_.distance = 0.0;
    float travelled = path.travelled;
    uint depth = path.depth;
    float pdf = path.pdf;
    uint kind = depth > 0 ? SEEN_BY_REFLECTIONS : SEEN_BY_EYE;
    bool pending = false;
    SurfaceHit lit;
    Hit lit_hit;
    vec3 lit_share = vec3(0.0);
    vec3 lit_direction = direction;
    float lit_fog = 1.0;
    float lit_distance = 0.0;
    // Fog on the way to the last surface, and what it leaves.
    vec4 fog = vec4(0.0, 0.0, 0.0, 1.0);
    const vec4 NO_FOG = vec4(0.0, 0.0, 0.0, 1.0);
    begin_walk();
    uint dimension = DIM_LAYER;
    uint branch = 0;
    [[dont_unroll]] for (uint i = 0; i < MOST_LAYERS; i++) {
        meets_layers = true;
        ray_kind = kind;
        Hit hit = trace(origin, direction, RAY_FAR, false);
        meets_layers = false;
        ray_kind = SEEN_BY_SHADOWS;
        if (hit.triangle == NONE || max(out_.share.x, max(out_.share.y, out_.share.z)) <= LEAST_SHARE) {
            if (pending) {
                out_.surface = lit;
                out_.hit = lit_hit;
                out_.share = lit_share * lit_fog;
                out_.direction = lit_direction;
            }
            break;
        }
        walk_on(hit);
        Material material = FC.materials.at[FC.triangles.at[hit.triangle].material];
        out_.distance = travelled + hit.t;
        // Where it is in the map is looked up for what is shaded alone.
        SurfaceHit s = shaded_hit(hit, direction, FC.cone, travelled);
        if (!drawn(material, s.front)) continue;
        bool layer = (material.flags & MATERIAL_LAYER) != 0;
        if (FC.white != 0) {
            if (layer) continue;
            if ((material.flags & MATERIAL_SKY) == 0) whiten(s);
        }
        bool follows = FC.secondary != SECONDARY_OFF && depth < FC.max_depth;
        uint reflection = REFLECTS_NOT;
        if (follows) reflection = split(material, s, direction, out_.share);
        else unsplit(s);
        vec3 emission = emission_met(pdf, path, s, hit, direction);
        vec4 there = FC.white != 0 ? fog : fog_at(origin, direction, hit.t);
        out_.layers += out_.share * (there.rgb - fog.rgb);
        fog = there;
        if (pending) {
            if (!layer && out_.distance - lit_distance <= ON_RECEIVER) {
                out_.emission = lit.through * emission;
                s.albedo = lit.albedo + lit.through * s.albedo;
                out_.surface = s;
                out_.hit = hit;
                out_.share = lit_share * fog.a;
                out_.direction = direction;
                break;
            }
            float own = luminance(lit_share * lit.albedo);
            float rest = luminance(out_.share);
            float likely = own / max(own + rest, 1.17549435e-38);
            float u = chance_on(path.address, dimension);
            dimension++;
            if (FC.choose_layers != 0) {
                if (u < likely) {
                    out_.surface = lit;
                    out_.hit = lit_hit;
                    out_.share = lit_share * lit_fog / likely;
                    out_.direction = lit_direction;
                    break;
                }
                out_.share /= 1.0 - likely;
            }
            pending = false;
        }
        vec3 share = out_.share * fog.a;
        float counts = 1.0;
        if (reflection == REFLECTS_GLOSSY) note_interface(out_.place, s);
        if (reflection == REFLECTS_GLOSSY && !survives(path, branch, share * s.specular, counts)) {
            reflection = REFLECTS_NOT;
            branch++;
        }
        if (reflection == REFLECTS_GLOSSY) {
            out_.glossy = !layer;
            branch_count++;
            s.specular *= counts;
#ifdef FOLLOWS_BRANCHES
            Path from = path;
            from.depth = depth;
            locate(s);
            push_lobe(from, material, s, direction, branch, share, out_.distance, !layer);
#endif
            branch++;
            // The stack holds no more branches than this allows, however many layers the ray meets.
            depth++;
        }
        bool goes_back = false;
        if (reflection == REFLECTS_SMOOTH) {
            goes_back = luminance(s.albedo + emission + s.through) <= 0.0;
            if (!goes_back) {
                // In frames that are shown as they come, branches don't branch.
                bool both = FC.branch_share <= 0.0 || path.depth == 0;
                if (FC.secondary == SECONDARY_BOTH && branch_count < MOST_BRANCHES && both) {
                    note_interface(out_.place, s);
                    if (survives(path, branch, share * s.specular, counts)) {
                        branch_count++;
#ifdef FOLLOWS_BRANCHES
                        vec3 start, back;
                        mirrored(s, direction, start, back);
                        push_branch(Path(start, back, share * s.specular * counts, out_.distance, depth + 1,
                                         branch_address(path.address, branch), -1.0, 0, 0));
#endif
                    }
                    branch++;
                } else {
                    float likely = clamp(s.specular.x, LEAST_BRANCH, 1.0 - LEAST_BRANCH);
                    goes_back = chance_on(path.address, dimension) < likely;
                    dimension++;
                    out_.share /= goes_back ? likely : 1.0 - likely;
                }
            }
            depth++;
        }
        if (!layer && !goes_back) {
            out_.surface = s;
            out_.hit = hit;
            out_.emission = emission;
            out_.share *= fog.a;
            out_.direction = direction;
            break;
        }
        vec3 onward = vec3(0.0);
        if (goes_back) {
            out_.share *= s.specular * fog.a;
            // As far as motion goes, the surface reflects like a plane.
            reflect_at(s.position, s.shading_normal, out_.place);
            kind = SEEN_BY_REFLECTIONS;
            mirrored(s, direction, origin, onward);
        } else {
            out_.layers += out_.share * emission * fog.a;
            if ((material.flags & MATERIAL_PORTAL) != 0) {
                out_.share *= s.through * fog.a;
                depth++;
                if (depth > FC.max_depth) break;
                onward = direction;
                kind = SEEN_BY_REFLECTIONS;
                go_through(FC.triangles.at[hit.triangle].surface, s, origin, onward, out_.place);
            } else {
                if (s.albedo != vec3(0.0)) {
                    pending = true;
                    lit = s;
                    lit_hit = hit;
                    lit_direction = direction;
                    lit_share = out_.share;
                    lit_fog = fog.a;
                    lit_distance = out_.distance;
                }
                out_.share *= s.through;
                if (follows) onward = bent(material, s, direction);
                if (onward != vec3(0.0)) {
                    out_.share *= fog.a;
                    lit_share *= lit_fog;
                    lit_fog = 1.0;
                    bends_at(s.position, direction, onward, out_.place);
                    origin = offset_point(s.position, -s.geometric_normal);
                }
            }
        }
        if (onward != vec3(0.0)) {
            direction = onward;
            travelled = out_.distance;
            pdf = -1.0;
            fog = NO_FOG;
            begin_walk();
#ifdef WHOLE_PIXELS
            whole_pixel = false;
#endif
        }
    }
    if (out_.hit.triangle != NONE) locate(out_.surface);
    return out_;
}

#endif
