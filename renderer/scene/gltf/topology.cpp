#include "renderer/scene/gltf/topology.h"

namespace helio::gltf {

std::uint64_t triangle_count(Topology topology, std::uint64_t count) {
  if (topology == Topology::triangles) return count / 3;
  return count < 3 ? 0 : count - 2;
}

std::vector<std::uint32_t> to_triangle_list(Topology topology, std::span<const std::uint32_t> indices) {
  std::vector<std::uint32_t> list;
  const std::size_t triangles = triangle_count(topology, indices.size());
  list.reserve(3 * triangles);
  for (std::size_t i = 0; i < triangles; ++i) {
    std::uint32_t a, b, c;
    if (topology == Topology::triangle_fan) {
      a = indices[i + 1], b = indices[i + 2], c = indices[0];
    } else {
      // Every other triangle of a strip is turned around.
      a = indices[i], b = indices[i + 1 + i % 2], c = indices[i + 2 - i % 2];
      if (a == b || b == c || c == a) continue;
    }
    list.insert(list.end(), {a, b, c});
  }
  return list;
}

}  // namespace helio::gltf
