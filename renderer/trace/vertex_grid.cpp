#include "renderer/trace/vertex_grid.h"

#include <algorithm>
#include <bit>

namespace helio {

void VertexGrid::build(const std::vector<V3f>& points, double radius, std::vector<std::uint32_t>& order) {
  const std::uint32_t slots = std::bit_ceil(std::uint32_t(std::max<std::size_t>(points.size(), 1)));
  mask_ = slots - 1;
  scale_ = 0.5 / radius;
  radius_squared_ = radius * radius;
  begins_.assign(std::size_t(slots) + 1, 0);
  order.resize(points.size());
  // First the slot of each point, then its place.
  for (std::size_t i = 0; i < points.size(); ++i) {
    const V3f& p = points[i];
    order[i] = slot(std::int32_t(std::floor(p.x * scale_)), std::int32_t(std::floor(p.y * scale_)),
                    std::int32_t(std::floor(p.z * scale_)));
    ++begins_[order[i] + 1];
  }
  for (std::uint32_t s = 0; s < slots; ++s) begins_[s + 1] += begins_[s];
  std::vector<std::uint32_t> next(begins_.begin(), begins_.end() - 1);
  places_.resize(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    order[i] = next[order[i]]++;
    places_[order[i]] = points[i];
  }
}

}  // namespace helio
