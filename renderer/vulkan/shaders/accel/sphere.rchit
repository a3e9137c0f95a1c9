#version 460
// The closest hit of a ray is on a sphere.
#extension GL_EXT_ray_tracing : require
#extension GL_GOOGLE_include_directive : require

#include "accel/hit_part.glsl"

#include "accel/sphere_hit.glsl"

layout(location = 0) rayPayloadInEXT RayPayload payload;

void main() {
  const uint number = hit_part(), instance = hit_instance();
  const PartTable part = part_at(part_index(number, instance));
  // The normal is computed anew, because hit attributes may be wrong (triangle.rchit).
  const vec3 direction = gl_ObjectRayDirectionEXT;
  const SphereHit hit = meet_sphere(gl_ObjectRayOriginEXT, direction, part.center, part.radius);
  const vec3 normal = sphere_normal(hit, direction, gl_HitTEXT < hit.middle);
  payload.hit = Hit(gl_HitTEXT, 0, 0, normal, number, 0, instance);
}
