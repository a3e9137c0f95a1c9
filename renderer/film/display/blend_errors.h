// Errors of the film and of its filtered picture around a pixel, as the halves tell of them, and how much of the latter
// to show (James and Stein 1961, with estimated variances).
//
// The film's mean is m = (A + B) / 2, the filtered F = (F_A + F_B) / 2. Over a neighbourhood of 11x11, summed over
// channels:
//
//     V = variance of m, pooled (variance_pool.h)            R = mean of (F - m)^2
//     M = mean of (F_A - F_B)^2 / 4 + b, b = mean of (F_A - A)(F_B - B)
//
// M is the error of F: what noise is left, and its bias, squared; the halves are independent, so the product of their
// residuals has no noise in its expectation. Of a positive b with standard error e, b^3 / (b^2 + e^2 / 4) counts; of
// others nothing. E[(F - m)^2] = V + M - 2 C gives their covariance C, and m + s (F - m) has the least error at
// s = (V - M + R) / (2 R), that error being (1 - s) V + s M - s (1 - s) R.
//
// Two classes of pixels know nothing of each other: those whose first hits differ from a neighbour's, and others.
// Nearly all of the error is in the former, which mix surfaces.
#pragma once

#include <vector>

#include "renderer/film/core/film.h"

namespace helio {

// The squared errors in one neighbourhood.
struct BlendErrors {
  float film = 0, filtered = 0, apart = 0;  // V | M | R
  bool known = false;                       // some pixel of the class has samples in both halves

  float of_share(float share) const;  // of m + s (F - m)
};

class BlendEvidence {
 public:
  // One pixel's part, summed over channels. Only pixels with samples in both halves have one.
  struct Pixel {
    float variance, noise, residuals, apart;  // V | (F_A - F_B)^2 / 4 | (F_A - A)(F_B - B) | (F - m)^2
    float brightness;                         // of F, in units of the picture's mean
  };
  static constexpr int kRadius = 5;

  // Clears the sums. Pixels of the window will be asked for.
  void begin(const PixelRect& window);
  // The pixel is at most kRadius beyond the window.
  void add(int x, int y, bool border, const Pixel& pixel);
  // After all pixels, before the questions.
  void average();

  // s for errors over the square of what is shown, so that bright pixels do not decide for dark neighbours. 0 where
  // nothing is known.
  float best_share(int x, int y, bool border) const;
  BlendErrors errors(int x, int y, bool border) const;

 private:
  // Errors as they are: V, noise, residuals, their square, R; relative ones: V - noise + R, residuals, their square, R;
  // and the number of pixels.
  enum Term {
    kVariance,
    kNoise,
    kResiduals,
    kSquares,
    kApart,
    kRelGain,
    kRelResiduals,
    kRelSquares,
    kRelApart,
    kCount,
    kTerms
  };
  std::size_t wide_at(int x, int y) const {
    return std::size_t(y - window_.y0 + kRadius) * std::size_t(window_.width() + 2 * kRadius) +
           std::size_t(x - window_.x0 + kRadius);
  }
  std::size_t at(int x, int y) const {
    return std::size_t(y - window_.y0) * std::size_t(window_.width()) + std::size_t(x - window_.x0);
  }

  PixelRect window_;
  std::vector<float> terms_[2][kTerms];  // by class: of pixels, after average() of neighbourhoods
  std::vector<float> rows_[3];           // sums of 2, 4 and 8 rows
};

}  // namespace helio
