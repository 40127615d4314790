#version 460
// Direct stage: next-event estimation over the lights of the receiver's row, all of them or N at random.
// Counterpart of src/reference/direct.rs.
#extension GL_GOOGLE_include_directive : require
#define TRACE_LAYERS
#include "prelude.glsl"
#include "random.glsl"
#include "texture.glsl"
#include "trace.glsl"
#include "surface.glsl"
#include "light_sample.glsl"
#include "light_choice.glsl"
#include "visibility.glsl"
#include "ray_counts.glsl"
#include "direct_light.glsl"
#include "strata.glsl"
#include "gbuffer.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

void main() {
    begin_counting();
    uvec2 pixel = gl_GlobalInvocationID.xy;
    uvec2 counts = uvec2(0);
    drawn_index = sample_index;
    drawn_least = FC.least_candidates;
    if (all(lessThan(pixel, FC.size))) {
        ivec2 p = ivec2(pixel);
        vec4 albedo = imageLoad(gbuffer_albedo, p);
        vec3 irradiance = vec3(0.0);
        Stratum kept;
        kept.row = NONE;
        kept.light = NONE;
        if (albedo.a > 0.0 && albedo.rgb != vec3(0.0)) {
            uvec4 surface = imageLoad(gbuffer_surface, p);
            SurfaceHit at;
            at.position = imageLoad(gbuffer_position, p).xyz;
            at.shading_normal = unpack_normal(surface.x);
            at.geometric_normal = unpack_normal(surface.y);
            at.material = surface.z;
            at.row = surface.w;
            kept.position = at.position;
            kept.shading_normal = surface.x;
            kept.geometric_normal = surface.y;
            kept.row = at.row;
            irradiance = FC.illumination == 0 ? vec3(1.0) : direct_light(at, pixel.x + (pixel.y << 16), counts);
        }
        imageStore(image_direct, p, vec4(irradiance, 0.0));
        if (stands_for_stratum(pixel)) keep_stratum(pixel, kept, irradiance);
    }
    end_counting(counts);
}
