// Rays in the device's acceleration structures: intersect() and occluded() for raygen shaders. Include after the block
// of push constants (scene.glsl). The hit and miss shaders are triangle.*, sphere.* and nothing.rmiss.
#ifndef TRACE_RT_GLSL
#define TRACE_RT_GLSL

#include "scene/geometry.glsl"
#include "accel/ray_payload.glsl"
#include "accel/ray_range.glsl"

layout(location = 0) rayPayloadEXT RayPayload payload;

void trace(Ray ray, uint flags) {
  payload.alpha_key = ray.alpha_key;
  traceRayEXT(accelerationStructureEXT(scene.geometry.top_level), flags, 0xffu, 0, 0, 0, ray.origin, 0.0, ray.direction,
              ray.t_max, 0);
}

// The closest hit, as Accel::intersect().
Hit intersect(Ray ray) {
  if (scene.geometry.top_level == 0 || !is_traceable(ray, scene.geometry.ray_limit)) return no_hit(ray.t_max);
  trace(ray, gl_RayFlagsNoneEXT);
  if (payload.hit.part == kNone) return no_hit(ray.t_max);
  return payload.hit;
}

// Whether something lies on the ray before its t_max, as Accel::occluded().
bool occluded(Ray ray) {
  if (!is_traceable(ray, scene.geometry.ray_limit)) return true;
  if (scene.geometry.top_level == 0) return false;
  payload.hit.part = 0;  // stays where the ray meets anything, for no closest-hit shader runs
  trace(ray, gl_RayFlagsTerminateOnFirstHitEXT | gl_RayFlagsSkipClosestHitShaderEXT);
  return payload.hit.part != kNone;
}

#endif
