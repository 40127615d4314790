// Stages of a material at a point: src/scene/program.rs explains them. Counterpart of src/reference/program.rs.
#ifndef PROGRAM_GLSL
#define PROGRAM_GLSL

#include "random.glsl"
#include "texture.glsl"
#include "precise.glsl"

const float UNLIT = 64.0 / 255.0;
const float OVERBRIGHT = 4.0;
const vec3 SPECULAR_LIGHT = vec3(-960.0, 1980.0, 96.0);
const float TURBULENCE = 1.0 / 1024.0;
const float CLOUD_WORLD = 4096.0;
const float NOISE_STEPS = 256.0;
const float TAU = 6.28318530717958647692;
const float LEAST = 1.17549435e-38;
// Level of detail of an image's last level, its mean.
const float MEAN_LOD = 64.0;

// What stages look at.
struct Point {
    vec2 uv;
    vec2 lightmap_uv;
    // Encoded vertex colour.
    vec4 colour;
    vec3 position;
    vec3 normal;
    vec3 to_viewer;
    float distance;
    // Level of detail of an image of one texel; far below 0 for full resolution.
    float lod;
};

// What a surface does with light, linear.
struct Shade {
    vec3 albedo;
    vec3 glow;
    vec3 through;
    vec3 specular;
};

// Fraction of a period, 0..1.
float clock_fraction(uint rate) {
    return float((FC.clock * rate) >> 8) * (1.0 / 16777216.0);
}

float noise_step(uint n) {
    return float(pcg(n & 255u) >> 8) * (2.0 / 16777216.0) - 1.0;
}

float wave_at(Wave w) {
    float f = fract(w.phase + clock_fraction(w.rate));
    float value;
    if (w.function == WAVE_SINE) value = precise_sin_cos(f * TAU).x;
    else if (w.function == WAVE_TRIANGLE) value = f < 0.25 ? 4.0 * f : f < 0.75 ? 2.0 - 4.0 * f : 4.0 * f - 4.0;
    else if (w.function == WAVE_SQUARE) value = f < 0.5 ? 1.0 : -1.0;
    else if (w.function == WAVE_SAWTOOTH) value = f;
    else if (w.function == WAVE_INVERSE_SAWTOOTH) value = 1.0 - f;
    else {
        float at = f * NOISE_STEPS;
        float a = noise_step(uint(at));
        float b = noise_step(uint(at) + 1u);
        value = a + (b - a) * fract(at);
    }
    return w.base + w.amplitude * value;
}

vec2 stage_coordinates(Stage s, Point p, out float density) {
    vec2 uv = p.uv;
    if (s.tc_gen == TC_LIGHTMAP) {
        uv = p.lightmap_uv;
    } else if (s.tc_gen == TC_ENVIRONMENT) {
        vec3 reflected = p.normal * (2.0 * dot(p.normal, p.to_viewer)) - p.to_viewer;
        uv = vec2(0.5 + reflected.y * 0.5, 0.5 - reflected.z * 0.5);
    } else if (s.tc_gen == TC_VECTOR) {
        uv = vec2(dot(p.position, s.tc_vectors[0]), dot(p.position, s.tc_vectors[1]));
    }
    density = 1.0;
    [[dont_unroll]] for (uint i = s.first_mod; i < s.first_mod + s.mod_count; i++) {
        TcMod m = FC.tc_mods.at[i];
        if (m.kind == TC_SCROLL) {
            uv += vec2(clock_fraction(m.rates[0]), clock_fraction(m.rates[1]));
        } else if (m.kind == TC_TURBULENCE) {
            vec2 at = vec2(p.position.x + p.position.z, p.position.y) * TURBULENCE;
            vec2 turns = fract(at + (m.wave.phase + clock_fraction(m.wave.rate))) * TAU;
            uv += vec2(precise_sin_cos(turns.x).x, precise_sin_cos(turns.y).x) * m.wave.amplitude;
        } else if (m.kind == TC_STRETCH) {
            float w = wave_at(m.wave);
            float scale = w == 0.0 ? 1.0 : 1.0 / w;
            uv = (uv - 0.5) * scale + 0.5;
            density *= abs(scale);
        } else if (m.kind == TC_ROTATE) {
            vec2 turn = precise_sin_cos(clock_fraction(m.rates[0]) * TAU);
            vec2 d = uv - 0.5;
            uv = vec2(turn.y * d.x - turn.x * d.y, turn.x * d.x + turn.y * d.y) + 0.5;
        } else {
            uv = m.matrix.xy * uv.x + m.matrix.zw * uv.y + m.offset;
            density *= sqrt(abs(m.matrix.x * m.matrix.w - m.matrix.y * m.matrix.z));
        }
    }
    return uv;
}

