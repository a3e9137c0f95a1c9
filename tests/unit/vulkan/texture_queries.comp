// One lookup a query of texture_queries.h and invocation.
#version 460
#extension GL_GOOGLE_include_directive : require

#include "base/base.glsl"

layout(local_size_x = 64) in;
layout(push_constant, scalar) uniform Push {
  uint64_t scene, queries, answers;
  uint count;
} push;

#include "scene/scene.glsl"

#include "scene/textures.glsl"
#include "tests/unit/vulkan/texture_queries.h"

layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer Queries {
  TextureQuery at[];
};
layout(buffer_reference, scalar, buffer_reference_align = 4) writeonly buffer Answers {
  vec4 at[];
};

void main() {
  const uint index = gl_GlobalInvocationID.x;
  if (index >= push.count) return;
  const TextureQuery q = Queries(push.queries).at[index];
  Answers(push.answers).at[index] = texture_lookup(q.slot, q.uv);
}
