#include "renderer/trace/lights/light_tree.h"

#include <algorithm>

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
// The least share of a cluster's squared radius that is added to its squared distance, and the number of lights up to
// which all of it is added. Few lights lie at the ball's rim, so that none is near a point near its centre; many fill
// it, and the nearest give most.
constexpr float kLeastSpread = 0.04f, kFewLights = 4;

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
    node.spread[slot] =
        std::clamp(kFewLights / float(child.lights), kLeastSpread, 1.0f) * node.radius[slot] * node.radius[slot];
    node.axis_x[slot] = bounds.axis.x;
    node.axis_y[slot] = bounds.axis.y;
    node.axis_z[slot] = bounds.axis.z;
    node.cos_theta_o[slot] = bounds.theta_o >= kPi ? -1.0f : std::cos(bounds.theta_o);
    node.sin_theta_o[slot] = root(1.0f - node.cos_theta_o[slot] * node.cos_theta_o[slot]);
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

// Importance of each child: intensity times the cosines of emission (section 4.1 of the paper) and at the receiver over
// the squared distance. Each cosine is that at the child's centre, or next to nothing beyond the horizon, plus half of
// sin_b, the sine of half the angle that its ball takes up: the whole of it would make a bound. Children whose centre
// is beyond the horizon keep that half, since a light of theirs on this side of it may be very near. `spread` is for
// the lights' mean squared distance from the centre. Bounds alone decide which children cannot reach the point.
void LightTree::importances(const Node& node, const V3f& point, const V3f& normal, float* __restrict importance) {
  const float px = point.x, py = point.y, pz = point.z, nx = normal.x, ny = normal.y, nz = normal.z;
  const float least_facing = length_squared(normal) > 0 ? -1.0f : 1.0f;
  for (int i = 0; i < kWidth; ++i) {
    const float dx = px - node.center_x[i], dy = py - node.center_y[i], dz = pz - node.center_z[i];
    const float squared = larger(dx * dx + dy * dy + dz * dz, kMinDistanceSquared);
    const float distance = std::sqrt(squared), inverse = 1.0f / distance;
    const float radius = node.radius[i];
    const float sin_b = smaller(radius * inverse, 1.0f);

    // Cosine and sine of max(0, theta_w - theta_o).
    const float toward = (node.axis_x[i] * dx + node.axis_y[i] * dy + node.axis_z[i] * dz) * inverse;
    const float cos_o = node.cos_theta_o[i], cos_w = smaller(larger(toward, -toward - node.one_sided[i]), cos_o);
    const float sin_w = root(1.0f - cos_w * cos_w), sin_o = node.sin_theta_o[i];
    const float cos_e = cos_w * cos_o + sin_w * sin_o, sin_e = sin_w * cos_o - cos_w * sin_o;
    const float cos_r = larger(-(nx * dx + ny * dy + nz * dz) * inverse, least_facing);

    const float emission = larger(cos_e, kCosineSlack) + 0.5f * sin_b;
    const float reception = larger(cos_r, kCosineSlack) + 0.5f * sin_b;
    const float any = node.intensity[i] * emission * reception / (squared + node.spread[i]);
    const float within = larger(cos_e, 0.0f) + sin_e * sin_b > node.cos_theta_e[i] - kCosineSlack ? any : 0.0f;
    const float emitted = cos_e + sin_b > -kCosineSlack ? within : 0.0f;
    const float received = cos_r + sin_b > -kCosineSlack ? emitted : 0.0f;
    const float bounded = squared <= radius * radius ? any : received;
    importance[i] = distance - radius <= node.range[i] * 1.0001f ? bounded : 0.0f;
  }
}

// Each step below is a loop of its own, so that the long chains of operations of one query overlap with those of
// others, and choosing is done for as many queries at once as a vector holds.
void LightTree::select(std::span<const Query> queries, Choice* choices) const {
  HELIO_DCHECK(queries.size() <= kMostQueries);
  std::uint32_t number[kMostQueries], at[kMostQueries];  // of the queries that are under way, in their order
  float u[kMostQueries], probability[kMostQueries];
  float importance[kWidth][kMostQueries];
  float sum[kMostQueries], before[kMostQueries], of_chosen[kMostQueries];
  std::int32_t chosen[kMostQueries];
  std::size_t count = queries.size();
  for (std::size_t k = 0; k < count; ++k) {
    number[k] = std::uint32_t(k);
    at[k] = 0;
    u[k] = queries[k].u;
    probability[k] = 1;
  }
  while (count > 0) {
    for (std::size_t k = 0; k < count; ++k) {
      const Query& query = queries[number[k]];
      alignas(32) float of_children[kWidth];
      importances(nodes_[at[k]], query.point, query.normal, of_children);
      for (int i = 0; i < kWidth; ++i) importance[i][k] = of_children[i];
    }
    for (std::size_t k = 0; k < count; ++k) sum[k] = 0;
    for (int i = 0; i < kWidth; ++i) {
      for (std::size_t k = 0; k < count; ++k) sum[k] += importance[i][k];
    }
    // The last child that begins at u's place in the sum or before it.
    for (std::size_t k = 0; k < count; ++k) {
      float below = 0, start = 0, own = importance[0][k];
      std::int32_t last = 0;
      const float target = u[k] * sum[k];
      for (int i = 1; i < kWidth; ++i) {
        below += importance[i - 1][k];
        const bool begun = (importance[i][k] > 0) & !(target < below);
        last = begun ? i : last;
        start = begun ? below : start;
        own = begun ? importance[i][k] : own;
      }
      chosen[k] = last;
      before[k] = start;
      of_chosen[k] = own;
    }
    for (std::size_t k = 0; k < count; ++k) {
      probability[k] *= of_chosen[k] / sum[k];
      u[k] = std::clamp((u[k] * sum[k] - before[k]) / of_chosen[k], 0.0f, kOneMinusEpsilon);
    }
    std::size_t left = 0;
    for (std::size_t k = 0; k < count; ++k) {
      const std::uint32_t child = nodes_[at[k]].child[chosen[k]];
      if (!(sum[k] > 0)) {
        choices[number[k]] = {};
      } else if (child & kLeaf) {
        choices[number[k]] = {child & ~kLeaf, probability[k]};
      } else {
        prefetch_lines(&nodes_[child], sizeof(Node));
        number[left] = number[k];
        at[left] = child;
        u[left] = u[k];
        probability[left++] = probability[k];
      }
    }
    count = left;
  }
}

LightTree::Choice LightTree::select(const V3f& point, const V3f& normal, float u) const {
  const Query query{point, normal, u};
  Choice choice;
  select({&query, 1}, &choice);
  return choice;
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
