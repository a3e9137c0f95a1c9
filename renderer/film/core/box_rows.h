// Sums over the 7x7 neighbourhood of every pixel, row by row, in an order that depends on nothing but the
// neighbourhood. Seven rows are kept, so that what a tile needs stays in the first-level cache.
#pragma once

#include <vector>

#include "renderer/base/math.h"
#include "renderer/film/core/lanes.h"

namespace helio {

inline constexpr int kBoxRadius = 3;
inline constexpr int kBoxSide = 2 * kBoxRadius + 1;

// The window and the border that its neighbourhoods reach into.
inline PixelRect with_box_border(const PixelRect& window) {
  return {window.x0 - kBoxRadius, window.y0 - kBoxRadius, window.x1 + kBoxRadius, window.y1 + kBoxRadius};
}

// Rows have kLanes floats a pixel. They are put in from top to bottom; once seven are in, sum() is that of the middle
// one.
class BoxRows {
 public:
  // Forgets all rows; input() is zero. `width`: of the window.
  void begin(int width);

  // The next row, width + 6 pixels. What is written there stays until it is written again.
  float* input() { return input_.data(); }
  // Puts it in; not `filled`: a row of zeroes, whatever input() holds.
  void push(bool filled);

  // Whether the newest seven rows are zeroes.
  bool empty() const { return empty_rows_ >= kBoxSide; }
  // Over the newest seven rows: `width` pixels, rounded up to whole vectors.
  void sum(float* out) const;

 private:
  struct Pixels {
    alignas(64) float lanes[kPixelsAtOnce * kLanes];
  };
  struct Row {
    std::vector<Pixels> sums;  // over seven columns
    std::vector<Pixels> two;   // those and the row's above
    bool zero = true;          // `sums` are zeroes, whatever is written there; `two` likewise if both rows' are
  };

  int width_ = 0;  // rounded up
  int newest_ = 0;
  int empty_rows_ = 0;
  std::vector<float> input_;
  std::vector<Pixels> zeroes_;
  Row rows_[kBoxSide];
};

}  // namespace helio
