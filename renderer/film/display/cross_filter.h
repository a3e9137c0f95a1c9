// One level of the display layer's filter: a weighted mean over 5x5 taps `step` pixels apart. A tap weighs by how far
// noise explains that 3x3 pixels around it differ from those around the centre (non-local means, Buades et al. 2005,
// with variances as Rousselle et al. 2012, eq. 4), by how alike the first hits are, and less where it is far noisier
// than the centre. The weights of one half are
// applied to the other (Rousselle et al. 2012, section 5.1): they do not follow the noise that they average, and the
// two results tell by their difference what noise is left.
#pragma once

#include <cstddef>
#include <vector>

#include "renderer/film/display/halves_window.h"

namespace helio {

// Pixels beyond its window that a level reads.
constexpr int filter_border(int step) {
  return 2 * step + 1;
}

// Planes of a window, row-major.
struct FilteredWindow {
  std::vector<float> light[kHalves][3];
  std::vector<float> variance;  // as HalvesWindow has it
};

// Keeps its memory from window to window.
class CrossFilter {
 public:
  // in: light, variance and guides of the window with its border.
  void run(const HalvesWindow& in, const PixelRect& window, int step, FilteredWindow& out);

 private:
  void compare(const HalvesWindow& in, const PixelRect& window, std::ptrdiff_t tap);
  void add(const HalvesWindow& in, const PixelRect& window, int dx, int dy, int step);
  void finish(const HalvesWindow& in, const PixelRect& window, FilteredWindow& out) const;

  // Rows of the window are `columns_` apart, which are whole vectors.
  std::size_t columns_ = 0;
  // Squared differences less what variance explains of them, over that variance, by half: summed over three columns,
  // of the window's rows and of one above and below | of a row.
  std::vector<float> apart_[kHalves], row_[kHalves];
  // Sums over taps: weights, weights times light, and squared weights times variance, of both halves together.
  std::vector<float> weights_[kHalves], sums_[kHalves][3], noise_;
};

}  // namespace helio