float alpha_factor(Stage s, Point p) {
    if (s.alpha_source == SOURCE_WAVE) return clamp(wave_at(s.alpha_wave), 0.0, 1.0);
    if (s.alpha_source == SOURCE_VERTEX) return p.colour.w;
    if (s.alpha_source == SOURCE_ONE_MINUS_VERTEX) return 1.0 - p.colour.w;
    if (s.alpha_source == SOURCE_SPECULAR) {
        vec3 to_light = normalize(SPECULAR_LIGHT - p.position);
        vec3 reflected = p.normal * (2.0 * dot(p.normal, to_light)) - to_light;
        float l = max(dot(reflected, p.to_viewer), 0.0);
        l *= l;
        return min(l * l, 1.0);
    }
    if (s.alpha_source == SOURCE_PORTAL) return clamp(p.distance / s.alpha, 0.0, 1.0);
    return s.alpha;
}

vec3 rgb_factor(Stage s, Point p) {
    if (s.rgb_source == SOURCE_WAVE) return vec3(clamp(wave_at(s.rgb_wave), 0.0, 1.0));
    if (s.rgb_source == SOURCE_VERTEX) return min(p.colour.rgb * OVERBRIGHT, vec3(1.0));
    if (s.rgb_source == SOURCE_ONE_MINUS_VERTEX) return 1.0 - min(p.colour.rgb * OVERBRIGHT, vec3(1.0));
    return s.rgb;
}

// `mean`: its image's mean stands for the image.
vec4 stage_texel(Stage s, Point p, bool encoded, bool mean) {
    if ((s.flags & STAGE_WHITE) != 0) return vec4(1.0);
    uint turn = min(uint(clock_fraction(s.frame_rate) * float(s.frames)), s.frames - 1u);
    uint index = s.textures[turn];
    float density;
    vec2 uv = stage_coordinates(s, p, density);
    TextureInfo info = FC.textures.at[index];
    float lod = mean ? MEAN_LOD : p.lod + 0.5 * log2(float(info.width * info.height)) + log2(max(density, LEAST));
    bool clamped = (s.flags & STAGE_CLAMP) != 0;
    return sample_as(index, uv, lod, clamped, encoded);
}

vec3 decode_srgb(vec3 x) {
    return mix(pow((x + 0.055) / 1.055, vec3(2.4)), x / 12.92, lessThanEqual(x, vec3(0.04045)));
}

vec3 laid(vec3 c, float opacity) {
    return opacity > 0.0 ? decode_srgb(min(c / opacity, vec3(1.0))) * opacity : decode_srgb(c);
}

