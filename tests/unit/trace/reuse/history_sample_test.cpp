// What pixels that are looked up say together, from sums that are written by hand.
#include "renderer/trace/reuse/history_sample.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace helio {
namespace {

// Of a box of size `side` around `at`: the mean of a step from 0 to 1.
double step_in_box(double at, double side, double step) {
  return std::clamp((at + side / 2 - step) / side, 0.0, 1.0);
}

// Integrals over the step's place, of the squared error of a lookup and of squared second differences.
TEST(HistorySample, ResamplingIsExpectedToBeOffAsItIsAtSteps) {
  for (const double zoom : {0.5, 0.8, 1.0, 1.5, 2.0, 4.0}) {
    for (const double f : {0.0, 0.1, 0.25, 0.5, 0.75}) {
      double error2 = 0, bend2 = 0;
      constexpr double kPlaces = 1e-3;
      for (double step = -8; step < 8; step += kPlaces) {
        const auto old_pixel = [&](int i) { return step_in_box(i * zoom, zoom, step); };
        const double looked_up = (1 - f) * old_pixel(0) + f * old_pixel(1);
        const double off = looked_up - step_in_box(f * zoom, 1, step);
        const double bend = old_pixel(-1) - 2 * old_pixel(0) + old_pixel(1);
        error2 += off * off;
        bend2 += bend * bend;
      }
      const double expected = resampling_error2(float(f), float(zoom));
      if (zoom == 1 && f == 0) {
        EXPECT_EQ(expected, 0);
      } else if (zoom == 1 || f == 0) {
        EXPECT_NEAR(expected / (error2 / bend2), 1, 0.02) << zoom << ", " << f;
      } else if (zoom > 1) {
        EXPECT_NEAR(expected / (error2 / bend2), 1, 0.4) << zoom << ", " << f;
      } else {
        // Between smaller pixels one error makes up for some of the other, which is not counted on.
        EXPECT_GE(expected / (error2 / bend2), 1) << zoom << ", " << f;
      }
    }
  }
}

// One pixel of a radiance and so many samples of each half, which scatter by their own variances.
LookupSums sums_of(float mean, float count, float variance_a, float variance_b, float bias2) {
  LookupSums sums;
  sums.means = Float8{mean, mean, mean, mean, mean, mean, 1 / count, 1 / count};
  sums.spreads = Float8{variance_a, variance_a, variance_a, variance_b, variance_b, variance_b, 0, 0};
  sums.rest = Float4{1, 1, 0, 2};
  sums.bias2 = bias2;
  for (int h = 0; h < kHalves; ++h) sums.known_spreads[h][sums.known[h]++] = {1, h == 0 ? variance_a : variance_b};
  return sums;
}

TEST(HistorySample, BiasCapsCountsByTheOtherHalfsVariance) {
  const HistorySample lookup = sums_of(3, 64, 0.5f, 2, 0.01f).weigh(0, 0, Rgb(0, 0, 0));
  EXPECT_NEAR(lookup.count[0], 1 / (1 / 64.0 + 0.01 / 2), 1e-3);
  EXPECT_NEAR(lookup.count[1], 1 / (1 / 64.0 + 0.01 / 0.5), 1e-3);
  EXPECT_NEAR(lookup.bias2, 0.01, 1e-6);
  EXPECT_EQ(lookup.age, 2);
  EXPECT_EQ(lookup.mean[1][2], 3);
}

TEST(HistorySample, BoundsAddUpWhereNewErrorsAreSquares) {
  // 0.1 carried; 0.3 of resampling and 0.4 of the change of view, 0.1 of 4, are 0.5.
  const HistorySample lookup = sums_of(4, 64, 1, 1, 0.01f).weigh(0.09f, 0.1f, Rgb(0, 0, 0));
  EXPECT_NEAR(lookup.bias2, 0.36, 1e-5);
  EXPECT_NEAR(lookup.count[0], 1 / (1 / 64.0 + 0.36), 1e-3);
}

TEST(HistorySample, WhatMayBeOffByMoreThanHalfAfterAChangeOfViewSaysNothing) {
  EXPECT_GT(sums_of(4, 64, 1, 1, 3).weigh(0, 0.01f, Rgb(0, 0, 0)).total(), 0);
  EXPECT_EQ(sums_of(4, 64, 1, 1, 4).weigh(0, 0.01f, Rgb(0, 0, 0)).total(), 0);
  // However it scatters, for what is off does that as well; and where the view is as it was its bound is its own.
  EXPECT_EQ(sums_of(4, 64, 1e6f, 1e6f, 4).weigh(0, 0.01f, Rgb(0, 0, 0)).total(), 0);
  EXPECT_GT(sums_of(4, 64, 1, 1, 4).weigh(0, 0, Rgb(0, 0, 0)).total(), 0);
  EXPECT_EQ(sums_of(4, 64, 1, 1, 0).weigh(0, 0.6f, Rgb(0, 0, 0)).total(), 0);
}

TEST(HistorySample, LightThatArrivesIsAddedAndDoubtedByHalf) {
  const HistorySample lookup = sums_of(4, 64, 1, 1, 0).weigh(0, 0, Rgb(1, 1, 1));
  EXPECT_EQ(lookup.mean[0][0], 5);
  EXPECT_NEAR(lookup.bias2, 0.25, 1e-6);
}

TEST(HistorySample, WhatIsNoNumberSaysNothing) {
  for (const float bad : {std::numeric_limits<float>::infinity(), std::numeric_limits<float>::quiet_NaN()}) {
    EXPECT_EQ(sums_of(bad, 64, 1, 1, 0).weigh(0, 0, Rgb(0, 0, 0)).total(), 0);
    EXPECT_EQ(sums_of(1, 64, 1, 1, bad).weigh(0, 0, Rgb(0, 0, 0)).total(), 0);
  }
  LookupSums nothing;
  EXPECT_EQ(nothing.weigh(0, 0, Rgb(0, 0, 0)).total(), 0);
  // Without scatter any error of a half is too much, and none leaves it as it was.
  EXPECT_LT(sums_of(0, 64, 0, 0, 0.01f).weigh(0, 0, Rgb(0, 0, 0)).total(), 1e-30);
  EXPECT_EQ(sums_of(0, 64, 0, 0, 0).weigh(0, 0, Rgb(0, 0, 0)).total(), 128);
}

}  // namespace
}  // namespace helio
