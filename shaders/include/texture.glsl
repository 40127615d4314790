// Texture lookups with single texels, float weights and an exact table for sRGB; see src/reference/texture.rs for why.
#ifndef TEXTURE_GLSL
#define TEXTURE_GLSL

layout(set = 0, binding = 1) uniform sampler2D textures[];

vec4 texel(uint index, int level, ivec2 p, ivec2 size, bool clamped) {
    if (clamped) {
        p = clamp(p, ivec2(0), size - 1);
    } else {
        p = ivec2(mod(vec2(p), vec2(size)));
        p = clamp(p, ivec2(0), size - 1);
    }
    return texelFetch(textures[nonuniformEXT(index)], p, level);
}

// Encoded texel to linear light; alpha is linear already.
vec4 decode(vec4 t) {
    uvec3 code = uvec3(t.rgb * 255.0 + 0.5);
    return vec4(FC.srgb.at[code.r], FC.srgb.at[code.g], FC.srgb.at[code.b], t.a);
}

vec4 bilinear(uint index, int level, vec2 uv, bool clamped, bool encoded) {
    TextureInfo info = FC.textures.at[index];
    ivec2 size = max(ivec2(info.width, info.height) >> level, ivec2(1));
    uv = clamped ? clamp(uv, vec2(0.0), vec2(1.0)) : uv - floor(uv);
    vec2 p = uv * vec2(size) - 0.5;
    vec2 base = floor(p);
    vec2 f = p - base;
    ivec2 q = ivec2(base);
    vec4 a = texel(index, level, q, size, clamped);
    vec4 b = texel(index, level, q + ivec2(1, 0), size, clamped);
    vec4 c = texel(index, level, q + ivec2(0, 1), size, clamped);
    vec4 d = texel(index, level, q + ivec2(1, 1), size, clamped);
    if (!encoded) {
        a = decode(a);
        b = decode(b);
        c = decode(c);
        d = decode(d);
    }
    vec4 top = a + (b - a) * f.x;
    vec4 bottom = c + (d - c) * f.x;
    return top + (bottom - top) * f.y;
}

// RGB decoded or as it is, alpha; `encoded` filters it as it is, too: what stages blend.
vec4 sample_as(uint index, vec2 uv, float lod, bool clamped, bool encoded) {
    if (any(isnan(uv)) || any(isinf(uv))) return vec4(0.0);
    int levels = int(FC.textures.at[index].levels);
    lod = clamp(lod, 0.0, float(levels - 1));
    float base = floor(lod);
    vec4 near = bilinear(index, int(base), uv, clamped, encoded);
    float f = lod - base;
    if (f == 0.0) return near;
    vec4 far = bilinear(index, int(base) + 1, uv, clamped, encoded);
    return near + (far - near) * f;
}

vec4 sample_texture(uint index, vec2 uv, float lod, bool clamped) {
    return sample_as(index, uv, lod, clamped, false);
}

vec2 uv_at(uint triangle, vec2 barycentrics) {
    Triangle t = FC.triangles.at[triangle];
    vec2 a = FC.attributes.at[t.vertices[0]].uv;
    vec2 b = FC.attributes.at[t.vertices[1]].uv;
    vec2 c = FC.attributes.at[t.vertices[2]].uv;
    return a * (1.0 - barycentrics.x - barycentrics.y) + b * barycentrics.x + c * barycentrics.y;
}

#endif
