#include "renderer/trace/lights/light_tree.h"

#include <bit>

#include "renderer/base/check.h"
#include "renderer/base/prefetch.h"
#include "renderer/trace/lights/light_tree_build.h"

namespace helio {
namespace {

// Cosines carry rounding errors of about 3e-4 near 1 (their sines come from a square root): a light is given up only
// when it is farther out of reach than this, and one barely in reach counts as this much.
constexpr float kCosineSlack = 1e-3f;
// No light weighs less than this share of the sum: its importance must not vanish in float.
constexpr double kMinShare = 1e-14;
constexpr float kMinDistanceSquared = 1e-20f;

// By value and without a branch, so that compilers turn the loop over a node's children into vector code.
inline float larger(float a, float b) {
  return a > b ? a : b;
}
inline float smaller(float a, float b) {
  return a < b ? a : b;
}
inline float root(float x) {
  return std::sqrt(larger(x, 0.0f));
}

}  // namespace

LightTree::LightTree(std::span<const LightBounds> lights) {
  if (lights.empty()) return;
  const std::vector<LightTreeNode> binary = build_light_hierarchy(lights);
  place_.resize(lights.size());
  collapse(binary, 0, 0, 1 / binary[0].bounds.intensity);
  nodes_.shrink_to_fit();
  node_place_.shrink_to_fit();
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

// Importance of each child: intensity times bounds of the emission cosine (section 4.1 of the paper; the
// cone of directions to a child is that to its bounding ball), of the cosine at the receiver, and of 1 / d^2.
void LightTree::importances(const Node& node, const V3f& point, const V3f& normal, float* __restrict importance) {
  const float px = point.x, py = point.y, pz = point.z, nx = normal.x, ny = normal.y, nz = normal.z;
  const float least_facing = length_squared(normal) > 0 ? -1.0f : 1.0f;
  for (int i = 0; i < kWidth; ++i) {
    const float dx = px - node.center_x[i], dy = py - node.center_y[i], dz = pz - node.center_z[i];
    const float squared = larger(dx * dx + dy * dy + dz * dz, kMinDistanceSquared);
    const float distance = std::sqrt(squared), inverse = 1.0f / distance;
    const float radius = node.radius[i];
    const float sin_b = smaller(radius * inverse, 1.0f), cos_b = root(1.0f - sin_b * sin_b);

    // cos of max(0, theta_w - theta_o - theta_b), two angles at a time.
    const float toward = (node.axis_x[i] * dx + node.axis_y[i] * dy + node.axis_z[i] * dz) * inverse;
    const float cos_w = larger(toward, -toward - node.one_sided[i]), sin_w = root(1.0f - cos_w * cos_w);
    const float cos_o = node.cos_theta_o[i], sin_o = root(1.0f - cos_o * cos_o);
    const float cos_wo = cos_w * cos_o + sin_w * sin_o, sin_wo = sin_w * cos_o - cos_w * sin_o;
    const float cos_x = cos_w >= cos_o ? 1.0f : cos_wo, sin_x = cos_w >= cos_o ? 0.0f : sin_wo;
    const float cos_xb = cos_x * cos_b + sin_x * sin_b;
    const float cos_emission = cos_x >= cos_b ? 1.0f : cos_xb;

    const float cos_i = -(nx * dx + ny * dy + nz * dz) * inverse, sin_i = root(1.0f - cos_i * cos_i);
    const float cos_ib = cos_i * cos_b + sin_i * sin_b;
    const float cos_receiver = larger(cos_i >= cos_b ? 1.0f : cos_ib, least_facing);

    const float any = node.intensity[i] * larger(cos_emission, kCosineSlack) * larger(cos_receiver, kCosineSlack) /
                      larger(squared, radius * radius);
    const float emitted = cos_emission > node.cos_theta_e[i] - kCosineSlack ? any : 0.0f;
    const float received = cos_receiver > -kCosineSlack ? emitted : 0.0f;
    const float bounded = squared <= radius * radius ? any : received;
    importance[i] = distance - radius <= node.range[i] * 1.0001f ? bounded : 0.0f;
  }
}

bool LightTree::descend(const V3f& point, const V3f& normal, Descent& descent) const {
  const Node& node = nodes_[descent.at];
  alignas(32) float importance[kWidth];
  importances(node, point, normal, importance);
  float below[kWidth], sum = 0;
  for (int i = 0; i < kWidth; ++i) {
    below[i] = sum;
    sum += importance[i];
  }
  if (!(sum > 0)) {
    descent.choice = {};
    return false;
  }
  // The last child that begins at the target or before it; without a branch, which nothing could predict.
  const float target = descent.u * sum;
  std::uint32_t begun = 0;
  for (int i = 0; i < kWidth; ++i) {
    const std::uint32_t bit = std::uint32_t(1) << i;
    begun |= (importance[i] > 0) & !(target < below[i]) ? bit : 0;
  }
  const int chosen = std::bit_width(begun) - 1;
  descent.choice.probability *= importance[chosen] / sum;
  const std::uint32_t child = node.child[chosen];
  if (child & kLeaf) {
    descent.choice.light = child & ~kLeaf;
    return false;
  }
  descent.u = std::clamp((target - below[chosen]) / importance[chosen], 0.0f, kOneMinusEpsilon);
  descent.at = child;
  return true;
}

LightTree::Choice LightTree::select(const V3f& point, const V3f& normal, float u) const {
  Descent descent{0, u};
  while (descend(point, normal, descent)) {
  }
  return descent.choice;
}

void LightTree::select(std::span<const Query> queries, Choice* choices) const {
  HELIO_DCHECK(queries.size() <= kMostQueries);
  Descent descents[kMostQueries];
  std::uint32_t under_way[kMostQueries];
  std::size_t count = queries.size();
  for (std::size_t i = 0; i < count; ++i) {
    descents[i].u = queries[i].u;
    under_way[i] = std::uint32_t(i);
  }
  while (count > 0) {
    std::size_t left = 0;
    for (std::size_t k = 0; k < count; ++k) {
      const std::uint32_t i = under_way[k];
      if (!descend(queries[i].point, queries[i].normal, descents[i])) continue;
      prefetch_lines(&nodes_[descents[i].at], sizeof(Node));
      under_way[left++] = i;
    }
    count = left;
  }
  for (std::size_t i = 0; i < queries.size(); ++i) choices[i] = descents[i].choice;
}

float LightTree::probability(const V3f& point, const V3f& normal, std::uint32_t light) const {
  float probability = 1;
  std::uint32_t place = place_[light];
  while (true) {
    const std::uint32_t at = place / kWidth;
    alignas(32) float importance[kWidth];
    importances(nodes_[at], point, normal, importance);
    float sum = 0;
    for (const float of_child : importance) sum += of_child;
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
