#include "renderer/trace/paths/vertex_grid.h"

#include <algorithm>
#include <bit>
#include <numeric>
#include <utility>

#include "renderer/base/check.h"

namespace helio {
namespace {

// So few that counts of them by chunk stay in the cache, so many that one is sorted within a millisecond.
constexpr std::uint32_t kMostBuckets = 256;

}  // namespace

VertexGridBuilder::VertexGridBuilder(const std::vector<std::uint32_t>& chunk_sizes, double radius)
    : chunk_begins_(chunk_sizes.size() + 1, 0) {
  std::partial_sum(chunk_sizes.begin(), chunk_sizes.end(), chunk_begins_.begin() + 1);
  const std::uint32_t count = chunk_begins_.back(), slots = std::bit_ceil(std::max(count, 1u));
  grid_.mask_ = slots - 1;
  grid_.scale_ = 0.5 / radius;
  grid_.radius_squared_ = radius * radius;
  grid_.begins_ = RawArray<std::uint32_t>(std::size_t(slots) + 1);
  grid_.begins_[slots] = count;
  grid_.places_ = RawArray<V3f>(count);
  points_ = RawArray<V3f>(count);
  slots_ = RawArray<std::uint32_t>(count);
  sorted_ = RawArray<std::uint32_t>(count);
  buckets_ = std::min(slots, kMostBuckets);
  bucket_shift_ = std::countr_zero(slots) - std::countr_zero(std::uint32_t(buckets_));
  counts_.assign(chunk_sizes.size() * buckets_, 0);
  bucket_begins_.assign(buckets_ + 1, 0);
}

// The slot of each point, and how many of the chunk are in each bucket.
void VertexGridBuilder::add(std::size_t chunk, std::span<const V3f> points) {
  HELIO_DCHECK(points.size() == chunk_size(chunk));
  std::uint32_t* counts = &counts_[chunk * buckets_];
  const double scale = grid_.scale_;
  std::uint32_t i = chunk_begins_[chunk];
  for (const V3f& p : points) {
    points_.put(i, p);
    slots_[i] = grid_.slot(std::int32_t(std::floor(p.x * scale)), std::int32_t(std::floor(p.y * scale)),
                           std::int32_t(std::floor(p.z * scale)));
    ++counts[slots_[i++] >> bucket_shift_];
  }
}

void VertexGridBuilder::finish_adding() {
  std::uint32_t before = 0;
  for (std::size_t bucket = 0; bucket < buckets_; ++bucket) {
    bucket_begins_[bucket] = before;
    for (std::size_t chunk = 0; chunk < chunks(); ++chunk) {
      std::uint32_t& count = counts_[chunk * buckets_ + bucket];
      before += std::exchange(count, before);
    }
  }
  bucket_begins_[buckets_] = before;
}

void VertexGridBuilder::distribute(std::size_t chunk) {
  std::uint32_t* next = &counts_[chunk * buckets_];
  for (std::uint32_t i = chunk_begins_[chunk]; i < chunk_begins_[chunk + 1]; ++i)
    sorted_[next[slots_[i] >> bucket_shift_]++] = i;
}

// A counting sort by slot.
void VertexGridBuilder::sort(std::size_t bucket) {
  const std::uint32_t begin = bucket_begins_[bucket], end = bucket_begins_[bucket + 1];
  const std::uint32_t slots = std::uint32_t(1) << bucket_shift_, first_slot = std::uint32_t(bucket) << bucket_shift_;
  std::vector<std::uint32_t> next(slots, 0);
  for (std::uint32_t k = begin; k < end; ++k) ++next[slots_[sorted_[k]] - first_slot];
  std::uint32_t before = begin;
  for (std::uint32_t s = 0; s < slots; ++s) {
    grid_.begins_[first_slot + s] = before;
    before += std::exchange(next[s], before);
  }
  for (std::uint32_t k = begin; k < end; ++k) {
    const std::uint32_t i = sorted_[k], place = next[slots_[i] - first_slot]++;
    slots_[i] = place;
    grid_.places_.put(place, points_[i]);
  }
}

void VertexGridBuilder::finish(VertexGrid& grid, RawArray<std::uint32_t>& order) {
  grid = std::move(grid_);
  order = std::move(slots_);
}

}  // namespace helio
