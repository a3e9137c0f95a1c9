// Positions in the picture drawn from a pixel's reconstruction filter (Ernst, Stamminger and Greiner 2006, "Filter
// Importance Sampling").
//
// Every sample counts with weight one, in its own pixel alone, so that the errors of neighbours stay independent; where
// a renderer adds each sample to all pixels whose filters reach it they are correlated, which looks smoother and
// averages out no faster. The expected picture is the same. Nothing is sampled beyond the film: a pixel near its edge
// is the mean over the part of its filter that lies on the film.
#pragma once

#include <span>

#include "renderer/base/pixel_filter.h"

namespace helio {

// Along one axis: distance from the pixel's centre in pixels, drawn from the filter cut off at [low, high], low < 0 <
// high, and normalised there. u in [0, 1]; the result never falls as u grows. box: u - 0.5, whatever low and high are.
// The density of the Gaussian is that of 1024 linear pieces to each side, within 2e-6 of its peak.
double sample_pixel_filter(const PixelFilter& filter, double u, double low, double high);
// With which density, per pixel, the above returns x; box: 1 in [-0.5, 0.5).
double pixel_filter_density(const PixelFilter& filter, double x, double low, double high);
// Of the interval around 0 beyond which that is 0.
double pixel_filter_radius(const PixelFilter& filter);

// The Gaussian of deviation 1 that the functions above use, in 1024 linear pieces over [0, 4], for tracers on other
// devices: its values at the ends of the pieces, and its integral from 0 to there. 1025 numbers each.
struct GaussianPieces {
  std::span<const double> density, integral;
};
GaussianPieces gaussian_pieces();

}  // namespace helio
