#version 460
// Primary stage: camera rays to the G-buffer.
#extension GL_GOOGLE_include_directive : require
#include "prelude.glsl"
#include "random.glsl"
#include "texture.glsl"
#include "trace.glsl"
#include "surface.glsl"
#include "camera.glsl"
#include "gbuffer.glsl"
#include "guide.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

void main() {
    uvec2 pixel = gl_GlobalInvocationID.xy;
    if (any(greaterThanEqual(pixel, FC.size))) return;
    ivec2 p = ivec2(pixel);
    vec3 origin, direction;
    camera_ray(pixel, sample_index, origin, direction);
    Hit hit = trace_closest(origin, direction, RAY_FAR);
    imageStore(gbuffer_view, p, vec4(direction, 0.0));
    if (hit.triangle == NONE) {
        imageStore(gbuffer_albedo, p, vec4(0.0));
        imageStore(gbuffer_position, p, vec4(0.0));
        imageStore(gbuffer_surface, p, uvec4(0, 0, NONE, NONE));
        imageStore(gbuffer_object, p, uvec4(NONE, NONE, 0, NONE));
        imageStore(image_emission, p, vec4(0.0));
        imageStore(gbuffer_motion, p, vec4(motion_of_direction(direction), 0.0, 0.0));
        imageStore(guide, p, uvec4(0));
        return;
    }
    SurfaceHit s = surface_at(hit, direction, FC.cone);
    imageStore(gbuffer_albedo, p, vec4(s.albedo, 1.0));
    imageStore(gbuffer_position, p, vec4(s.position, hit.t));
    imageStore(gbuffer_surface, p, uvec4(pack_normal(s.shading_normal), pack_normal(s.geometric_normal), s.material, s.row));
    imageStore(gbuffer_object, p, uvec4(hit.triangle, hit.instance, packUnorm2x16(hit.barycentrics), s.cluster));
    imageStore(image_emission, p, vec4(emission_seen(s, direction), 0.0));
    // A sky's picture is infinitely far away, wherever the surface that shows it is.
    bool sky = (FC.materials.at[s.material].flags & MATERIAL_SKY) != 0;
    imageStore(gbuffer_motion, p, vec4(sky ? motion_of_direction(direction) : motion_of(s.position), hit.t, 0.0));
    float depth = s.albedo == vec3(0.0) ? 0.0 : dot(s.position - FC.eye, FC.forward);
    imageStore(guide, p, pack_guide(depth, to_view(s.shading_normal), s.material, hit.instance));
}
