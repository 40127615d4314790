#ifndef HALF_PRECISION_GLSL
#define HALF_PRECISION_GLSL

// Most that images in half precision are given to keep, which ends at 65504, and the most frames that they count one by one.
const float MOST_KEPT = 6e4;
const float MOST_FRAMES = 2048.0;

#endif
