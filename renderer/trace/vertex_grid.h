// Points in space, found again by where they are: a hashed grid with cells of twice the search radius, ordered by a
// counting sort, so that a search looks at eight runs of neighbours.
#pragma once

#include <cmath>
#include <cstdint>
#include <vector>

#include "renderer/base/math.h"

namespace helio {

class VertexGrid {
 public:
  // Orders the points: order[i] is where point i goes. Points of one cell keep their order. radius > 0; coordinates
  // within 2^30 radii of zero.
  void build(const std::vector<V3f>& points, double radius, std::vector<std::uint32_t>& order);

  // Calls visit(place) for all points within the radius, by place in the order.
  template <typename Function>
  void for_each_near(const V3f& point, Function&& visit) const {
    if (places_.empty()) return;
    // The cell and, on each axis, the neighbour on the nearer side.
    std::int32_t cell[3], other[3];
    for (int a = 0; a < 3; ++a) {
      const double at = point[a] * scale_, base = std::floor(at);
      cell[a] = std::int32_t(base);
      other[a] = at - base < 0.5 ? cell[a] - 1 : cell[a] + 1;
    }
    std::uint32_t seen[8];
    int count = 0;
    for (int k = 0; k < 8; ++k) {
      const std::uint32_t slot =
          hash(k & 1 ? other[0] : cell[0], k & 2 ? other[1] : cell[1], k & 4 ? other[2] : cell[2]);
      bool known = false;  // cells that share a slot are looked at once
      for (int j = 0; j < count; ++j) known |= seen[j] == slot;
      if (known) continue;
      seen[count++] = slot;
      for (std::uint32_t p = begins_[slot]; p < begins_[slot + 1]; ++p) {
        const V3f d = places_[p] - point;
        if (double(dot(d, d)) <= radius_squared_) visit(p);
      }
    }
  }

  std::size_t bytes() const { return places_.capacity() * sizeof(V3f) + begins_.capacity() * sizeof(std::uint32_t); }

 private:
  std::uint32_t hash(std::int32_t x, std::int32_t y, std::int32_t z) const {
    const std::uint32_t h = std::uint32_t(x) * 73856093u ^ std::uint32_t(y) * 19349663u ^ std::uint32_t(z) * 83492791u;
    return (h ^ (h >> 15)) & mask_;
  }

  std::vector<V3f> places_;
  std::vector<std::uint32_t> begins_;  // by slot, and one more
  std::uint32_t mask_ = 0;
  double scale_ = 0;
  double radius_squared_ = 0;
};

}  // namespace helio
