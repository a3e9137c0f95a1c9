#include "renderer/film/core/invalid_counts.h"

#include <algorithm>
#include <memory>

namespace helio {

std::uint32_t* InvalidCounts::make() {
  std::uint32_t* all = counts_.load(std::memory_order_acquire);
  if (all) return all;
  std::unique_ptr<std::uint32_t[]> own(new std::uint32_t[2 * pixels_]());
  // Of those who make them at once the first one's count.
  if (!counts_.compare_exchange_strong(all, own.get(), std::memory_order_acq_rel, std::memory_order_acquire))
    return all;
  return own.release();
}

void InvalidCounts::clear(std::size_t first, std::size_t count) {
  std::uint32_t* all = counts_.load(std::memory_order_acquire);
  if (!all) return;
  for (const std::size_t half : {std::size_t(0), pixels_}) std::fill_n(all + half + first, count, 0u);
}

}  // namespace helio
