// Extensions of every pass.
#extension GL_EXT_buffer_reference : require
#extension GL_EXT_buffer_reference2 : require
#extension GL_EXT_scalar_block_layout : require
#extension GL_EXT_nonuniform_qualifier : require
#extension GL_EXT_control_flow_attributes : require
#ifdef TRACE_RAYQUERY
#extension GL_EXT_ray_query : require
#endif
#include "scene.glsl"
