// Binary trees of boxes, for tracers other than Embree's own; Embree builds them.
#pragma once

#include <cstdint>
#include <limits>
#include <vector>

#include "renderer/base/cancel.h"
#include "renderer/base/math.h"
#include "renderer/base/result.h"

namespace helio {

// The box of a primitive. Finite, lower <= upper.
struct alignas(32) BvhPrimitive {
  V3f lower;
  std::uint32_t unused = 0;
  V3f upper;
  std::uint32_t number = 0;  // the caller's
};

struct BinaryBvh {
  struct Child {
    Box3f box;                // of all primitives below
    std::uint32_t first = 0;  // of a leaf: into `order`; of an inner node: into `nodes`
    std::uint32_t count = 0;  // primitives of a leaf; 0: an inner node
  };
  struct Node {
    Child children[2];
  };
  std::vector<Node> nodes;           // parents before their children; nodes below `root` alone
  std::vector<std::uint32_t> order;  // numbers of the primitives, leaf by leaf
  Child root;                        // an empty box for no primitives
  std::uint32_t depth = 0;           // nodes on the longest way from the root to a leaf
};

inline constexpr std::uint32_t kMostBvhPrimitives = 1u << 30;

struct BvhBuildOptions {
  std::uint32_t leaf_size = 4;   // the most primitives of a leaf, [1, 32]
  std::uint32_t max_depth = 48;  // of the tree; halving the primitives until they fit a leaf must take fewer levels
  float intersection_cost = 1;   // of a primitive, in visits of a node (surface area heuristic)
  int threads = 0;               // at most so many; 0: all
  const CancelToken* cancel = nullptr;
};

// By the surface area heuristic, in bins; where that would be deeper than max_depth, by halves of equal number. Errors:
// resource_exhausted (memory, more than kMostBvhPrimitives, more than max_depth allows), cancelled.
Result<BinaryBvh> build_binary_bvh(const std::vector<BvhPrimitive>& primitives, const BvhBuildOptions& options = {});

}  // namespace helio
