// What pixels that show one surface make of their directions together.
#include "renderer/trace/gbuffer/view_reweighting.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "tests/support/random.h"

namespace helio::test {
namespace {

ViewEvidence evidence(float off, float scatter, int directions = 4) {
  ViewEvidence e;
  e.change = Rgb(off, off, off);
  e.off = off;
  e.scatter = scatter;
  e.directions = directions;
  e.lit = directions > 0;
  e.normal = V3f(0, 1, 0);
  return e;
}

ViewReweighting told_of(const std::vector<ViewEvidence>& all, std::size_t own = 0, float shared = 1) {
  std::vector<const ViewEvidence*> alike;
  for (const ViewEvidence& e : all) alike.push_back(&e);
  return pooled_change(all[own], alike, shared);
}

TEST(PooledChange, OnlyPixelsOfOneSurfaceAreAlike) {
  const int wall = 0, floor = 0;
  ViewEvidence a = evidence(0, 0), b = evidence(0, 0);
  a.material = b.material = &wall;
  EXPECT_TRUE(a.like(b));
  b.normal = V3f(1, 0, 0);
  EXPECT_FALSE(a.like(b));
  b.normal = a.normal;
  b.material = &floor;
  EXPECT_FALSE(a.like(b));
  b.material = &wall;
  b.pools = false;  // textured
  EXPECT_FALSE(a.like(b));
}

TEST(PooledChange, WhatAllSayIsTakenAtTheirWord) {
  const std::vector<ViewEvidence> all(9, evidence(0.5f, 1e-4f));
  EXPECT_NEAR(told_of(all).ratio.x, 1.5, 0.001);
  const std::vector<ViewEvidence> falls(9, evidence(-0.5f, 1e-4f));
  EXPECT_NEAR(told_of(falls).ratio.x, 0.5, 0.001);
}

TEST(PooledChange, ADifferenceThatNoiseDoesNotExplainIsBelieved) {
  std::vector<ViewEvidence> all(9, evidence(-0.5f, 1e-4f));
  for (std::size_t i = 0; i < 3; ++i) all[i] = evidence(1.0f, 1e-4f);  // a column that an edge of a highlight crosses
  EXPECT_NEAR(told_of(all, 0).ratio.x, 2.0, 0.01);
  EXPECT_NEAR(told_of(all, 8).ratio.x, 0.5, 0.01);
  // And where it does explain it, all say the same.
  for (ViewEvidence& e : all) e.scatter = 1;
  EXPECT_FLOAT_EQ(told_of(all, 0).ratio.x, told_of(all, 8).ratio.x);
}

// Changes that are nothing but noise of a long tail: nine of ten directions say -0.1, the tenth 0.9, and with it that
// it knows badly. By their own scatter falls would be believed and rises not.
TEST(PooledChange, RisesAreShrunkNoMoreThanFalls) {
  Random random(3);
  constexpr int kPixels = 20'000;
  double alone = 0, pooled = 0;
  for (int i = 0; i < kPixels; ++i) {
    std::vector<ViewEvidence> all;
    for (int k = 0; k < 9; ++k) {
      float ratios[4], mean = 0, scatter = 0;
      for (float& ratio : ratios) mean += (ratio = random.next_double() < 0.1 ? 0.9f : -0.1f) / 4;
      for (const float ratio : ratios) scatter += (ratio - mean) * (ratio - mean) / 16;
      all.push_back(evidence(mean, scatter * 4 / 3));
    }
    pooled += double(told_of(all).ratio.y - 1) / kPixels;
    alone += double(told_of({all[0]}).ratio.y - 1) / kPixels;
  }
  EXPECT_LT(alone, -0.03);
  EXPECT_LT(std::abs(pooled), 0.3 * std::abs(alone)) << pooled;
}

TEST(PooledChange, PixelsThatDrawOnOneKnowNoMoreThanOne) {
  std::vector<ViewEvidence> all(9, evidence(0.5f, 0.5f));
  const ViewReweighting apart = told_of(all, 0, 1), one = told_of(all, 0, 9);
  EXPECT_GT(one.error, 1.5f * apart.error);
  EXPECT_LT(one.ratio.x, apart.ratio.x);
}

TEST(PooledChange, WithoutDirectionsNeighboursTell) {
  std::vector<ViewEvidence> all(9, evidence(0.5f, 1e-4f));
  all[0] = evidence(0, 0, 0);
  EXPECT_NEAR(told_of(all).ratio.x, 1.5, 0.001);
  std::vector<ViewEvidence> none(9, evidence(0, 0, 0));
  none[0].unseen = 0.7f;
  none[0].albedo = Rgb(0.9f, 0.9f, 0.9f);
  const ViewReweighting nothing = told_of(none);
  EXPECT_EQ(nothing.ratio, none[0].albedo);
  EXPECT_EQ(nothing.error, 0.7f);
}

TEST(PooledChange, WhatIsKeptAsItWasDoesNotArriveAsWell) {
  std::vector<ViewEvidence> all(9, evidence(0, 1e-4f));
  for (ViewEvidence& e : all) {
    e.arrival = Rgb(0.4f, 0.2f, 0.1f);
    e.unknown = 0.5f;
  }
  EXPECT_NEAR(told_of(all).arrival.x, 0.2f, 1e-6f);
  EXPECT_NEAR(told_of(all).arrival.z, 0.05f, 1e-6f);
}

// Where no light was known of, what comes into view is all that there is.
TEST(PooledChange, BlackPixelsWaitForLight) {
  std::vector<ViewEvidence> none(4, evidence(0, 0, 0));
  for (ViewEvidence& e : none) e.arrival = Rgb(0.4f, 0.2f, 0.1f);
  EXPECT_NEAR(told_of(none).arrival.x, 0.4f, 1e-6f);
}

// Pixels all of whose light came by delta lobes say nothing of the others' change, but that it is not theirs.
TEST(PooledChange, DeltaLobesCountAsWhatIsNotKnown) {
  std::vector<ViewEvidence> all(9, evidence(-0.5f, 1e-6f));
  for (std::size_t i = 0; i < 6; ++i) {
    all[i] = evidence(0, 0, 0);
    all[i].lit = true;
    all[i].unknown = 1;
  }
  const ViewReweighting change = told_of(all, 0);
  EXPECT_GT(change.ratio.x, 0.8f);
  EXPECT_GT(change.error, 0.6f);
}

TEST(PooledChange, LargePixelsKnowNoLessTogetherThanAlone) {
  std::vector<ViewEvidence> all(9, evidence(0.5f, 0.5f));
  for (ViewEvidence& e : all) e.unseen = 0.8f;
  EXPECT_LE(told_of(all, 0, 1e9f).error, 1.001f * told_of({all[0]}).error);
  EXPECT_TRUE(std::isfinite(told_of(all, 0, INFINITY).error));
}

TEST(PooledChange, RatiosAndErrorsStayNumbers) {
  for (const float off : {-1.0f, 0.0f, 1e-30f, kMostRatio - 1}) {
    for (const float scatter : {0.0f, 1e-30f, 100.0f, 1e20f}) {
      std::vector<ViewEvidence> all(9, evidence(off, scatter));
      all[0] = evidence(-1, scatter);
      all[1].change = Rgb(kMostRatio - 1, -1, 0);
      for (std::size_t own = 0; own < 3; ++own) {
        const ViewReweighting change = told_of(all, own);
        for (int c = 0; c < 3; ++c) EXPECT_TRUE(change.ratio[c] >= -1e-6f && change.ratio[c] <= 1.001f * kMostRatio);
        EXPECT_TRUE(change.error >= 0 && change.error <= kMostRatio) << change.error;
      }
    }
  }
}

}  // namespace
}  // namespace helio::test
