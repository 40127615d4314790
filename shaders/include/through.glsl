// What rays that go through layers share.
#ifndef THROUGH_GLSL
#define THROUGH_GLSL

// Surfaces that a ray goes through at most; what is behind is too faint to matter long before.
const uint MOST_LAYERS = 1024;
// Layers nearer to a receiver than this many units lie on it: they don't tint its light, only what is seen of it.
const float ON_RECEIVER = 1.0;

#endif
