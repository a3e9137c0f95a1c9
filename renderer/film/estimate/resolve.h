// Film -> pixels: mean radiance, variance of that mean, sample counts and the picture's error.
#pragma once

#include <vector>

#include "renderer/film/core/film.h"
#include "renderer/film/estimate/channels.h"

namespace helio {

// Mean radiance of the pixel: halves weighted equally when both have samples (weights by count are biased when counts
// depend on the samples), else the half that has some; 0 without samples. Splats of such a half are in its mean.
Rgb resolve_mean(const Film& film, int x, int y);

// `roi` is the part of the film that is being rendered: the pooling neighbourhood (7x7, variance_pool.h) never reads
// outside it, and its result does not depend on how the film is cut into windows. Variance reads pixels up to 3 beyond
// the window: nobody may be writing them. Variance is +infinity where nothing is known (no samples) and 0 where the
// halves agree to the bit in the whole neighbourhood, black included: that is an observation, no proof.
// `mean_samples`: fresh ones per pixel of the picture, both halves, which density is relative to; 0: counts do not
// differ, and density is 1.
ResolvedTile resolve_tile(const Film& film, const PixelRect& window, const PixelRect& roi, unsigned channels,
                          double mean_samples = 0);

// Estimated error of the whole picture, from the halves. While `known` is false, the rmse and relmse fields are
// +infinity and the others 0.
//
// A pixel is unproven black when neither it nor any of its 7x7 neighbourhood has seen light although its samples met
// surfaces that reflect: it may be black, or lit through a keyhole that no path has found yet. Of N such samples that
// all returned nothing, at most a share of 3 / N would have returned something (95 %: the rule of three); taken as the
// brightest seen anywhere, that bounds what the error may hide. A pixel whose samples met nothing, or what reflects
// nothing, is black.
struct FilmError {
  double rmse = 0;             // root of the mean over pixels and channels of the variance of the mean
  double relmse = 0;           // mean of variance / (mean^2 + 1e-2 (image mean)^2), as metrics/error_metrics.h
  double worst_tile_rmse = 0;  // largest rmse of a tile of 32x32, or up to 63 pixels a side at the region's far edges
  double unproven = 0;         // share of the pixels that are unproven black, [0, 1]
  double hidden_rmse = 0;      // bound on the rmse that they add; +infinity when no sample of the picture saw light
  double hidden_relmse = 0;    // the same as relMSE
  // Merging light paths: by how much the mean luminance is off, by estimate, and the standard error of that. Its
  // square, block by block, is in rmse and relmse.
  double bias = 0, bias_error = 0;
  bool known = false;          // false: fewer than one sample in some half of some pixel
};
FilmError estimate_error(const Film& film, const PixelRect& roi);

}  // namespace helio
