// A round of allocation, from its first sweep to its targets.
#pragma once

#include "renderer/film/allocation/sample_allocation.h"
#include "renderer/film/core/film.h"
#include "renderer/film/core/sample_targets.h"

namespace helio::test {

inline void allocate_round(Film& film, const AllocationSettings& settings, const AllocationRequest& request) {
  const auto work = make_allocation(film, film.bounds(), settings, request);
  for (int sweep = 0; sweep < work->sweeps(); ++sweep) {
    for (std::size_t part = 0; part < work->parts(); ++part) work->run(sweep, part);
    work->finish_sweep(sweep);
  }
}

// Of the window's pixels.
inline double mean_target(const Film& film, int h, const PixelRect& window) {
  double sum = 0;
  for (int y = window.y0; y < window.y1; ++y) {
    for (int x = window.x0; x < window.x1; ++x) sum += film.targets()->target(h, x, y);
  }
  return sum / double(window.area());
}

}  // namespace helio::test
