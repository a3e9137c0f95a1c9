#include "renderer/film/core/sample_targets.h"

#include <algorithm>

namespace helio {

std::uint64_t SampleTargets::samples_in(const Film& film, int h, const PixelRect& window, std::uint32_t first,
                                        std::uint32_t count) const {
  std::uint64_t samples = 0;
  const std::uint64_t end = std::uint64_t(first) + count;
  for (int y = window.y0; y < window.y1; ++y) {
    for (int x = window.x0; x < window.x1; ++x) {
      const std::uint64_t from = std::max(first, film.attempted(h, x, y));
      const std::uint64_t to = std::min<std::uint64_t>(end, target(h, x, y));
      samples += to > from ? to - from : 0;
    }
  }
  return samples;
}

}  // namespace helio
