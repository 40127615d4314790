// Volumes of fog. Counterpart of src/scene/fog.rs.
#ifndef FOG_GLSL
#define FOG_GLSL

// Radiance of the fog on the first t of a ray (unit direction); a: the share of what is behind that is left.
vec4 fog_at(vec3 origin, vec3 direction, float t) {
    vec4 r = vec4(0.0, 0.0, 0.0, 1.0);
    [[dont_unroll]] for (uint i = 0; i < FC.fog_count; i++) {
        Fog fog = FC.fogs.at[i];
        float enter = 0.0, leave = t;
        [[dont_unroll]] for (uint k = fog.first_plane; k < fog.first_plane + fog.plane_count; k++) {
            vec4 plane = FC.fog_planes.at[k];
            float outside = dot(plane.xyz, origin) - plane.w;
            float approach = dot(plane.xyz, direction);
            if (approach < 0.0) enter = max(enter, -outside / approach);
            else if (approach > 0.0) leave = min(leave, -outside / approach);
            else if (outside > 0.0) leave = -RAY_FAR;
        }
        float hides = sqrt(min(max(leave - enter, 0.0) * fog.density, 1.0));
        r.rgb += fog.colour * (r.a * hides);
        r.a *= 1.0 - hides;
    }
    return r;
}

#endif
