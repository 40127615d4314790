#version 460
// Copies texels of one of many textures to a storage image.
#extension GL_EXT_nonuniform_qualifier : require

layout(local_size_x = 8, local_size_y = 8) in;
layout(set = 0, binding = 0, rgba32f) uniform writeonly image2D target;
layout(set = 0, binding = 1) uniform sampler2D textures[];
layout(push_constant) uniform Push { uint texture_index; float lod; };

void main() {
    ivec2 size = imageSize(target);
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(pixel, size))) return;
    vec2 uv = (vec2(pixel) + 0.5) / vec2(size);
    imageStore(target, pixel, textureLod(textures[nonuniformEXT(texture_index)], uv, lod));
}
