#ifndef CAMERA_MOTION_GLSL
#define CAMERA_MOTION_GLSL

const vec2 BEHIND = vec2(1e9);

// Where something was in the image of the frame before, less where it is in this one: pixels, y down. `a` and `b` lead to it from
// this eye and the old one. Both places are found in the same way, so that a view that stands still gives exactly 0. What is
// behind the old eye gets `BEHIND`.
vec2 motion_between(vec3 a, vec3 b) {
    precise float depth = dot(a, FC.forward);
    precise float old_depth = dot(b, FC.old_forward);
    if (!(depth > 0.0) || !(old_depth > 0.0)) return BEHIND;
    precise vec2 now = vec2(dot(a, FC.right), dot(a, FC.up)) / depth / vec2(FC.half_width, FC.half_height);
    precise vec2 before =
        vec2(dot(b, FC.old_right), dot(b, FC.old_up)) / old_depth / vec2(FC.old_half_width, FC.old_half_height);
    return (before - now) * vec2(0.5, -0.5) * vec2(FC.size);
}

vec2 motion_of(vec3 point) {
    return motion_between(point - FC.eye, point - FC.old_eye);
}

// The same of what is infinitely far away in a direction.
vec2 motion_of_direction(vec3 direction) {
    return motion_between(direction, direction);
}

#endif
