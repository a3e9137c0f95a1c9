// One query of bsdf_queries.h an invocation.
#version 460
#extension GL_GOOGLE_include_directive : require

#include "base/base.glsl"

layout(local_size_x = 64) in;
layout(push_constant, scalar) uniform Push {
  uint64_t scene, queries, answers;  // no scene: 0
  uint count;
} push;

#include "bsdf/bsdf.glsl"
#include "tests/unit/vulkan/bsdf_queries.h"

layout(buffer_reference, scalar, buffer_reference_align = 8) readonly buffer Queries {
  BsdfQuery at[];
};
layout(buffer_reference, scalar, buffer_reference_align = 4) writeonly buffer Answers {
  BsdfAnswer at[];
};

void main() {
  const uint index = gl_GlobalInvocationID.x;
  if (index >= push.count) return;
  const BsdfQuery q = Queries(push.queries).at[index];
  const SurfaceParams params = SurfaceParams(q.model, q.transmission, q.mapped != 0, q.map_normal, q.map_alpha2,
                                             q.weight, q.first, q.second);
  const BsdfValue value = evaluate_bsdf(params, q.wo, q.wi);
  const BsdfSample chosen = sample_bsdf(params, q.wo, q.u_lobe, q.u);
  Answers(push.answers).at[index] =
      BsdfAnswer(value.f_cos, value.pdf_w, chosen.wi, chosen.weight, chosen.pdf_w, chosen.eta, uint(chosen.delta),
                 uint(chosen.transmitted), surface_albedo(params, q.wo), uint(is_pure_delta(params)));
}
