// Counts of shadow rays traced and skipped, summed per work group before they are added to the frame's.
#ifndef RAY_COUNTS_GLSL
#define RAY_COUNTS_GLSL

shared uint shadow_rays;
shared uint shadow_skipped;

// Adds to a 64-bit counter made of two words.
void count(uint counter, uint amount) {
    uint before = atomicAdd(FC.counters.at[counter * 2], amount);
    if (before + amount < before) atomicAdd(FC.counters.at[counter * 2 + 1], 1);
}

// To be called by every thread of the group.
void begin_counting() {
    if (gl_LocalInvocationIndex == 0) {
        shadow_rays = 0;
        shadow_skipped = 0;
    }
    barrier();
}

// To be called by every thread of the group. `counts`: its rays traced, and skipped.
void end_counting(uvec2 counts) {
    if (counts.x != 0) atomicAdd(shadow_rays, counts.x);
    if (counts.y != 0) atomicAdd(shadow_skipped, counts.y);
    barrier();
    if (gl_LocalInvocationIndex == 0) {
        if (shadow_rays != 0) count(0, shadow_rays);
        if (shadow_skipped != 0) count(1, shadow_skipped);
    }
}

#endif
