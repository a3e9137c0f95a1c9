#version 460
// The ray meets nothing.
#extension GL_EXT_ray_tracing : require
#extension GL_GOOGLE_include_directive : require

#include "accel/ray_payload.glsl"

layout(location = 0) rayPayloadInEXT RayPayload payload;

void main() {
  payload.hit.part = kNone;
}
