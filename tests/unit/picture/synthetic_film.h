// Films whose noise is known: what the estimates are held against.
#pragma once

#include <cmath>
#include <vector>

#include "renderer/film/core/film.h"
#include "renderer/film/estimate/resolve.h"
#include "tests/support/random.h"

namespace helio::test {

// Adds `count` samples to one half of every pixel: sample(x, y, k, random) is the k-th one's radiance.
template <class Sample>
void add_samples(Film& film, int half, int count, Random& random, const Sample& sample) {
  for (int y = 0; y < film.height(); ++y) {
    for (int x = 0; x < film.width(); ++x) {
      for (int k = 0; k < count; ++k) film.half(half, x, y).add(Rgb(sample(x, y, k, random)));
    }
  }
}

// Exponential noise around `mean`: variance mean^2 a sample, skewed as light is.
inline float exponential(float mean, Random& random) {
  return float(-mean * std::log(1.0 - random.next_double()));
}

inline double mean_of(const std::vector<float>& values) {
  double total = 0;
  for (const float v : values) total += v;
  return total / double(values.size());
}

inline std::vector<float> variance_of(const Film& film, int channel = 0) {
  return resolve_tile(film, film.bounds(), film.bounds(), kResolveVariance).variance[channel];
}

}  // namespace helio::test
