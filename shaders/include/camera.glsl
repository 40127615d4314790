// Camera rays. Counterpart of src/reference/primary.rs.
#ifndef CAMERA_GLSL
#define CAMERA_GLSL

#include "camera_motion.glsl"

// Unit direction through a point of the image, in pixels from the top left.
vec3 direction_through(vec2 p) {
    vec2 s = vec2(2.0 * p.x / float(FC.size.x) - 1.0, 1.0 - 2.0 * p.y / float(FC.size.y))
           * vec2(FC.half_width, FC.half_height);
    return normalize(FC.forward + FC.right * s.x + FC.up * s.y);
}

void camera_ray(uvec2 pixel, uint index, out vec3 origin, out vec3 direction) {
    uint address = pixel.x + (pixel.y << 16);
    vec2 jitter = vec2(0.5);
    if (FC.jitter.x >= 0.0) {
        jitter = FC.jitter;
    } else if (FC.antialiasing != 0) {
        jitter = sample2(FC.sequence, random_key(FC.seed, address, DIM_PIXEL), index);
    }
    origin = FC.eye;
    direction = direction_through(vec2(pixel) + jitter);
    if (FC.aperture > 0.0) {
        vec2 lens = sample_disc(sample2(FC.sequence, random_key(FC.seed, address, DIM_LENS), index));
        vec3 sharp = origin + direction * (FC.focus.at[0] / dot(direction, FC.forward));
        origin += (FC.right * lens.x + FC.up * lens.y) * FC.aperture;
        direction = normalize(sharp - origin);
    }
}

#endif
