#version 460
// Primary stage: camera rays to the G-buffer.
#extension GL_GOOGLE_include_directive : require
#define TRACE_LAYERS
#define NOTES_INTERFACE
#define WHOLE_PIXELS
#include "prelude.glsl"
#include "random.glsl"
#include "texture.glsl"
#include "trace.glsl"
#include "camera.glsl"
#include "surface.glsl"
#include "gbuffer.glsl"
#include "guide.glsl"
#include "layers.glsl"
#include "moved.glsl"
#include "secondary_tiles.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

// Distance of what is seen where nothing is met, units.
const float FAR_AWAY = 1e9;

// Pixels of the work group of which something branches off, and the first one's place among all.
shared uint group_pixels;
shared uint group_first;

// Whether a pixel of the work group shows a surface that something branches off at, or may.
shared uint group_interfaces;

// Lists a pixel for the secondary stage. To be called by every thread of the group.
void list_pixel(uvec2 pixel, bool branches) {
    if (gl_LocalInvocationIndex == 0) {
        group_pixels = 0;
        group_interfaces = 0;
    }
    barrier();
    uint place = branches ? atomicAdd(group_pixels, 1) : 0;
    if (interface_guide != uvec4(0)) group_interfaces = 1;
    barrier();
    if (gl_LocalInvocationIndex == 0) FC.secondary_pixels.at[tile_place(ivec2(gl_WorkGroupID.xy))] = group_interfaces;
    if (gl_LocalInvocationIndex == 0 && group_pixels != 0) {
        group_first = atomicAdd(FC.secondary_pixels.count, group_pixels);
        atomicMax(FC.secondary_pixels.groups[0], (group_first + group_pixels + 63) / 64);
    }
    barrier();
    if (branches) FC.secondary_pixels.at[group_first + place] = pixel.x + (pixel.y << 16);
}

// True where something branches off.
bool shoot(uvec2 pixel) {
    ivec2 p = ivec2(pixel);
    vec3 origin, direction;
    camera_ray(pixel, sample_index, origin, direction);
    own_pixel = pixel;
    // Where frames are blended; what stands still is the mean of single samples, as it is where they are accumulated.
    whole_pixel = FC.jitter.x >= 0.0 && FC.antialiasing != 0 && FC.still == 0 && FC.aperture <= 0.0;
    Seen seen = see(Path(origin, direction, vec3(1.0), 0.0, 0, pixel.x + (pixel.y << 16), -1.0, 0, 0));
    bool branches = branch_count != 0;
    if (FC.branches_off != 0) {
        imageStore(image_secondary, p, vec4(0.0));
        imageStore(secondary_guide, p, interface_guide);
    }
    Hit hit = seen.hit;
    // A miss is black. Where a layer was passed by chance, others show it: their mean is left to history.
    bool sky = hit.triangle == NONE || (FC.materials.at[seen.surface.material].flags & MATERIAL_SKY) != 0;
    bool complete = sky && whole_pixel && !met_sun && !branches && seen.layers == vec3(0.0)
        && seen.share == vec3(1.0);
    imageStore(gbuffer_view, p, vec4(direction, 0.0));
    imageStore(image_layers, p, vec4(seen.layers, 0.0));
    imageStore(image_share, p, vec4(seen.share, 0.0));
    if (hit.triangle == NONE) {
        imageStore(gbuffer_albedo, p, vec4(0.0));
        imageStore(gbuffer_position, p, vec4(0.0));
        imageStore(gbuffer_surface, p, uvec4(0, 0, NONE, NONE));
        imageStore(gbuffer_object, p, uvec4(NONE, NONE, 0, NONE));
        imageStore(image_emission, p, vec4(0.0));
        imageStore(gbuffer_motion, p, vec4(motion_of_direction(direction), complete ? 0.0 : FAR_AWAY, 0.0));
        imageStore(guide, p, uvec4(0));
        return branches;
    }
    SurfaceHit s = seen.surface;
    imageStore(gbuffer_albedo, p, vec4(s.albedo, 1.0));
    imageStore(gbuffer_position, p, vec4(s.position, seen.distance));
    imageStore(gbuffer_surface, p, uvec4(pack_normal(s.shading_normal), pack_normal(s.geometric_normal), s.material, s.row));
    imageStore(gbuffer_object, p, uvec4(hit.triangle, hit.instance, packUnorm2x16(hit.barycentrics), s.cluster));
    imageStore(image_emission, p, vec4(seen.emission, 0.0));
    // A sky's picture is infinitely far away, wherever the surface that shows it is.
    // Seen in a mirror, a surface moves as its image behind the mirror does.
    vec3 place = mapped(seen.place, s.position, 1.0);
    vec3 normal = mapped(seen.place, s.shading_normal, 0.0);
    vec2 motion = sky ? motion_of_direction(direction) : motion_of(place);
    vec3 old_position = place;
    Instance instance = FC.instances.at[hit.instance];
    if (instance.moves != 0 || deforms(hit.triangle)) {
        old_position = mapped(seen.place, old_position_of(instance, hit), 1.0);
        motion = motion_between(place - FC.eye, old_position - FC.old_eye);
    }
    imageStore(gbuffer_motion, p, vec4(motion, complete ? 0.0 : seen.distance, dot(old_position - FC.old_eye, FC.old_forward)));
    float depth = s.albedo == vec3(0.0) ? 0.0 : dot(place - FC.eye, FC.forward);
    imageStore(guide, p, pack_guide(depth, to_view(normal), s.material, hit.instance));
    return branches;
}

void main() {
    uvec2 pixel = gl_GlobalInvocationID.xy;
    bool branches = all(lessThan(pixel, FC.size)) && shoot(pixel);
    if (FC.branches_off != 0) list_pixel(pixel, branches);
}
