// Skies: boxes of pictures and domes of clouds, infinitely far away. Counterpart of part of src/reference/surface.rs.
#ifndef SKY_GLSL
#define SKY_GLSL

uint sky_box_side(vec3 d, out vec2 uv, out float across) {
    vec3 a = abs(d);
    uint side;
    vec2 st;
    float m;
    if (a.z >= a.x && a.z >= a.y) {
        m = a.z;
        if (d.z > 0.0) { side = 4; st = vec2(-d.y, d.x); } else { side = 5; st = vec2(-d.y, -d.x); }
    } else if (a.x >= a.y) {
        m = a.x;
        if (d.x > 0.0) { side = 0; st = vec2(-d.y, -d.z); } else { side = 1; st = vec2(d.y, -d.z); }
    } else {
        m = a.y;
        if (d.y > 0.0) { side = 2; st = vec2(d.x, -d.z); } else { side = 3; st = vec2(-d.x, -d.z); }
    }
    uv = st / m * 0.5 + 0.5;
    across = m / length(d);
    return side;
}

// Level of detail over directions, of the eye's rays.
float sky_lod(float cone) {
    return cone > 0.0 ? log2(cone) : FULL_RESOLUTION;
}

// `lod`: over directions.
vec3 sky_box(Material material, vec3 direction, float lod) {
    vec2 uv;
    float across;
    uint side = sky_box_side(direction, uv, across);
    // The image, as wide as two, stands at distance 1: a cone is as wide as it is far, and stretched where it meets it aslant.
    lod = lod_of(material.sky[side], lod - 1.0 - 2.0 * log2(across));
    return sample_texture(material.sky[side], uv, lod, true).rgb;
}

// Radiance of a sky, as it lights: clouds stand for their mean.
vec3 sky_radiance(Material material, vec3 direction) {
    bool box_alone = (material.flags & (MATERIAL_SKY_BOX | MATERIAL_STAGES)) == MATERIAL_SKY_BOX;
    return box_alone ? material.emission * sky_box(material, direction, FULL_RESOLUTION) : material.emission;
}

// How far away clouds are where stages ask for a place, units.
const float CLOUD_DISTANCE = 4096.0;

// Texture coordinates of clouds: the layer is a dome, below the horizon there is none.
vec2 clouds_at(Material material, vec3 d) {
    return cloud_coordinates(vec3(d.xy, max(d.z, 0.0)), material.cloud_height);
}

// What a sky's stages look at in a direction (unit).
Point cloud_point(Material material, vec3 d, float cone) {
    vec2 uv = clouds_at(material, d);
    float lod = FULL_RESOLUTION;
    if (cone > 0.0) {
        // Along the horizon and across it; at the zenith, any two.
        float flat_length = length(d.xy);
        vec3 along = flat_length > 0.0 ? vec3(-d.y, d.x, 0.0) / flat_length : vec3(1.0, 0.0, 0.0);
        vec3 up = cross(d, along);
        float longest = max(length(clouds_at(material, normalize(d + along * cone)) - uv),
                            length(clouds_at(material, normalize(d + up * cone)) - uv));
        lod = log2(max(longest, LEAST));
    }
    Point p = point_on_texture(uv, lod, d * CLOUD_DISTANCE, -d);
    p.distance = CLOUD_DISTANCE;
    return p;
}

#ifdef WHOLE_PIXELS
// Whether what the path meets now is seen in the pixel's own direction, and a sky there is to be shown as it is on average over
// the pixel. A sky costs little to look at more than once, and needs no history then: nothing else tells how bright a star is
// that is as small as a pixel and moves.
bool whole_pixel = false;
uvec2 own_pixel;
// A sun's disc was met, whose edge this is not enough for.
bool met_sun = false;

// Direction that a sky's clouds are looked at in.
vec3 sky_direction(vec3 direction) {
    return whole_pixel ? direction_through(vec2(own_pixel) + 0.5) : direction;
}

vec3 sky_box_seen(Material material, vec3 direction, float lod) {
    if (!whole_pixel) return sky_box(material, direction, lod);
    vec3 sum = vec3(0.0);
    [[dont_unroll]] for (uint i = 0; i < 4; i++) {
        vec2 place = vec2(own_pixel) + 0.25 + 0.5 * vec2(i & 1, i >> 1);
        sum += 0.25 * sky_box(material, direction_through(place), lod);
    }
    return sum;
}
#else
vec3 sky_direction(vec3 direction) {
    return direction;
}

vec3 sky_box_seen(Material material, vec3 direction, float lod) {
    return sky_box(material, direction, lod);
}
#endif

// Radiance of a sky as it is seen, with what its stages come to.
vec3 sky_seen(Material material, vec3 direction, float cone, Shade clouds) {
    bool has_box = (material.flags & MATERIAL_SKY_BOX) != 0;
    if (!has_box && (material.flags & MATERIAL_STAGES) == 0) {
        return FC.shown_emission == 0 ? material.shown : material.emission;
    }
    vec3 picture = has_box ? sky_box_seen(material, direction, sky_lod(cone)) : vec3(0.0);
    picture = clouds.albedo + clouds.glow / UNLIT + clouds.through * picture;
    return picture * (FC.shown_emission == 0 ? material.shown : material.sky_scale);
}

#endif
