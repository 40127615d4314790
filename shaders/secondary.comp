#version 460
// Secondary stage: what branches off at glass, water and glossy surfaces, followed to its ends and lit there. It runs for the
// pixels that the primary stage has listed and launches nothing where there are none.
//
// The eye ray is followed once more, this time with its branches put on a stack; its own end is left to the stages that
// shade the G-buffer. Counterpart of `CpuRenderer::radiance` in src/reference/renderer.rs.
#extension GL_GOOGLE_include_directive : require
#define TRACE_LAYERS
#define FOLLOWS_BRANCHES
#define LIGHTS_LOBES
#include "prelude.glsl"
#include "random.glsl"
#include "texture.glsl"
#include "trace.glsl"
#include "surface.glsl"
#include "light_sample.glsl"
#include "light_choice.glsl"
#include "visibility.glsl"
#include "camera.glsl"
#include "layers.glsl"
#include "ray_counts.glsl"
#include "direct_light.glsl"
#include "ambient.glsl"
#include "gbuffer.glsl"

layout(local_size_x = 64) in;

// How far away a sky is, units.
const float SKY = 1e6;

// Radiance of all that branches off the eye ray of a pixel, and how long the way of the brightest branch is.
vec4 branches_of(uvec2 pixel, inout uvec2 counts) {
    vec3 radiance = vec3(0.0);
    Path path;
    path.share = vec3(1.0);
    path.travelled = 0.0;
    path.depth = 0;
    path.address = pixel.x + (pixel.y << 16);
    path.pdf = -1.0;
    path.row = 0;
    path.place = 0;
    camera_ray(pixel, sample_index, path.origin, path.direction);
    bool eye = true;
    float most = 0.0;
    float way = 0.0;
    [[dont_unroll]] while (true) {
        float before = path.travelled;
        float share = luminance(path.share);
        Seen seen = see(path);
        if (!eye && share > most) {
            most = share;
            bool sky = seen.hit.triangle == NONE || (FC.materials.at[seen.surface.material].flags & MATERIAL_SKY) != 0;
            way = sky ? SKY : max(seen.distance - before, 1e-3);
        }
        if (!eye) radiance += seen.layers + seen.share * seen.emission;
        bool diffuse = !eye && seen.hit.triangle != NONE && seen.surface.albedo != vec3(0.0);
        if (diffuse || seen.glossy) {
            SurfaceHit s = seen.surface;
            light_lobe = Lobe(vec3(0.0), vec3(0.0), 0.0);
            if (seen.glossy) light_lobe = lobe_of(FC.materials.at[s.material], s, seen.direction);
            lobe_alone = !diffuse;
            vec3 irradiance = direct_light(s, path.address, counts);
            if (diffuse) {
                if (FC.ambient != AMBIENT_OFF) irradiance += ambient_at(s.position, s.shading_normal);
                radiance += seen.share * s.albedo * irradiance;
            }
            radiance += seen.share * s.specular * lobe_light;
        }
        if (branch_top == 0) break;
        path = branch_stack[--branch_top];
        eye = false;
    }
    return vec4(radiance, way);
}

void main() {
    begin_counting();
    drawn_index = sample_index;
    drawn_least = FC.least_candidates;
    uvec2 counts = uvec2(0);
    uint i = gl_GlobalInvocationID.x;
    if (i < FC.secondary_pixels.count) {
        uint address = FC.secondary_pixels.at[i];
        uvec2 pixel = uvec2(address & 0xffffu, address >> 16);
        vec4 radiance = branches_of(pixel, counts);
        // A value that is not finite would stay in every history it enters.
        if (any(isnan(radiance)) || any(isinf(radiance))) radiance = vec4(0.0);
        imageStore(image_secondary, ivec2(pixel), radiance);
    }
    end_counting(counts);
}
