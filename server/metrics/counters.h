// What is counted where it happens: relaxed atomics, without a lock or an allocation.
#pragma once

#include <algorithm>
#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <initializer_list>

#include "renderer/base/check.h"

namespace helio {

// Thread safe.
class Counter {
 public:
  void add(std::uint64_t count = 1) noexcept { value_.fetch_add(count, std::memory_order_relaxed); }
  std::uint64_t value() const noexcept { return value_.load(std::memory_order_relaxed); }

 private:
  std::atomic<std::uint64_t> value_{0};
};

// How many values lie at or below each of some bounds. Thread safe.
class Histogram {
 public:
  static constexpr std::size_t kMostBounds = 23;

  // Ascending; one more bound, infinity, is always there.
  Histogram(std::initializer_list<double> bounds) : bounds_(bounds.size()) {
    HELIO_CHECK(bounds.size() <= kMostBounds && std::is_sorted(bounds.begin(), bounds.end()));
    std::copy(bounds.begin(), bounds.end(), upper_.begin());
  }

  // NaN is counted beyond all bounds.
  void observe(double value) noexcept {
    std::size_t i = 0;
    while (i < bounds_ && !(value <= upper_[i])) ++i;
    counts_[i].fetch_add(1, std::memory_order_relaxed);
    sum_.fetch_add(value, std::memory_order_relaxed);
  }

  std::size_t bounds() const noexcept { return bounds_; }
  double upper(std::size_t i) const noexcept { return upper_[i]; }
  // Values above the bound before this one and not above this one; i == bounds(): above all.
  std::uint64_t count(std::size_t i) const noexcept { return counts_[i].load(std::memory_order_relaxed); }
  double sum() const noexcept { return sum_.load(std::memory_order_relaxed); }

 private:
  std::size_t bounds_;
  std::array<double, kMostBounds> upper_{};
  std::array<std::atomic<std::uint64_t>, kMostBounds + 1> counts_{};
  std::atomic<double> sum_{0};
};

}  // namespace helio
