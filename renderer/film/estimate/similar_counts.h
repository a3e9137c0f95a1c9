// The pixels of a 7x7 neighbourhood that have about as many samples as the one in its middle (variance_pool.h).
#pragma once

#include <vector>

#include "renderer/film/core/box_rows.h"
#include "renderer/film/core/lanes.h"

namespace helio {

// Rows are put in from top to bottom, `width` pixels and three more on either side; once seven are in, `x` is a column
// of the middle one, from the window's first.
class SimilarCounts {
 public:
  // At most this many times as many samples, or as few.
  static constexpr float kSimilar = 4;

  void begin(int width);

  // Samples of the next row's pixels (PixelRow::copy_counts); 0: none, or of one half alone.
  float* counts() { return row(0).counts.data(); }
  // Puts it in with its terms, four floats a pixel; null: no pixel of the row has any.
  void push(const float* differences, const float* spreads);

  // Samples of the pixel in the middle.
  float own(int x) const { return row(kBoxRadius + 1).counts[std::size_t(x + kBoxRadius)]; }
  // Whether all pixels that have samples have about as many: of all pixels of the middle row, and of one of them. True of
  // a pixel without.
  bool all() const;
  bool all(int x) const;
  // Sums over the pixels that do, terms as they were put in: in the fourth lanes, how many have each. Precondition:
  // own(x) > 0.
  void sum(int x, Float4& differences, Float4& spreads) const;

 private:
  struct Row {
    std::vector<float> counts, least, most;  // of one pixel | of the seven around it
    std::vector<float> differences, spreads;
    float row_least = 0, row_most = 0;
    bool any = false, any_spread = false;
  };
  // 0: the next one; 1: the newest.
  Row& row(int back) { return rows_[(next_ + kRows - back) % kRows]; }
  const Row& row(int back) const { return rows_[(next_ + kRows - back) % kRows]; }
  static constexpr int kRows = kBoxSide + 1;

  int width_ = 0, next_ = 0;
  Row rows_[kRows];
};

}  // namespace helio
