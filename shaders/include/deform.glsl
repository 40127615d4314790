// Vertices that move. Counterpart of src/scene/dynamic_geometry.rs, which explains it.
#ifndef DEFORM_GLSL
#define DEFORM_GLSL

const float NOISE_DENSITY = 0.98;
const float NOISE_AXES = 100.0;

struct Moved {
    vec3 position;
    vec3 normal;
};

float fraction_at(uint clock, uint rate) {
    return float((clock * rate) >> 8) * (1.0 / 16777216.0);
}

float wave_value(Wave w, float phase) {
    w.phase = phase;
    w.rate = 0;
    return wave_at(w);
}

// A corner of a quad that faces the eye, upright.
Moved sprite(Moved v, vec3 quad[4], vec3 eye) {
    vec3 middle = (quad[0] + quad[1] + quad[2] + quad[3]) * 0.25;
    vec3 normal = eye - middle;
    normal = dot(normal, normal) > 0.0 ? normalize(normal) : vec3(1.0, 0.0, 0.0);
    vec3 up = abs(normal.z) < 0.999 ? vec3(0.0, 0.0, 1.0) : vec3(1.0, 0.0, 0.0);
    vec3 right = normalize(cross(up, normal));
    up = cross(normal, right);
    vec3 own = normalize(cross(quad[1] - quad[0], quad[2] - quad[0]));
    vec3 own_up = abs(own.z) < 0.999 ? vec3(0.0, 0.0, 1.0) : vec3(1.0, 0.0, 0.0);
    vec3 own_right = normalize(cross(own_up, own));
    own_up = cross(own, own_right);
    vec3 d = v.position - middle;
    return Moved(middle + right * dot(d, own_right) + up * dot(d, own_up), normal);
}

// A corner of a quad that turns about its long axis to face the eye.
Moved pivoted(Moved v, vec3 quad[4], vec3 eye) {
    vec3 middle = (quad[0] + quad[1] + quad[2] + quad[3]) * 0.25;
    vec3 a = quad[1] - quad[0], b = quad[2] - quad[0], c = quad[3] - quad[0];
    vec3 own = normalize(cross(a, b));
    // The middle one by length of the three.
    if (dot(a, a) > dot(b, b)) { vec3 t = a; a = b; b = t; }
    if (dot(b, b) > dot(c, c)) { vec3 t = b; b = c; c = t; }
    if (dot(a, a) > dot(b, b)) { vec3 t = a; a = b; b = t; }
    vec3 axis = normalize(b);
    vec3 across = cross(axis, own);
    vec3 to_eye = eye - middle;
    vec3 normal = to_eye - axis * dot(to_eye, axis);
    normal = dot(normal, normal) > 0.0 ? normalize(normal) : own;
    vec3 d = v.position - middle;
    return Moved(middle + axis * dot(d, axis) + cross(axis, normal) * dot(d, across), normal);
}

// A point of the world in the space of an instance that has been moved rigidly.
vec3 to_carrier(vec4 rows[3], vec3 p) {
    vec3 d = p - vec3(rows[0].w, rows[1].w, rows[2].w);
    return rows[0].xyz * d.x + rows[1].xyz * d.y + rows[2].xyz * d.z;
}

// A dynamic vertex in this frame or the one before, in the space of its mesh.
Moved deformed(uint vertex, bool before) {
    uint clock = before ? FC.old_clock : FC.clock;
    RestVertex rest = FC.rest_vertices.at[vertex - FC.first_dynamic_vertex];
    Moved v = Moved(rest.position, rest.normal);
    if (rest.material == NONE) return v;
    Material material = FC.materials.at[rest.material];
    [[dont_unroll]] for (uint i = material.first_deform; i < material.first_deform + material.deform_count; i++) {
        Deform d = FC.deforms.at[i];
        if (d.kind == DEFORM_WAVE) {
            float off = (v.position.x + v.position.y + v.position.z) * d.a;
            v.position += v.normal * wave_value(d.wave, d.wave.phase + fraction_at(clock, d.wave.rate) + off);
        } else if (d.kind == DEFORM_NORMAL) {
            Wave noise = Wave(WAVE_NOISE, 0.0, d.a, 0.0, 0);
            vec3 p = v.position * NOISE_DENSITY;
            float along = p.x + p.y + p.z;
            float phase = fraction_at(clock, d.rate);
            vec3 shift = vec3(wave_value(noise, along / NOISE_STEPS + phase),
                              wave_value(noise, (along + NOISE_AXES) / NOISE_STEPS + phase),
                              wave_value(noise, (along + 2.0 * NOISE_AXES) / NOISE_STEPS + phase));
            v.normal = normalize(v.normal + shift);
        } else if (d.kind == DEFORM_BULGE) {
            float turn = FC.attributes.at[vertex].uv.x * d.a + fraction_at(clock, d.rate);
            v.position += v.normal * (precise_sin_cos(fract(turn) * TAU).x * d.b);
        } else if (d.kind == DEFORM_MOVE) {
            v.position += d.direction * wave_value(d.wave, d.wave.phase + fraction_at(clock, d.wave.rate));
        } else {
            vec3 quad[4];
            vec3 eye = before ? FC.old_eye : FC.eye;
            if (rest.instance != NONE) {
                Instance carrier = FC.instances.at[rest.instance];
                eye = to_carrier(before ? carrier.old_object_to_world : carrier.object_to_world, eye);
            }
            for (uint k = 0; k < 4; k++) quad[k] = FC.rest_vertices.at[rest.quad - FC.first_dynamic_vertex + k].position;
            if (d.kind == DEFORM_AUTOSPRITE) v = sprite(v, quad, eye);
            else v = pivoted(v, quad, eye);
        }
    }
    return v;
}

#endif
