// Bounds on how far a picture has changed, from pairs of noisy differences.
#include "renderer/film/history/change_bound.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "tests/support/random.h"

namespace helio::test {
namespace {

constexpr int kSide = 30;

Rgb grey(double x) {
  return Rgb(float(x), float(x), float(x));
}

// Radiance 1 before; after it `change(x, y)`, a function that may draw noise, more.
template <class Change>
ChangeBound bound_of(const Change& change, double before = 1) {
  ChangeBound bound(kSide, kSide);
  for (int y = 0; y < kSide; ++y) {
    for (int x = 0; x < kSide; ++x) {
      const Rgb from[kHalves] = {grey(before), grey(before)};
      const double a = change(x, y), b = change(x, y);
      bound.set(x, y, from, {grey(before + a), grey(before + b)});
    }
  }
  bound.finish();
  return bound;
}

TEST(ChangeBound, ASteadyChangeIsItsSquare) {
  const ChangeBound bound = bound_of([](int, int) { return -0.1; });
  EXPECT_EQ(bound.changed_share(), 1);
  EXPECT_GE(bound.squared(15, 15), 0.00999);
  EXPECT_LT(bound.squared(15, 15), 0.011);
}

TEST(ChangeBound, NothingSeenIsNotNothing) {
  const ChangeBound bound = bound_of([](int, int) { return 0.0; });
  EXPECT_NEAR(bound.changed_share(), 1.0 / (2 * kSide * kSide + 1), 1e-12);
  // Of the 20x20 cells around one sample more, with that probability, by the radiance of 1; 24 of them to the 98 of
  // 7x7; by chance over 49 cells.
  const double expected = bound.changed_share() / 801 * 24 / 122 / 7;
  EXPECT_NEAR(bound.squared(15, 15), expected, 1e-6 * expected);
  EXPECT_GT(bound.squared(0, 0), bound.squared(15, 15));  // a corner has fewer neighbours
}

TEST(ChangeBound, ChangeElsewhereRaisesWhatNobodySaw) {
  const ChangeBound none = bound_of([](int, int) { return 0.0; });
  const ChangeBound corner = bound_of([](int x, int y) { return x < 8 && y < 8 ? 1.0 : 0.0; });
  EXPECT_GT(corner.squared(25, 25), 10 * none.squared(25, 25));
  EXPECT_LT(corner.squared(25, 25), 1e-3);
}

TEST(ChangeBound, OneCellThatChangedForSureIsNotBlurred) {
  const ChangeBound bound = bound_of([](int x, int y) { return x == 15 && y == 15 ? 0.2 : 0.0; });
  EXPECT_GT(bound.squared(15, 15), 0.03);
  EXPECT_GT(bound.squared(16, 15), 0.04 / 9 * 0.9);
  EXPECT_LT(bound.squared(20, 15), 1e-3);
}

// Light that comes by one path in fifty: the change of the mean is a fiftieth of what such a sample shows.
TEST(ChangeBound, RareChangesAreBoundedByTheirChance) {
  Random random(3);
  const double p = 0.02;
  const ChangeBound bound = bound_of([&](int, int) { return random.next_float() < p ? 1.0 : 0.0; });
  double sum = 0;
  int below = 0, beyond_use = 0;
  for (int y = 0; y < kSide; ++y) {
    for (int x = 0; x < kSide; ++x) {
      const double squared = bound.squared(x, y);
      below += squared < 0.5 * p * p;
      beyond_use += !std::isfinite(squared);
      sum += std::isfinite(squared) ? squared : 0;
    }
  }
  // P + sqrt(s^4 / n): p^2 and p / 7 or so; far below the mean square of a sample, p.
  const double mean = sum / (kSide * kSide - beyond_use);
  EXPECT_GT(mean, p * p);
  EXPECT_LT(mean, 0.4 * p);
  EXPECT_EQ(below, 0);                          // also where, of 98 samples, none has seen it
  EXPECT_LT(beyond_use, 0.02 * kSide * kSide);  // where by chance both samples of a cell have
}

// Noise of either sign, as of lights that are chosen otherwise than before, is no change.
TEST(ChangeBound, NoiseAloneIsBoundedByItsChance) {
  Random random(5);
  const ChangeBound bound = bound_of([&](int, int) { return random.next_float() < 0.5f ? 0.2 : -0.2; });
  double sum = 0;
  for (int y = 3; y < kSide - 3; ++y) {
    for (int x = 3; x < kSide - 3; ++x) sum += bound.squared(x, y);
  }
  EXPECT_LT(sum / ((kSide - 6) * (kSide - 6)), 0.04 / 3);  // 0.04 / 7 by chance, and what P has of it
}

TEST(ChangeBound, WhatHasChangedByAQuarterIsBeyondUse) {
  EXPECT_TRUE(std::isfinite(bound_of([](int, int) { return 0.2; }).squared(15, 15)));
  EXPECT_FALSE(std::isfinite(bound_of([](int, int) { return 0.4; }).squared(15, 15)));
  EXPECT_FALSE(
      std::isfinite(bound_of([](int, int) { return 1e-6; }, 0).squared(15, 15)));  // light where there was none
}

TEST(ChangeBound, RoundingIsNoChange) {
  EXPECT_LT(bound_of([](int, int) { return 1e-6; }).changed_share(), 1e-3);
}

TEST(ChangeBound, ExtremesStayBounds) {
  const double infinity = std::numeric_limits<double>::infinity();
  // Not finite: not known, and nothing else is.
  EXPECT_EQ(bound_of([&](int, int) { return infinity; }).squared(3, 3), infinity);
  EXPECT_EQ(bound_of([&](int, int) { return std::nan(""); }).squared(3, 3), infinity);
  const ChangeBound unset(4, 4);
  EXPECT_EQ(unset.squared(0, 0), infinity);
  // Squares beyond a float.
  EXPECT_EQ(bound_of([&](int, int) { return 1e25; }).squared(3, 3), infinity);
  EXPECT_TRUE(std::isfinite(bound_of([&](int, int) { return 1e11; }, 1e13).squared(3, 3)));
  EXPECT_EQ(bound_of([&](int, int) { return 0.0; }, 0).squared(3, 3), 0);  // black before and after, everywhere
  EXPECT_GE(bound_of([&](int x, int y) { return x + y == 0 ? std::nan("") : 0.1; }).squared(0, 0), 0.01);
}

}  // namespace
}  // namespace helio::test
