// What shading knows of a hit. Counterpart of src/reference/surface.rs.
#ifndef SURFACE_GLSL
#define SURFACE_GLSL

struct SurfaceHit {
    vec3 position;
    vec3 geometric_normal;
    vec3 shading_normal;
    vec2 uv;
    vec3 albedo;
    uint material;
    uint triangle;
    bool front;
    uint cluster;
    uint row;
};

vec3 point_to_world(Instance i, vec3 p) {
    if (i.identity == 1) return p;
    return vec3(dot(i.object_to_world[0], vec4(p, 1.0)), dot(i.object_to_world[1], vec4(p, 1.0)),
                dot(i.object_to_world[2], vec4(p, 1.0)));
}

vec3 normal_to_world(Instance i, vec3 n) {
    if (i.identity == 1) return n;
    return i.world_to_object[0].xyz * n.x + i.world_to_object[1].xyz * n.y + i.world_to_object[2].xyz * n.z;
}

vec3 offset_point(vec3 p, vec3 normal) {
    float scale = max(max(abs(p.x), abs(p.y)), abs(p.z)) * (1.0 / 262144.0);
    return p + normal * max(scale, 1.0 / 1024.0);
}

// Cluster at a point, NONE in solid.
uint cluster_at(vec3 point) {
    int at = 0;
    do {
        BspNode node = FC.bsp_nodes.at[at];
        float side = dot(node.normal, point) - node.dist;
        at = node.children[side < 0.0 ? 1 : 0];
    } while (at >= 0);
    return at == -1 ? NONE : uint(-2 - at);
}

const float NUDGES[5] = float[5](0.25, 1.0, 4.0, 8.0, 16.0);

uint classify(vec3 position, vec3 normal) {
    [[dont_unroll]] for (int i = 0; i < 5; i++) {
        uint cluster = cluster_at(position + normal * NUDGES[i]);
        if (cluster != NONE) return cluster;
    }
    return NONE;
}

float texture_lod(vec3 e1, vec3 e2, vec2 uv0, vec2 uv1, vec2 uv2, vec2 size, float width, float cosine) {
    float world_area = length(cross(e1, e2));
    vec2 t1 = (uv1 - uv0) * size;
    vec2 t2 = (uv2 - uv0) * size;
    float texel_area = abs(t1.x * t2.y - t1.y * t2.x);
    float ratio = texel_area / max(world_area, 1.17549435e-38);
    return 0.5 * log2(max(ratio, 1.17549435e-38)) + log2(max(width / max(abs(cosine), 1e-3), 1.17549435e-38));
}

SurfaceHit surface_at(Hit hit, vec3 direction, float cone) {
    SurfaceHit s;
    Instance instance = FC.instances.at[hit.instance];
    Triangle t = FC.triangles.at[hit.triangle];
    vec3 a = FC.positions.at[t.vertices[0]];
    vec3 b = FC.positions.at[t.vertices[1]];
    vec3 c = FC.positions.at[t.vertices[2]];
    VertexAttributes va = FC.attributes.at[t.vertices[0]];
    VertexAttributes vb = FC.attributes.at[t.vertices[1]];
    VertexAttributes vc = FC.attributes.at[t.vertices[2]];
    float b1 = hit.barycentrics.x;
    float b2 = hit.barycentrics.y;
    float b0 = 1.0 - b1 - b2;
    s.position = point_to_world(instance, a * b0 + b * b1 + c * b2);
    s.geometric_normal = normalize(normal_to_world(instance, cross(b - a, c - a)));
    vec3 interpolated = normal_to_world(instance, va.normal * b0 + vb.normal * b1 + vc.normal * b2);
    float len = length(interpolated);
    s.shading_normal = len > 0.0 ? interpolated / len : s.geometric_normal;
    if (dot(s.shading_normal, s.geometric_normal) < 0.0) s.shading_normal = s.geometric_normal;
    s.front = dot(s.geometric_normal, direction) <= 0.0;
    if (!s.front) {
        s.geometric_normal = -s.geometric_normal;
        s.shading_normal = -s.shading_normal;
    }
    s.uv = va.uv * b0 + vb.uv * b1 + vc.uv * b2;
    s.material = t.material;
    s.triangle = hit.triangle;
    Material material = FC.materials.at[t.material];
    if ((material.flags & MATERIAL_SKY) != 0) {
        s.albedo = vec3(0.0);
    } else {
        float lod = 0.0;
        if (cone > 0.0) {
            TextureInfo info = FC.textures.at[material.texture_index];
            vec2 size = vec2(info.width, info.height);
            float d = length(direction);
            lod = texture_lod(b - a, c - a, va.uv, vb.uv, vc.uv, size, cone * hit.t * d,
                              dot(s.geometric_normal, direction) / d);
        }
        s.albedo = sample_texture(material.texture_index, s.uv, lod, (material.flags & MATERIAL_CLAMP) != 0).rgb;
    }
    s.cluster = classify(s.position, s.geometric_normal);
    s.row = s.cluster != NONE ? s.cluster : t.fallback_row;
    return s;
}

uint sky_box_side(vec3 d, out vec2 uv) {
    vec3 a = abs(d);
    uint side;
    vec2 st;
    float m;
    if (a.z >= a.x && a.z >= a.y) {
        m = a.z;
        if (d.z > 0.0) { side = 4; st = vec2(-d.y, d.x); } else { side = 5; st = vec2(-d.y, -d.x); }
    } else if (a.x >= a.y) {
        m = a.x;
        if (d.x > 0.0) { side = 0; st = vec2(-d.y, -d.z); } else { side = 1; st = vec2(d.y, -d.z); }
    } else {
        m = a.y;
        if (d.y > 0.0) { side = 2; st = vec2(d.x, -d.z); } else { side = 3; st = vec2(-d.x, -d.z); }
    }
    uv = st / m * 0.5 + 0.5;
    return side;
}

vec3 sky_radiance(Material material, vec3 direction) {
    if ((material.flags & MATERIAL_SKY_BOX) == 0) return material.emission;
    vec2 uv;
    uint side = sky_box_side(direction, uv);
    return material.emission * sample_texture(material.sky[side], uv, 0.0, true).rgb;
}

// Radiance that a surface emits at texture coordinates towards -direction, from the side that emits.
vec3 emitted(Material material, vec2 uv, vec3 direction) {
    if ((material.flags & MATERIAL_SKY) != 0) return sky_radiance(material, direction);
    if (material.emission_texture == NONE || material.emission == vec3(0.0)) return material.emission;
    bool clamped = (material.flags & MATERIAL_CLAMP) != 0;
    return material.emission * sample_texture(material.emission_texture, uv, 0.0, clamped).rgb;
}

vec3 emission_seen(SurfaceHit s, vec3 direction) {
    Material material = FC.materials.at[s.material];
    if (s.front || (material.flags & (MATERIAL_SKY | MATERIAL_TWO_SIDED_EMISSION)) != 0) {
        return emitted(material, s.uv, direction);
    }
    return vec3(0.0);
}

#endif
