// One query of light_queries.h an invocation.
#version 460
#extension GL_GOOGLE_include_directive : require

#include "base/base.glsl"

layout(local_size_x = 64) in;
layout(push_constant, scalar) uniform Push {
  uint64_t scene, queries, answers;
  uint count;
} push;

#include "scene/scene.glsl"

#include "lights/light_sampler.glsl"
#include "tests/unit/vulkan/light_queries.h"

layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer Queries {
  LightQuery at[];
};
layout(buffer_reference, scalar, buffer_reference_align = 4) writeonly buffer Answers {
  LightAnswer at[];
};

void main() {
  const uint index = gl_GlobalInvocationID.x;
  if (index >= push.count) return;
  const LightQuery q = Queries(push.queries).at[index];
  const LightSample s = sample_light(q.point, q.normal, q.u_select, q.u);
  LightAnswer a;
  a.direction = s.direction;
  a.distance = s.distance;
  a.radiance = s.radiance;
  a.pdf_w = s.pdf_w;
  a.delta = s.delta ? 1 : 0;
  a.cos_light = s.cos_light;
  a.light = s.light;
  a.pdf_w_area = 0;
  a.emitted = vec3(0);
  if (q.emitter != kNone) {
    a.pdf_w_area = light_pdf_w_area(q.point, q.normal, q.direction, q.emitter, q.distance, q.cos_light);
    a.emitted = emitted(q.emitter, q.uv, q.cos_light);
  }
  a.pdf_w_environment = light_pdf_w_environment(q.point, q.normal, q.direction);
  a.environment = environment_radiance(q.direction);
  Answers(push.answers).at[index] = a;
}
