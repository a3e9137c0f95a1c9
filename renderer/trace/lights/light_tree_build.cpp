#include "renderer/trace/lights/light_tree_build.h"

#include <algorithm>
#include <array>
#include <numeric>

namespace helio {
namespace {

constexpr int kBins = 12;
// Clusters larger than this are binned along their longest axis only.
constexpr std::size_t kAllAxesBelow = 1 << 14;

struct Bin {
  LightBounds bounds;
  std::size_t count = 0;

  void add(const LightBounds& other, std::size_t n) {
    bounds = count == 0 ? other : merge(bounds, other);
    count += n;
  }
};

class Builder {
 public:
  explicit Builder(std::span<const LightBounds> lights) : lights_(lights), order_(lights.size()) {
    std::iota(order_.begin(), order_.end(), 0u);
    nodes_.reserve(2 * lights.size());
  }

  std::vector<LightTreeNode> build() {
    build(0, order_.size(), 0);
    return std::move(nodes_);
  }

 private:
  V3f center(std::uint32_t light) const { return lights_[light].box.center(); }

  std::uint32_t build(std::size_t begin, std::size_t end, int depth) {
    const std::uint32_t index = std::uint32_t(nodes_.size());
    nodes_.emplace_back();
    if (end - begin == 1) {
      nodes_[index].light = order_[begin];
      nodes_[index].bounds = lights_[order_[begin]];
    } else {
      const std::size_t middle = split(begin, end, depth);
      const std::uint32_t first = build(begin, middle, depth + 1), second = build(middle, end, depth + 1);
      nodes_[index].first = first;
      nodes_[index].second = second;
      nodes_[index].bounds = merge(nodes_[first].bounds, nodes_[second].bounds);
    }
    nodes_[index].cost = cluster_cost(nodes_[index].bounds);
    nodes_[index].lights = std::uint32_t(end - begin);
    return index;
  }

  struct Split {
    double cost = std::numeric_limits<double>::infinity();
    int axis = -1, bin = 0;
  };

  int bin_of(std::uint32_t light, int axis, const Box3f& centers) const {
    const float position = (center(light)[axis] - centers.min[axis]) / (centers.max[axis] - centers.min[axis]);
    return position > 0 ? int(std::min(position * kBins, kBins - 1.0f)) : 0;
  }

  // Reorders [begin, end) and returns where its second part begins.
  std::size_t split(std::size_t begin, std::size_t end, int depth) {
    Box3f centers, box;
    for (std::size_t i = begin; i < end; ++i) {
      centers.extendBy(center(order_[i]));
      box.extendBy(lights_[order_[i]].box);
    }
    const V3f extent = centers.size();
    const int longest = extent.x >= extent.y ? (extent.x >= extent.z ? 0 : 2) : (extent.y >= extent.z ? 1 : 2);
    if (extent[longest] > 0 && depth < kMaxHeuristicDepth) {
      Split best;
      for (int axis = 0; axis < 3; ++axis) {
        if (!(extent[axis] > 0) || (axis != longest && end - begin > kAllAxesBelow)) continue;
        const V3f size = box.size();
        const double stretch = std::max({size.x, size.y, size.z}) / size[axis];  // K_r: discourages thin parts
        try_axis(begin, end, axis, centers, stretch, best);
      }
      if (best.axis >= 0) {
        const auto middle =
            std::partition(order_.begin() + std::ptrdiff_t(begin), order_.begin() + std::ptrdiff_t(end),
                           [&](std::uint32_t light) { return bin_of(light, best.axis, centers) <= best.bin; });
        return std::size_t(middle - order_.begin());
      }
    }
    const std::size_t middle = begin + (end - begin) / 2;
    if (extent[longest] > 0) {
      std::nth_element(order_.begin() + std::ptrdiff_t(begin), order_.begin() + std::ptrdiff_t(middle),
                       order_.begin() + std::ptrdiff_t(end),
                       [&](std::uint32_t a, std::uint32_t b) { return center(a)[longest] < center(b)[longest]; });
    }
    return middle;
  }

  void try_axis(std::size_t begin, std::size_t end, int axis, const Box3f& centers, double stretch, Split& best) const {
    std::array<Bin, kBins> bins;
    for (std::size_t i = begin; i < end; ++i) bins[bin_of(order_[i], axis, centers)].add(lights_[order_[i]], 1);
    std::array<double, kBins> above{};  // cost of bins [k, kBins)
    Bin part;
    for (int k = kBins - 1; k > 0; --k) {
      if (bins[k].count > 0) part.add(bins[k].bounds, bins[k].count);
      above[k] = part.count > 0 ? cluster_cost(part.bounds) : 0;
    }
    part = Bin{};
    for (int k = 0; k + 1 < kBins; ++k) {
      if (bins[k].count > 0) part.add(bins[k].bounds, bins[k].count);
      if (part.count == 0 || part.count == end - begin) continue;
      const double cost = stretch * (cluster_cost(part.bounds) + above[k + 1]);
      if (cost < best.cost) best = {cost, axis, k};
    }
  }

  std::span<const LightBounds> lights_;
  std::vector<std::uint32_t> order_;
  std::vector<LightTreeNode> nodes_;
};

}  // namespace

std::vector<LightTreeNode> build_light_hierarchy(std::span<const LightBounds> lights) {
  return Builder(lights).build();
}

}  // namespace helio
