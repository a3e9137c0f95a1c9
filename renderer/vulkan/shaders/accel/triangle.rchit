#version 460
// The closest hit of a ray is on a triangle.
#extension GL_EXT_ray_tracing : require
#extension GL_GOOGLE_include_directive : require

#include "accel/hit_part.glsl"

#include "accel/triangle_hit.glsl"

layout(location = 0) rayPayloadInEXT RayPayload payload;

void main() {
  const uint part = hit_part(), instance = hit_instance();
  const PartTable table = part_at(part_index(part, instance));
  const uvec3 i = corner_indices(table, gl_PrimitiveID);
  Vec3s positions = Vec3s(table.positions);
  const vec3 a = positions.at[i.x], b = positions.at[i.y], c = positions.at[i.z];
  // Barycentrics are computed anew: where an any-hit shader has rejected a hit further on, Mesa 25.0 leaves the
  // attributes of that hit here.
  const vec2 barycentric = barycentrics_of(gl_ObjectRayOriginEXT, gl_ObjectRayDirectionEXT, a, b, c);
  // The normal is made of the edges that Embree takes: the sign of a component that is 0 chooses the frame around it
  // (frame.glsl).
  const vec3 normal = cross(c - a, a - b);
  payload.hit = Hit(gl_HitTEXT, barycentric.x, barycentric.y, normal, part, gl_PrimitiveID, instance);
}
