// How densely pictures are sampled around a gaze.
#include "renderer/base/gaze_density.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace helio {
namespace {

constexpr int kHeight = 720;
constexpr double kDistance = 2;
constexpr Gaze kMiddle{640, 360};

// Pixels from the gaze at an angle.
double pixels_at(double degrees) {
  return kDistance * kHeight * std::tan(degrees * std::numbers::pi / 180);
}

TEST(GazeDensity, FallsWithTheAngle) {
  const GazeDensity density(kMiddle, kHeight, kDistance);
  const auto at = [&](double degrees) { return density.at(float(640 - pixels_at(degrees)), 360); };
  EXPECT_EQ(at(0), 1);
  EXPECT_NEAR(at(GazeDensity::kFoveaDegrees), 1, 0.02);
  // One more e2 halves what is told apart along either axis.
  EXPECT_NEAR(at(GazeDensity::kFoveaDegrees + GazeDensity::kHalvingDegrees), 0.25, 0.01);
  EXPECT_NEAR(at(GazeDensity::kFoveaDegrees + 3 * GazeDensity::kHalvingDegrees), 1.0 / 16, 0.005);
  EXPECT_FLOAT_EQ(at(60), float(GazeDensity::kLeastDensity));
  EXPECT_NEAR(density.radius(), pixels_at(GazeDensity::kFoveaDegrees + 7 * GazeDensity::kHalvingDegrees), 0.01);
}

// No ring: it never rises on the way out, and no step of a pixel changes it by much.
TEST(GazeDensity, IsSmooth) {
  const GazeDensity density(kMiddle, kHeight, kDistance);
  for (int x = 641; x < 2000; ++x) {
    const float before = density.log_at(float(x - 1), 360), here = density.log_at(float(x), 360);
    EXPECT_LE(here, before);
    EXPECT_LT(before - here, 0.06f) << x;
  }
}

TEST(GazeDensity, OffTheFilmTheNearestPartIsSeenBest) {
  const GazeDensity left({-500, 360}, kHeight, kDistance);
  EXPECT_GE(left.at(0.5f, 360.5f), left.at(100.5f, 360.5f));
  EXPECT_EQ(left.most_in({0, 0, 1280, 720}), left.at(0, 360));
  for (const double far : {kMostGazePixels, -kMostGazePixels}) {
    const GazeDensity none({far, far}, kHeight, kDistance);
    EXPECT_FLOAT_EQ(none.at(640, 360), float(GazeDensity::kLeastDensity));
    EXPECT_NEAR(none.mean_over({0, 0, 1280, 720}), GazeDensity::kLeastDensity, 1e-6);
  }
}

TEST(GazeDensity, MeansAreThoseOfThePixels) {
  const PixelRect all{0, 0, 1280, 720};
  const GazeDensity density({300, 500}, kHeight, kDistance);
  double sum = 0, bounded = 0;
  for (int y = 0; y < all.y1; ++y) {
    for (int x = 0; x < all.x1; ++x) {
      const double at = double(density.at(float(x) + 0.5f, float(y) + 0.5f));
      sum += at;
      bounded += std::max(at, 0.125);
    }
  }
  EXPECT_NEAR(density.mean_over(all), sum / double(all.area()), 0.01 * sum / double(all.area()));
  EXPECT_NEAR(density.mean_over(all, 0.125), bounded / double(all.area()), 0.01 * bounded / double(all.area()));
}

TEST(GazeDensity, ExtremesAreDensities) {
  for (const int height : {1, 65536}) {
    for (const double distance : {0.25, 20.0}) {
      const GazeDensity density({0, 0}, height, distance);
      for (const float x : {0.0f, 0.5f, 100.0f, 65536.0f, std::numeric_limits<float>::max()}) {
        EXPECT_GE(density.at(x, x), float(GazeDensity::kLeastDensity) * 0.999f);
        EXPECT_LE(density.at(x, x), 1);
      }
    }
  }
}

}  // namespace
}  // namespace helio
