#version 460
// Distance to what is under the crosshair, for depth of field without a fixed focus.
#extension GL_GOOGLE_include_directive : require
#include "prelude.glsl"
#include "random.glsl"
#include "texture.glsl"
#include "trace.glsl"
#include "camera.glsl"

layout(local_size_x = 1) in;

const float DEFAULT_FOCUS = 512.0;

void main() {
    Hit hit = trace_closest(FC.eye, direction_through(vec2(FC.size) * 0.5), RAY_FAR);
    FC.focus.at[0] = hit.triangle == NONE ? DEFAULT_FOCUS : hit.t;
}
