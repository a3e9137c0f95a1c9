// Takes back what fresh samples contradict of the history that pixels carry.
//
// For a half, d is the difference of its fresh mean, splats included, and its carried one. The halves' differences are
// independent but for what reuse has added to both, so the mean of d_A d_B is the square of that, whatever the noise.
// Over 7x7 pixels it is held against the deviation that it would have by chance, from the variance of the samples as
// history knows it: what few samples have seen would take light that comes rarely for an error of those that saw it.
// Beyond four deviations the bias is what was measured, and history counts for as much less as it would have if that
// had been known (LookupSums::weigh()).
#pragma once

#include <cstddef>
#include <numeric>
#include <vector>

#include "renderer/film/core/film.h"

namespace helio {

class HistoryRejection {
 public:
  // The film, which has history, outlives this; nobody else writes to it meanwhile.
  HistoryRejection(Film& film, const PixelRect& region);

  // Two sweeps; as FrameStage has them. A part takes well under 5 ms.
  std::size_t parts() const { return windows_.size(); }
  int sweeps() const { return 2; }
  void run(int sweep, std::size_t part);
  void finish_sweep(int) {}
  // Samples of both halves, after the last sweep.
  double taken_back() const { return std::accumulate(taken_.begin(), taken_.end(), 0.0); }

 private:
  void look(const PixelRect& window);
  double take_back(const PixelRect& window);

  Film& film_;
  PixelRect region_;
  std::vector<PixelRect> windows_;
  std::vector<double> taken_;  // of the parts
};

}  // namespace helio
