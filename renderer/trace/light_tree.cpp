#include "renderer/trace/light_tree.h"

#include "renderer/trace/light_tree_build.h"

namespace helio {
namespace {

// Cosines carry rounding errors of about 3e-4 near 1 (their sines come from a square root): a light is given up only
// when it is farther out of reach than this, and one barely in reach counts as this much.
constexpr float kCosineSlack = 1e-3f;
// No light weighs less than this share of the sum: its importance must not vanish in float.
constexpr double kMinShare = 1e-14;
constexpr float kMinDistanceSquared = 1e-20f;

}  // namespace

LightTree::LightTree(std::span<const LightBounds> lights) {
  if (lights.empty()) return;
  const std::vector<LightTreeNode> binary = build_light_hierarchy(lights);
  place_.resize(lights.size());
  collapse(binary, 0, 0, 1 / binary[0].bounds.intensity);
}

// Makes the wide node for the binary subtree `from`, and those below it: the children that cost most are opened until
// there are eight, in their order in space so that strata of u stay strata of the lights.
void LightTree::collapse(std::span<const LightTreeNode> binary, std::uint32_t from, std::uint32_t place, double scale) {
  std::vector<std::uint32_t> children{from};
  while (children.size() < kWidth) {
    auto widest = children.end();
    double cost = -1;
    for (auto it = children.begin(); it != children.end(); ++it) {
      if (!binary[*it].leaf() && binary[*it].cost > cost) {
        cost = binary[*it].cost;
        widest = it;
      }
    }
    if (widest == children.end()) break;
    const LightTreeNode& opened = binary[*widest];
    *widest = opened.second;
    children.insert(widest, opened.first);
  }

  const std::uint32_t index = std::uint32_t(nodes_.size());
  nodes_.emplace_back();
  node_place_.push_back(place);
  for (std::uint32_t slot = 0; slot < children.size(); ++slot) {
    const LightTreeNode& child = binary[children[slot]];
    const LightBounds& bounds = child.bounds;
    const V3f center = bounds.box.center();
    Node& node = nodes_[index];
    node.center_x[slot] = center.x;
    node.center_y[slot] = center.y;
    node.center_z[slot] = center.z;
    node.radius[slot] = 0.5f * length(bounds.box.size()) * (1 + 1e-5f);
    node.axis_x[slot] = bounds.axis.x;
    node.axis_y[slot] = bounds.axis.y;
    node.axis_z[slot] = bounds.axis.z;
    node.cos_theta_o[slot] = bounds.theta_o >= kPi ? -2.0f : std::cos(bounds.theta_o);
    node.cos_theta_e[slot] = std::cos(bounds.theta_e);
    node.one_sided[slot] = bounds.two_sided ? 0.0f : 2.0f;
    node.intensity[slot] = float(std::max(bounds.intensity * scale, kMinShare));
    node.range[slot] = bounds.range;
    const std::uint32_t here = index * kWidth + slot;
    if (child.leaf()) {
      node.child[slot] = kLeaf | child.light;
      place_[child.light] = here;
    } else {
      node.child[slot] = std::uint32_t(nodes_.size());
      collapse(binary, children[slot], here, scale);
    }
  }
}

// Importance of each child and their sum: intensity times bounds of the emission cosine (section 4.1 of the paper; the
// cone of directions to a child is that to its bounding ball), of the cosine at the receiver, and of 1 / d^2.
float LightTree::importances(const Node& node, const V3f& point, const V3f& normal, float (&importance)[kWidth]) {
  const float least_facing = length_squared(normal) > 0 ? -1.0f : 1.0f;
  const auto cos_difference = [](float sin_a, float cos_a, float sin_b, float cos_b) {  // cos(max(0, a - b))
    return cos_a >= cos_b ? 1.0f : cos_a * cos_b + sin_a * sin_b;
  };
  for (int i = 0; i < kWidth; ++i) {
    const float dx = point.x - node.center_x[i], dy = point.y - node.center_y[i], dz = point.z - node.center_z[i];
    const float squared = std::max(dx * dx + dy * dy + dz * dz, kMinDistanceSquared);
    const float distance = std::sqrt(squared), inverse = 1.0f / distance;
    const float radius = node.radius[i];
    const float sin_b = std::min(radius * inverse, 1.0f), cos_b = std::sqrt(1.0f - sin_b * sin_b);

    const float toward = (node.axis_x[i] * dx + node.axis_y[i] * dy + node.axis_z[i] * dz) * inverse;
    const float cos_w = std::max(toward, -toward - node.one_sided[i]);
    const float sin_w = std::sqrt(std::max(1.0f - cos_w * cos_w, 0.0f));
    const float cos_o = node.cos_theta_o[i];
    const float sin_o = std::sqrt(std::max(1.0f - cos_o * cos_o, 0.0f));
    const float cos_x = cos_difference(sin_w, cos_w, sin_o, cos_o);
    const float sin_x = cos_w >= cos_o ? 0.0f : sin_w * cos_o - cos_w * sin_o;
    const float cos_emission = cos_difference(sin_x, cos_x, sin_b, cos_b);

    const float cos_i = -(normal.x * dx + normal.y * dy + normal.z * dz) * inverse;
    const float sin_i = std::sqrt(std::max(1.0f - cos_i * cos_i, 0.0f));
    const float cos_receiver = std::max(cos_difference(sin_i, cos_i, sin_b, cos_b), least_facing);

    float value = node.intensity[i] * std::max(cos_emission, kCosineSlack) * std::max(cos_receiver, kCosineSlack) /
                  std::max(squared, radius * radius);
    const bool inside = squared <= radius * radius;
    const bool reached = cos_emission > node.cos_theta_e[i] - kCosineSlack && cos_receiver > -kCosineSlack;
    value = (inside || reached) ? value : 0.0f;
    importance[i] = distance - radius <= node.range[i] * 1.0001f ? value : 0.0f;
  }
  float sum = 0;
  for (const float value : importance) sum += value;
  return sum;
}

LightTree::Choice LightTree::select(const V3f& point, const V3f& normal, float u) const {
  Choice choice{0, 1.0f};
  std::uint32_t at = 0;
  while (true) {
    const Node& node = nodes_[at];
    alignas(32) float importance[kWidth];
    const float sum = importances(node, point, normal, importance);
    if (!(sum > 0)) return {};
    const float target = u * sum;
    float below = 0;
    int chosen = -1;
    float before = 0;
    for (int i = 0; i < kWidth; ++i) {
      if (importance[i] > 0 && (chosen < 0 || target >= below)) {
        chosen = i;
        before = below;
      }
      below += importance[i];
    }
    choice.probability *= importance[chosen] / sum;
    if (node.child[chosen] & kLeaf) {
      choice.light = node.child[chosen] & ~kLeaf;
      return choice;
    }
    u = std::clamp((target - before) / importance[chosen], 0.0f, kOneMinusEpsilon);
    at = node.child[chosen];
  }
}

float LightTree::probability(const V3f& point, const V3f& normal, std::uint32_t light) const {
  float probability = 1;
  std::uint32_t place = place_[light];
  while (true) {
    const std::uint32_t at = place / kWidth;
    alignas(32) float importance[kWidth];
    const float sum = importances(nodes_[at], point, normal, importance);
    if (!(sum > 0)) return 0;
    probability *= importance[place % kWidth] / sum;
    if (at == 0) return probability;
    place = node_place_[at];
  }
}

std::size_t LightTree::memory_bytes() const {
  return nodes_.capacity() * sizeof(Node) + (node_place_.capacity() + place_.capacity()) * sizeof(std::uint32_t);
}

}  // namespace helio
