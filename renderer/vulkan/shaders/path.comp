#version 460
// Paths on our own BVH: one invocation a sample.
#extension GL_GOOGLE_include_directive : require

#include "base/base.glsl"

layout(local_size_x = 64) in;
layout(push_constant, scalar) uniform Push {
  uint64_t scene;
  uint64_t task;
} push;

#include "accel/trace_bvh.glsl"
#include "path.glsl"

void main() {
  trace_sample(gl_GlobalInvocationID.x);
}
