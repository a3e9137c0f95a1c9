// For hit shaders: which part of which instance was hit, and the push constants that all of them see.
#ifndef HIT_PART_GLSL
#define HIT_PART_GLSL

#include "base/base.glsl"

layout(push_constant, scalar) uniform Push {
  uint64_t scene;
} push;

#include "scene/geometry.glsl"
#include "accel/ray_payload.glsl"

layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer RayInstances {
  RayInstanceTable at[];
};

uint hit_instance() {
  return RayInstances(scene.geometry.ray_instances).at[gl_InstanceID].instance;
}
// The part that was hit, numbered as in Hit.
uint hit_part() {
  const uint first = RayInstances(scene.geometry.ray_instances).at[gl_InstanceID].first_part;
  return Uints(scene.geometry.ray_parts).at[first + gl_GeometryIndexEXT];
}

#endif
