// What splats add to a row of a half's pixels, beside the samples of earlier pictures that these carry.
//
// Carried samples stand for all light, splats of their own picture included. A half's mean is therefore
//
//     (N_c m_c + n_f (f + s)) / (N_c + n_f) = sum / count + share s,    share = n_f / (N_c + n_f),
//
// m_c: mean of the N_c carried samples, f: of the n_f fresh ones, s: of the splats over all light paths of the half.
// Where no fresh sample fell the share is zero, whatever light paths have brought by then. The share follows counts
// alone, which no sample of the half chose, so the mean stays unbiased. Where counts differ it is not the share of
// least variance: a pixel's many fresh samples make its splats count for more, though they are as noisy as its
// neighbours'.
//
// The half's deviations, too, take a fresh sample for one of the light that camera paths bring, and so for one that is
// off by the splats' part of m_c. Of two groups the sum of squared deviations is that inside them plus
// N_c n_f / count (difference of their means)^2, so what makes it right is known exactly:
// N_c n_f / count [(m_c - f - s)^2 - (m_c - f)^2].
#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

#include "renderer/film/core/film.h"
#include "renderer/film/core/lanes.h"

namespace helio {

// Kept from row to row, for its memory. Of a film without splats everything is zero, at no cost.
class SplatRow {
 public:
  // Columns [x0, x1) of row y. Without `spreads` there are means alone.
  void look(const Film& film, int half, int y, int x0, int x1, bool spreads);

  bool any() const { return any_; }  // the film has splats
  // Of a column; precondition: any(). Four doubles a pixel, the fourth 0.
  const double* means(int x) const { return means_.data() + at(x); }
  const double* variances(int x) const { return variances_.data() + at(x); }
  const double* deviations(int x) const { return deviations_.data() + at(x); }

  // What is to be added to sum / count, its variance, and what is to be added to the half's deviations.
  double mean(int x, int c) const { return any_ ? means(x)[c] : 0; }
  double variance(int x, int c) const { return any_ ? variances(x)[c] : 0; }
  double deviation(int x, int c) const { return any_ ? deviations(x)[c] : 0; }

  // Variance of one of the pixel's samples, with its share of the splats': count times that of the half's mean as
  // independent samples and light paths would have it. 0 for fewer than two samples.
  double sample_variance(const HalfPixel& pixel, int x, int c) const {
    if (pixel.count < 2) return 0;
    if (!any_) return pixel.deviations[c] / (pixel.count - 1.0);
    const double deviations = std::max(0.0, double(pixel.deviations[c]) + deviation(x, c));
    return deviations / (pixel.count - 1.0) + variance(x, c) * pixel.count;
  }

 private:
  std::size_t at(int x) const { return std::size_t(x - x0_) * kLanes; }

  bool any_ = false;
  int x0_ = 0;
  std::vector<double> means_, variances_, deviations_;
};

}  // namespace helio
