// Light that no known light explains. Counterpart of src/scene/ambient.rs.
#ifndef AMBIENT_GLSL
#define AMBIENT_GLSL

const uint AMBIENT_OFF = 0;
const uint AMBIENT_CONSTANT = 1;

vec3 ambient_cube(uint index, vec3 n) {
    AmbientCube cube = FC.ambient_cubes.at[index];
    return cube.axes[n.x < 0.0 ? 1 : 0] * (n.x * n.x) + cube.axes[n.y < 0.0 ? 3 : 2] * (n.y * n.y)
         + cube.axes[n.z < 0.0 ? 5 : 4] * (n.z * n.z);
}

// Irradiance/π at a point for a unit normal.
vec3 ambient_at(vec3 position, vec3 normal) {
    if (FC.ambient == AMBIENT_OFF) return vec3(0.0);
    if (FC.ambient == AMBIENT_CONSTANT) return FC.ambient_constant;
    uvec3 size = uvec3(FC.ambient_width, FC.ambient_height, FC.ambient_depth);
    if (size.x == 0) return vec3(0.0);
    vec3 p = clamp((position - FC.ambient_origin) / FC.ambient_step, vec3(0.0), vec3(size - 1));
    vec3 low = floor(p);
    vec3 f = p - low;
    vec3 sum = vec3(0.0);
    float whole = 0.0;
    [[dont_unroll]] for (uint corner = 0; corner < 8; corner++) {
        uvec3 up = uvec3(corner & 1, corner >> 1 & 1, corner >> 2);
        uvec3 at = min(uvec3(low) + up, size - 1);
        uint index = (at.z * size.y + at.y) * size.x + at.x;
        vec3 share = mix(vec3(1.0) - f, f, equal(up, uvec3(1)));
        float weight = share.x * share.y * share.z * FC.ambient_cubes.at[index].open;
        if (weight > 0.0) {
            sum += ambient_cube(index, normal) * weight;
            whole += weight;
        }
    }
    return whole > 0.0 ? sum / whole : vec3(0.0);
}

#endif
