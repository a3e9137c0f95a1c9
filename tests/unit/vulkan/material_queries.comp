// One query of material_queries.h an invocation.
#version 460
#extension GL_GOOGLE_include_directive : require

#include "base/base.glsl"

layout(local_size_x = 64) in;
layout(push_constant, scalar) uniform Push {
  uint64_t scene, queries, answers;
  uint count;
} push;

#include "scene/scene.glsl"

#include "scene/evaluate_material.glsl"
#include "tests/unit/vulkan/material_queries.h"

layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer Queries {
  MaterialQuery at[];
};
layout(buffer_reference, scalar, buffer_reference_align = 8) writeonly buffer Answers {
  MaterialAnswer at[];
};

void main() {
  const uint index = gl_GlobalInvocationID.x;
  if (index >= push.count) return;
  const MaterialQuery q = Queries(push.queries).at[index];
  const vec3 wo = -q.ray.direction;
  Surface surface = make_surface(q.ray, q.hit);
  interpolate_normal(q.hit, wo, surface);
  const SurfaceParams params = evaluate_material(q.hit, wo, surface);
  Answers(push.answers).at[index] =
      MaterialAnswer(params.first, params.second, params.model, uint(params.mapped), params.map_normal,
                     params.map_alpha2, params.transmission, params.weight, surface.shading_normal,
                     surface_emission(q.hit, surface));
}
