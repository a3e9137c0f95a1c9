// Builds the binary hierarchy that LightTree is made from.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "renderer/trace/lights/light_bounds.h"

namespace helio {

struct LightTreeNode {
  LightBounds bounds;
  double cost = 0;                      // cluster_cost(bounds)
  std::uint32_t first = 0, second = 0;  // children, by index; equal for leaves
  std::uint32_t light = 0;              // of a leaf
  std::uint32_t lights = 0;             // below it, itself included

  bool leaf() const { return first == second; }
};

// Top-down by binned surface area orientation heuristic. The root is node 0; every light has one leaf. Depth is at
// most kMaxHeuristicDepth + log2(lights) whatever the input. Precondition: not empty, fewer than 2^28 lights.
inline constexpr int kMaxHeuristicDepth = 40;
std::vector<LightTreeNode> build_light_hierarchy(std::span<const LightBounds> lights);

}  // namespace helio
