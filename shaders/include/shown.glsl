#ifndef SHOWN_GLSL
#define SHOWN_GLSL

// Radiance that a frame shows for itself.
vec3 shown_radiance(ivec2 p) {
    return FC.taa != 0 ? imageLoad(taa_now, p).rgb : imageLoad(image_composite, p).rgb;
}

#endif
