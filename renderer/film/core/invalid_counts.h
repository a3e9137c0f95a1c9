// Samples of a film that were not finite, by half and pixel. They are rare: the counts come into being with the first.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <utility>

namespace helio {

// Thread safe for different pixels.
class InvalidCounts {
 public:
  explicit InvalidCounts(std::size_t pixels) : pixels_(pixels) {}
  ~InvalidCounts() { delete[] counts_.load(std::memory_order_relaxed); }
  InvalidCounts(InvalidCounts&& other) noexcept
      : pixels_(other.pixels_), counts_(other.counts_.exchange(nullptr, std::memory_order_relaxed)) {}
  InvalidCounts& operator=(InvalidCounts&& other) noexcept {
    std::swap(pixels_, other.pixels_);
    counts_.store(other.counts_.exchange(counts_.load(std::memory_order_relaxed), std::memory_order_relaxed),
                  std::memory_order_relaxed);
    return *this;
  }

  bool any() const { return counts() != nullptr; }  // since the film was made
  std::uint32_t at(int half, std::size_t pixel) const {
    const std::uint32_t* all = counts();
    return all ? all[std::size_t(half) * pixels_ + pixel] : 0;
  }
  void add(int half, std::size_t pixel, std::uint32_t samples) {
    make()[std::size_t(half) * pixels_ + pixel] += samples;
  }
  // Of both halves, of `count` neighbours in a row.
  void clear(std::size_t first, std::size_t count);

  // All of a half's, in the order of pixels; they come into being with the call.
  std::uint32_t* of(int half) { return make() + std::size_t(half) * pixels_; }

  static constexpr std::size_t kBytesPerPixel = 2 * sizeof(std::uint32_t);  // once there is one
  std::size_t bytes() const { return any() ? pixels_ * kBytesPerPixel : 0; }

 private:
  const std::uint32_t* counts() const { return counts_.load(std::memory_order_acquire); }
  std::uint32_t* make();

  std::size_t pixels_;
  std::atomic<std::uint32_t*> counts_{nullptr};  // the first half's, then the second's
};

}  // namespace helio
