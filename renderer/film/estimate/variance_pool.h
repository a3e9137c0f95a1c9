// Variance of the mean, per pixel and channel, pooled over a 7x7 neighbourhood.
//
// The halves A and B are independent estimates of the same pixel, so d = ((A - B) / 2)^2 has the variance of
// (A + B) / 2 as its expectation, whatever the sampler and the sample counts. The sample variance over n has not: for
// stratified points it overstates the error. One d has a relative standard deviation of at least 1.4, so d is averaged
// over the neighbourhood, D. The sample variance of the pixel's own samples over n, q, is wrong in scale but right in
// shape: q over its own neighbourhood mean Q tells where in the neighbourhood the noise sits. The estimate is
//
//     D (1/2 + 1/2 q/Q)
//
// It keeps the mean of D, is at least half of D (a pixel that missed a rare event does not report certainty while a
// neighbour saw it), and is zero only where all d of the neighbourhood are zero. Where some pixel of the neighbourhood
// has a half with fewer than two samples, q is unknown and the estimate is D.
//
// Where counts differ from pixel to pixel (FilmState::counts_differ), d and q are first made those of a single sample,
// times n of 1 / n = (1 / n_A + 1 / n_B) / 4, and the estimate is divided by the pixel's own n. That takes neighbours
// for as noisy as the pixel, and counts tell that they are not: what has less than a fourth of the samples or more than
// four times as many has them for showing something else (a border that carries nothing, a lamp). So where there are
// such pixels, D is
//
//     (sum of d over the N that have about as many + D over all) / (N + 1)
//
// and Q is over the N (film/estimate/similar_counts.h). A pixel that is alone with its count gets half of what its own halves
// say and half of what all do; of N it gets at least 1 / (2 (N + 1)) of D over all, so that pixels with few samples
// that have missed what better known ones around them met still say that they may have. By D over all, a box lit by way
// of its ceiling alone reported 2.0 times its error after a step aside, for its borders, with two samples each, are
// beside bright strips with thirty; 1.2 times since.
//
// Splats (film/splats/splat_buffer.h) are part of A, B and q. They do not depend on the pixel's own count. Where counts differ
// their part is right for pixels with as many as the mean of those that are pooled, too large for those with fewer and
// too small for those with more, by half as much as the counts where q is known. The picture's error
// (film/estimate/estimate_error.cpp) is not pooled and knows nothing of this.
//
// A pixel with samples in one half only gets the mean over the neighbourhood of (x_i - x_j)^2 / 2 over right and lower
// neighbours (von Neumann 1941): the variance of one sampled half where the picture is flat, more where it is not. A
// pixel without samples, or without any such neighbour, gets +infinity.
//
// Zero is thus reported where the halves of the whole neighbourhood agree to the bit, black included. That is what was
// observed, not a proof: see FilmError.
#pragma once

#include <functional>
#include <vector>

#include "renderer/film/core/film.h"
#include "renderer/film/estimate/pixel_row.h"

namespace helio {

// Told of each row of the window, from top to bottom; the row covers at least the window's columns.
using RowVisitor = std::function<void(const PixelRow& row)>;

// Fills variance[c] with window.area() values, row-major; finite values lie in {0} and [FLT_MIN, FLT_MAX]. Pixels
// outside `roi` are read only for the visitor, if they are in the window. A value depends on its pixel's neighbourhood
// and on `roi` alone, bit for bit. Precondition: window and roi lie in the film.
void pool_variance(const Film& film, const PixelRect& window, const PixelRect& roi, const RowVisitor& visit_row,
                   std::vector<float> (&variance)[3]);

}  // namespace helio
