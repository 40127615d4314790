// From the eye through layers to the surface that is shaded: src/reference/layers.rs explains it.
#ifndef LAYERS_GLSL
#define LAYERS_GLSL

#include "luminance.glsl"
#include "through.glsl"
#include "fog.glsl"
#include "portal.glsl"

const float LEAST_SHARE = 1e-5;

// What a camera ray comes to.
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
    // Where the surface is seen: through mirrors and portals that is not where it is.
    Map place;
    // Length of the way to it, units.
    float distance;
};

Seen see(vec3 origin, vec3 direction, uint address) {
    Seen out_;
    out_.hit.triangle = NONE;
    out_.hit.t = 0.0;
    out_.share = vec3(1.0);
    out_.emission = vec3(0.0);
    out_.layers = vec3(0.0);
    out_.place = identity_map();
    out_.distance = 0.0;
    float travelled = 0.0;
    uint depth = 0;
    bool pending = false;
    SurfaceHit lit;
    Hit lit_hit;
    vec3 lit_share = vec3(0.0);
    float lit_fog = 1.0;
    // Fog on the way to the last surface, and what it leaves.
    vec4 fog = vec4(0.0, 0.0, 0.0, 1.0);
    begin_walk();
    uint dimension = DIM_LAYER;
    [[dont_unroll]] for (uint i = 0; i < MOST_LAYERS; i++) {
        meets_layers = true;
        Hit hit = trace(origin, direction, RAY_FAR, false);
        meets_layers = false;
        if (hit.triangle == NONE || max(out_.share.x, max(out_.share.y, out_.share.z)) <= LEAST_SHARE) {
            if (pending) {
                out_.surface = lit;
                out_.hit = lit_hit;
                out_.share = lit_share * lit_fog;
            }
            return out_;
        }
        walk_on(hit);
        Material material = FC.materials.at[FC.triangles.at[hit.triangle].material];
        out_.distance = travelled + hit.t;
        SurfaceHit s = surface_at(hit, direction, FC.cone * (1.0 + travelled / hit.t));
        if (!drawn(material, s.front)) continue;
        vec3 emission = emission_seen(s, direction);
        bool layer = (material.flags & MATERIAL_LAYER) != 0;
        vec4 there = fog_at(origin, direction, hit.t);
        out_.layers += out_.share * (there.rgb - fog.rgb);
        fog = there;
        if (pending) {
            if (!layer && hit.t - lit_hit.t <= ON_RECEIVER) {
                out_.emission = lit.through * emission;
                s.albedo = lit.albedo + lit.through * s.albedo;
                out_.surface = s;
                out_.hit = hit;
                out_.share = lit_share * fog.a;
                return out_;
            }
            float own = luminance(lit_share * lit.albedo);
            float rest = luminance(out_.share);
            float chance = own / max(own + rest, 1.17549435e-38);
            uint bits = bits2(FC.sequence, random_key(FC.seed, address, dimension), sample_index).x;
            dimension++;
            if (FC.choose_layers != 0) {
                if (unit_float(bits) < chance) {
                    out_.surface = lit;
                    out_.hit = lit_hit;
                    out_.share = lit_share * lit_fog / chance;
                    return out_;
                }
                out_.share /= 1.0 - chance;
            }
            pending = false;
        }
        if (!layer) {
            out_.surface = s;
            out_.hit = hit;
            out_.emission = emission;
            out_.share *= fog.a;
            return out_;
        }
        out_.layers += out_.share * emission * fog.a;
        if ((material.flags & MATERIAL_PORTAL) != 0) {
            out_.share *= s.through * fog.a;
            depth++;
            if (depth > FC.max_depth) return out_;
            go_through(FC.triangles.at[hit.triangle].surface, s, origin, direction, out_.place);
            travelled += hit.t;
            begin_walk();
            fog = vec4(0.0, 0.0, 0.0, 1.0);
            continue;
        }
        if (s.albedo != vec3(0.0)) {
            pending = true;
            lit = s;
            lit_hit = hit;
            lit_share = out_.share;
            lit_fog = fog.a;
        }
        out_.share *= s.through;
    }
    return out_;
}

#endif
