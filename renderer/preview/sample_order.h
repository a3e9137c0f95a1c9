// Which pixels of a preview get a path, and in which order: those without light evenly over the picture, from coarse to
// fine, then those with few samples in the same way.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <vector>

#include "renderer/preview/preview_history.h"
#include "renderer/trace/paths/path_integrator.h"

namespace helio {

// Samples from which on light is left as it is: neither sampled nor filtered.
inline constexpr int kSettledSamples = 32;
// What the filter may settle for where it has no time for more: kSettledSamples, few samples, or gaps alone.
inline constexpr int kFilterLimits[] = {kSettledSamples, 4, 1};

class SampleOrder {
 public:
  static constexpr int kClasses = 16;  // one pixel of 16 in each, evenly spread

  // The pixels of a window that want a path.
  struct Wanted {
    std::array<std::vector<PixelPosition>, kClasses> gaps, noisy;
    std::array<std::size_t, std::size(kFilterLimits)> below{};  // pixels with fewer samples, by limit
  };
  static Wanted find(const PixelRect& window, const PreviewHistory& history);

  // The first `most` pixels of all windows together, in order.
  static std::vector<PixelPosition> merge(const std::vector<Wanted>& windows, std::size_t most);
};

}  // namespace helio
