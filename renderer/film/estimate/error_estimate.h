// estimate_error() in parts, for callers that share the work between threads or must be able to stop on the way.
//
// Two sweeps: for each, run() of every part, then finish_sweep(); then result(). The parts of one sweep may be done in
// any order and by several threads at once; the result has the same bits.
#pragma once

#include <cstddef>
#include <vector>

#include "renderer/film/estimate/resolve.h"
#include "renderer/film/splats/merging_bias.h"

namespace helio {

inline constexpr double kRelativeEpsilon = 1e-2;  // relMSE = (x - r)^2 / (r^2 + 1e-2 mean(r)^2)

class ErrorEstimate {
 public:
  // The film must outlive the estimate, and its pixels in `roi` must not change between the sweeps.
  // Precondition: roi meets the film.
  ErrorEstimate(const Film& film, const PixelRect& roi);

  // Of about 512 x 32 pixels each; a part of either sweep takes well under 5 ms.
  std::size_t parts() const { return parts_.size(); }
  int sweeps() const { return 2; }
  void run(int sweep, std::size_t part);
  void finish_sweep(int sweep);
  // After the last sweep.
  FilmError result() const;

  struct Sums {
    double squared = 0;                                 // of d = ((A - B) / 2)^2
    double relative = 0;                                // of d / (r^2 + epsilon)
    double unproven = 0;                                // unproven black pixels, and of these:
    double unproven_samples = 0, unproven_inverse = 0;  // samples, 1 / samples
  };

 private:
  void look_over(std::size_t part);
  void finish_look();
  void add_up(std::size_t part);

  struct Part {
    PixelRect window;
    bool paired = true;   // every pixel has samples in both halves
    double radiance = 0;  // sum over pixels and channels
    // Largest sum of squares over sum: at most the largest sample, and it where all are alike; of splats, over the
    // area.
    double brightest = 0;
    MergingBias bias;
    std::vector<Sums> tiles;  // of the columns of 32x32 tiles in the window
  };

  const Film* film_;
  PixelRect roi_;
  std::vector<Part> parts_;
  bool paired_ = true;
  double epsilon_ = 0;
  double brightest_ = 0;
};

}  // namespace helio
