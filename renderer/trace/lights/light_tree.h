// Selecting one of many lights by what each may bring to a point: a bounding-volume hierarchy over the lights whose
// nodes bound position, directions of emission and intensity (Conty Estevez and Kulla 2018, "Importance Sampling of
// Many Lights with Adaptive Tree Splitting"; one light is drawn, so nothing is split).
//
// Nodes have eight children side by side, whose importances are computed together: the way to one of 10,000 lights
// passes five nodes. A node's importance is 0 only where, by bounds, no light below it can reach the point.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "renderer/base/math.h"
#include "renderer/trace/lights/light_bounds.h"

namespace helio {

struct LightTreeNode;  // light_tree_build.h

class LightTree {
 public:
  LightTree() = default;
  explicit LightTree(std::span<const LightBounds> lights);

  struct Choice {
    std::uint32_t light = 0;
    float probability = 0;  // 0: no light of the tree reaches the point
  };
  // `normal` is unit, or zero when both sides matter. u in [0, 1). Precondition: not empty.
  Choice select(const V3f& point, const V3f& normal, float u) const;
  struct Query {
    V3f point, normal;
    float u = 0;
  };
  // Selects for each query, into choices[i], level by level: the nodes that one needs next are fetched while others
  // choose. At most kMostQueries.
  void select(std::span<const Query> queries, Choice* choices) const;
  // Probability with which select() returns `light`, up to rounding.
  float probability(const V3f& point, const V3f& normal, std::uint32_t light) const;

  bool empty() const { return nodes_.empty(); }
  std::size_t memory_bytes() const;

  static constexpr std::size_t kMostQueries = 64;
  static constexpr int kWidth = 8;
  static constexpr std::uint32_t kLeaf = std::uint32_t(1) << 31;

  struct alignas(64) Node {
    float center_x[kWidth] = {}, center_y[kWidth] = {}, center_z[kWidth] = {}, radius[kWidth] = {};
    float axis_x[kWidth] = {}, axis_y[kWidth] = {}, axis_z[kWidth] = {};
    float cos_theta_o[kWidth] = {};  // -1 for all directions
    float sin_theta_o[kWidth] = {};  // 0 for all directions
    float cos_theta_e[kWidth] = {};
    float one_sided[kWidth] = {};  // 2; 0 when the child emits about -axis as well
    float intensity[kWidth] = {};  // share of the whole tree's; 0: no child here
    float range[kWidth] = {};
    float spread[kWidth] = {};  // added to the squared distance to the centre
    std::uint32_t child[kWidth] = {};  // a node, or kLeaf | light
  };

  std::span<const Node> nodes() const { return nodes_; }                      // the root first
  std::span<const std::uint32_t> node_places() const { return node_place_; }  // by node: parent * kWidth + slot
  std::span<const std::uint32_t> places() const { return place_; }            // by light: node * kWidth + slot

 private:
  void collapse(std::span<const LightTreeNode> binary, std::uint32_t from, std::uint32_t place, double scale);
  static void importances(const Node& node, const V3f& point, const V3f& normal, float* importance);

  std::vector<Node> nodes_;
  std::vector<std::uint32_t> node_place_;
  std::vector<std::uint32_t> place_;
};

}  // namespace helio
