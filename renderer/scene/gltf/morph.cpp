#include "renderer/scene/gltf/morph.h"

namespace helio::gltf {

namespace {

// base += weight * displacement for the first components of each element.
template <class Base, class Delta>
bool add(int accessor, float weight, AccessorReader& reader, std::vector<Base>& base) {
  constexpr std::size_t kBase = sizeof(Base) / sizeof(float), kDelta = sizeof(Delta) / sizeof(float);
  std::vector<Delta> delta;
  if (!reader.read(accessor, delta)) return false;
  float* out = reinterpret_cast<float*>(base.data());
  const float* in = reinterpret_cast<const float*>(delta.data());
  for (std::size_t i = 0; i < std::min(base.size(), delta.size()); ++i) {
    for (std::size_t c = 0; c < std::min(kBase, kDelta); ++c) out[i * kBase + c] += weight * in[i * kDelta + c];
  }
  reader.budget().release(delta.size() * sizeof(Delta));
  return true;
}

}  // namespace

bool apply_morph_targets(const Primitive& primitive, std::span<const float> weights, AccessorReader& reader,
                         TriangleMesh& mesh) {
  for (std::size_t t = 0; t < std::min(weights.size(), primitive.targets.size()); ++t) {
    if (weights[t] == 0) continue;
    for (const Attribute& attribute : primitive.targets[t]) {
      bool ok = true;
      const std::string& semantic = attribute.semantic;
      if (semantic == "POSITION")
        ok = add<V3f, V3f>(attribute.accessor, weights[t], reader, mesh.positions);
      else if (semantic == "NORMAL")
        ok = add<V3f, V3f>(attribute.accessor, weights[t], reader, mesh.normals);
      else if (semantic == "TANGENT")
        ok = add<V4f, V3f>(attribute.accessor, weights[t], reader, mesh.tangents);
      else if (semantic == "COLOR_0")
        ok = reader[attribute.accessor].type == ElementType::vec4
                 ? add<V4f, V4f>(attribute.accessor, weights[t], reader, mesh.colors)
                 : add<V4f, V3f>(attribute.accessor, weights[t], reader, mesh.colors);
      else
        for (int k = 0; k < kMaxTexcoordSets; ++k)
          if (semantic == "TEXCOORD_" + std::to_string(k))
            ok = add<V2f, V2f>(attribute.accessor, weights[t], reader, mesh.texcoords[std::size_t(k)]);
      if (!ok) return false;
    }
  }
  return true;
}

}  // namespace helio::gltf
