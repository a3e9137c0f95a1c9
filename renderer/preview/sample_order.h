// Which pixels of a preview get a path, and in which order: those without light evenly over the picture, from coarse to
// fine, then those with few samples in the same way. Where somebody looks, what lies apart from there comes later, and
// only a share of it at all.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <span>
#include <vector>

#include "renderer/base/gaze_density.h"
#include "renderer/preview/preview_history.h"
#include "renderer/trace/paths/path_integrator.h"

namespace helio {

// Samples from which on light is left as it is: neither sampled nor filtered.
inline constexpr int kSettledSamples = 32;
// What the filter may settle for where it has no time for more: kSettledSamples, few samples, or gaps alone.
inline constexpr int kFilterLimits[] = {kSettledSamples, 4, 1};

class SampleOrder {
 public:
  static constexpr int kClasses = 256;  // one pixel of 256 in each, evenly spread

  // Pixels by class.
  class Classes {
   public:
    void add(int key, const PixelPosition& at) { pixels_.push_back({std::uint8_t(key), at}); }
    void sort();  // before of_class(); pixels of a class stay in the order in which they came
    std::span<const PixelPosition> of_class(int key) const;

   private:
    struct Pixel {
      std::uint8_t key;
      PixelPosition at;
    };
    std::vector<Pixel> pixels_;
    std::vector<PixelPosition> sorted_;
    std::array<std::uint32_t, kClasses + 1> begin_{};
  };
  // The pixels of a window that want a path.
  struct Wanted {
    Classes gaps, noisy;
    std::array<std::size_t, std::size(kFilterLimits)> below{};  // pixels with fewer samples, by limit
  };
  // density: where somebody looks; null: nowhere in particular.
  static Wanted find(const PixelRect& window, const PreviewHistory& history, const GazeDensity* density = nullptr);

  // The first `most` pixels of all windows together, in order.
  static std::vector<PixelPosition> merge(const std::vector<Wanted>& windows, std::size_t most);
};

}  // namespace helio
