#version 460
#extension GL_GOOGLE_include_directive : require

#include "base/base.glsl"

layout(local_size_x = 64) in;
layout(push_constant, scalar) uniform Push {
  uint64_t scene, rays, hits, occluded;
  uint count;
} push;

#include "accel/trace_bvh.glsl"
#include "tests/unit/vulkan/trace_rays.glsl"

void main() {
  trace_ray(gl_GlobalInvocationID.x);
}
