// Triangle strips and fans to triangle lists (glTF 2.0, 3.7.2.1).
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "renderer/scene/gltf/document/document.h"

namespace helio::gltf {

inline bool has_triangles(Topology topology) {
  return topology >= Topology::triangles;
}

// Number of whole triangles in `count` vertices or indices.
std::uint64_t triangle_count(Topology topology, std::uint64_t count);

// Three indices per triangle, counter-clockwise as the topology means them. Triangles of a strip that repeat an index
// only join its parts and are dropped. Preconditions: has_triangles(topology), not a list.
std::vector<std::uint32_t> to_triangle_list(Topology topology, std::span<const std::uint32_t> indices);

}  // namespace helio::gltf
