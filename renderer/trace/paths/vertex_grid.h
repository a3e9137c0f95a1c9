// Points in space, found again by where they are: a hashed grid with cells of twice the search radius, ordered by a
// counting sort. Cells that are neighbours along x are so in the order, so that a search looks at four runs of points.
#pragma once

#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

#include "renderer/base/math.h"
#include "renderer/base/prefetch.h"
#include "renderer/base/raw_array.h"

namespace helio {

// Empty by default; made by a VertexGridBuilder.
class VertexGrid {
 public:
  // Calls visit(place) for all points within the radius, by place in the order.
  template <typename Function>
  void for_each_near(const V3f& point, Function&& visit) const {
    if (places_.empty()) return;
    const Corner low = corner(point);
    std::uint32_t seen[8];
    int count = 0;
    const auto is_new = [&](std::uint32_t slot) {  // cells that share a slot are looked at once
      for (int j = 0; j < count; ++j) {
        if (seen[j] == slot) return false;
      }
      seen[count++] = slot;
      return true;
    };
    const auto look_at = [&](std::uint32_t begin, std::uint32_t end) {
      for (std::uint32_t p = begin; p < end; ++p) {
        const V3f d = places_[p] - point;
        if (double(dot(d, d)) <= radius_squared_) visit(p);
      }
    };
    for (int k = 0; k < 4; ++k) {
      const std::uint32_t first = slot(low, k), second = (first + 1) & mask_;
      const bool new_first = is_new(first), new_second = is_new(second);
      if (new_first && new_second && second > first) {
        look_at(begins_[first], begins_[second + 1]);
      } else {
        if (new_first) look_at(begins_[first], begins_[first + 1]);
        if (new_second) look_at(begins_[second], begins_[second + 1]);
      }
    }
  }

  // Fetches what a search there will look at: where its runs begin, and some searches later the first points of each.
  void expect(const V3f& point) const {
    const Corner low = corner(point);
    for (int k = 0; !places_.empty() && k < 4; ++k) prefetch(&begins_[slot(low, k)]);
  }
  void expect_points(const V3f& point) const {
    const Corner low = corner(point);
    for (int k = 0; !places_.empty() && k < 4; ++k) prefetch(places_.data() + begins_[slot(low, k)]);
  }

  std::size_t bytes() const { return places_.bytes() + begins_.bytes(); }

 private:
  friend class VertexGridBuilder;
  // The lowest of the eight cells that a search looks at.
  struct Corner {
    std::int32_t x, y, z;
  };
  Corner corner(const V3f& p) const {
    return {std::int32_t(std::floor(p.x * scale_ - 0.5)), std::int32_t(std::floor(p.y * scale_ - 0.5)),
            std::int32_t(std::floor(p.z * scale_ - 0.5))};
  }
  // Of a row of two of them.
  std::uint32_t slot(const Corner& low, int row) const { return slot(low.x, low.y + (row & 1), low.z + (row >> 1)); }
  std::uint32_t slot(std::int32_t x, std::int32_t y, std::int32_t z) const {
    const std::uint32_t h = std::uint32_t(y) * 0x9e3779b1u ^ std::uint32_t(z) * 0x85ebca77u;
    return ((h ^ (h >> 15)) * 0x2c1b3c6du + std::uint32_t(x)) & mask_;
  }

  RawArray<V3f> places_;
  RawArray<std::uint32_t> begins_;  // by slot, and one more
  std::uint32_t mask_ = 0;
  double scale_ = 0;
  double radius_squared_ = 0;
};

// Orders points in three sweeps, which threads may share: add() of all chunks, distribute() of all chunks, sort() of
// all buckets, with finish_adding() and finish() where they end. Buckets are runs of the grid's slots. Points of one
// slot keep their order, so that the bits do not depend on how they were cut into chunks.
class VertexGridBuilder {
 public:
  // chunk_sizes: points of each chunk. radius > 0; coordinates within 2^30 radii of zero.
  VertexGridBuilder(const std::vector<std::uint32_t>& chunk_sizes, double radius);

  std::size_t chunks() const { return chunk_begins_.size() - 1; }
  std::size_t buckets() const { return buckets_; }
  std::size_t chunk_size(std::size_t chunk) const { return chunk_begins_[chunk + 1] - chunk_begins_[chunk]; }

  // points: chunk_size() of them.
  void add(std::size_t chunk, std::span<const V3f> points);
  void finish_adding();
  void distribute(std::size_t chunk);
  void sort(std::size_t bucket);
  // Points of a bucket, after finish_adding().
  std::size_t bucket_size(std::size_t bucket) const { return bucket_begins_[bucket + 1] - bucket_begins_[bucket]; }
  // order[i] is where point i goes. What remains is to be destroyed.
  void finish(VertexGrid& grid, RawArray<std::uint32_t>& order);

 private:
  VertexGrid grid_;
  std::vector<std::uint32_t> chunk_begins_;   // and one more
  RawArray<V3f> points_;
  RawArray<std::uint32_t> slots_;             // by point; after sort() its place
  RawArray<std::uint32_t> sorted_;            // points by bucket
  std::size_t buckets_ = 0;
  int bucket_shift_ = 0;                      // of a slot
  std::vector<std::uint32_t> counts_;         // by chunk and bucket; later where in sorted_ the chunk's go
  std::vector<std::uint32_t> bucket_begins_;  // and one more
};

}  // namespace helio
