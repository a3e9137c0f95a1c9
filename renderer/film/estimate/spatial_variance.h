// Variance of pixels that have samples in one half only, from their differences to neighbouring pixels
// (variance_pool.h).
#pragma once

#include <vector>

#include "renderer/film/core/box_rows.h"
#include "renderer/film/core/film.h"
#include "renderer/film/history/splat_row.h"

namespace helio {

// Row by row: the rows of the film that one row of the window needs are mostly those of the row before.
class SpatialVariance {
 public:
  // The film must outlive the use. Pixels outside `roi` are not read.
  void begin(const Film& film, const PixelRect& window, const PixelRect& roi);

  // Overwrites the variance of those pixels of a row that lack a half; those outside `roi` get +infinity. Calls go from
  // top to bottom; rows may be left out. variance[c]: the row's first pixel.
  void fill_row(int y, float* const (&variance)[3]);

 private:
  // Double means of a row, four values a pixel; the fourth is the number of halves that have samples. A pixel without
  // has four zeroes, as has the one behind the last.
  struct Means {
    std::vector<double> data;
    SplatRow splats;        // of one half
    bool complete = false;  // every pixel but the one behind has samples

    void look(const Film& film, int y, int x0, int x1);
    void clear(int width);
    double* at(int x) { return data.data() + std::size_t(x) * kLanes; }
    const double* at(int x) const { return data.data() + std::size_t(x) * kLanes; }
  };

  void push(int y);
  void look(int y, Means& means) const;

  const Film* film_ = nullptr;
  PixelRect window_, roi_;
  int x0_ = 0, x1_ = 0;  // columns that have terms
  int pushed_ = 0;       // rows above this one are in
  Means here_, below_;
  BoxRows terms_;
  std::vector<float> sums_, estimates_[3];
};

}  // namespace helio