// `glossy`: glossy stages reflect.
Shade shade(Material material, Point p, bool glossy) {
    vec3 lit = vec3(0.0), over = vec3(0.0), add = vec3(0.0), through = vec3(1.0), specular = vec3(0.0);
    float share = 1.0;
    [[dont_unroll]] for (uint i = 0; i < material.stage_count; i++) {
        Stage s = FC.stages.at[material.first_stage + i];
        bool reflects = glossy && (s.flags & STAGE_GLOSSY) != 0;
        vec4 c = stage_texel(s, p, true, reflects) * vec4(rgb_factor(s, p), alpha_factor(s, p));
        bool is_lit = (s.flags & STAGE_LIT) != 0;
        float own = 1.0;
        vec3 from_there = vec3(0.0);
        if (s.source == BLEND_ZERO) own = 0.0;
        else if (s.source == BLEND_DST_COLOR) { own = 0.0; from_there = c.rgb; }
        else if (s.source == BLEND_ONE_MINUS_DST_COLOR) from_there = -c.rgb;
        else if (s.source == BLEND_SRC_ALPHA) own = c.a;
        else if (s.source == BLEND_ONE_MINUS_SRC_ALPHA) own = 1.0 - c.a;
        float keep = 0.0;
        if (s.destination == BLEND_ONE || s.destination == BLEND_ONE_MINUS_SRC_COLOR) keep = 1.0;
        else if (s.destination == BLEND_SRC_ALPHA) keep = c.a;
        else if (s.destination == BLEND_ONE_MINUS_SRC_ALPHA) keep = 1.0 - c.a;
        if (s.destination == BLEND_SRC_COLOR) from_there += c.rgb;
        else if (s.destination == BLEND_ONE_MINUS_SRC_COLOR) from_there -= c.rgb;
        bool coloured = from_there != vec3(0.0) || s.source == BLEND_DST_COLOR || s.destination == BLEND_SRC_COLOR;
        vec3 e = c.rgb * own;
        if (reflects) {
            vec3 base = lit + over + add;
            specular = clamp(specular * keep + e + base * max(from_there, 0.0), 0.0, 1.0);
            lit *= keep;
            over *= keep;
            add *= keep;
            if (coloured) through *= max(keep + from_there, 0.0);
            else share *= keep;
            continue;
        }
        if (is_lit && coloured) {
            lit += over + add;
            over = vec3(0.0);
            add = vec3(0.0);
        }
        vec3 k = vec3(keep) + from_there;
        lit *= k;
        over *= k;
        add *= k;
        specular *= clamp(k, 0.0, 1.0);
        if (coloured) through *= k;
        else share *= keep;
        if (is_lit) {
            lit += e;
        } else if ((s.flags & STAGE_EMISSION) == 0) {
            bool lies = s.source == BLEND_SRC_ALPHA && s.destination == BLEND_ONE_MINUS_SRC_ALPHA;
            if (keep == 0.0 || lies) over += e;
            else add += e;
        }
        add += min(over, 0.0);
        lit = clamp(lit, 0.0, 1.0);
        over = clamp(over, 0.0, 1.0);
        add = clamp(add, 0.0, 1.0);
        through = max(through, 0.0);
    }
    float opacity = 1.0 - share;
    Shade r;
    r.albedo = laid(lit, opacity);
    r.glow = UNLIT * (opacity == 1.0 ? decode_srgb(min(over + add, vec3(1.0))) : laid(over, opacity) + decode_srgb(add));
    r.through = decode_srgb(through) * share;
    r.specular = decode_srgb(specular);
    return r;
}

// What the stages that shine show, linear: emission without its factor.
vec3 shining(Material material, Point p) {
    vec3 sum = vec3(0.0);
    [[dont_unroll]] for (uint i = 0; i < material.stage_count; i++) {
        Stage s = FC.stages.at[material.first_stage + i];
        if ((s.flags & STAGE_EMISSION) == 0) continue;
        vec4 c = stage_texel(s, p, false, false);
        float alpha = s.source == BLEND_SRC_ALPHA ? c.a * alpha_factor(s, p) : 1.0;
        sum += c.rgb * decode_srgb(rgb_factor(s, p)) * alpha;
    }
    return sum;
}

// Alpha that the material's alpha test looks at, full resolution.
float tested_alpha(Material material, Point p) {
    if (material.alpha_stage == NONE) {
        return sample_texture(material.texture_index, p.uv, 0.0, (material.flags & MATERIAL_CLAMP) != 0).a;
    }
    Stage s = FC.stages.at[material.alpha_stage];
    return stage_texel(s, p, false, false).a * alpha_factor(s, p);
}

// Where clouds are seen in a direction: their texture coordinates.
vec2 cloud_coordinates(vec3 direction, float height) {
    float r = CLOUD_WORLD;
    float z = direction.z;
    float t = sqrt(z * z * r * r + 2.0 * r * height + height * height) - z * r;
    vec3 v = normalize(direction * t + vec3(0.0, 0.0, r));
    return vec2(precise_angle(length(v.yz), v.x), precise_angle(length(v.xz), v.y));
}

#endif
