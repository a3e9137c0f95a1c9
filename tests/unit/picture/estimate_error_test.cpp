#include <gtest/gtest.h>

#include "renderer/film/estimate/resolve.h"
#include "tests/unit/picture/synthetic_film.h"

namespace helio {
namespace {

using test::Random;

struct TrueError {
  double mse = 0, relmse = 0;
};

// Against the known mean of each column; the epsilon is 1e-2 times the squared image mean.
template <class Mean>
TrueError true_error(const Film& film, const Mean& mean) {
  double image_mean = 0;
  for (int x = 0; x < film.width(); ++x) image_mean += mean(x) / film.width();
  TrueError error;
  const double n = double(film.width()) * film.height();
  for (int y = 0; y < film.height(); ++y) {
    for (int x = 0; x < film.width(); ++x) {
      const double r = mean(x);
      const double e = std::pow(resolve_mean(film, x, y).x - r, 2);
      error.mse += e / n;
      error.relmse += e / (r * r + 0.01 * image_mean * image_mean) / n;
    }
  }
  return error;
}

// Exponential noise over a smooth gradient of a factor of 20: skewed, and dark where relative error matters.
TEST(EstimateError, IsCalibratedOverSeeds) {
  const auto mean = [](int x) { return 0.05 * std::exp(3.0 * x / 128.0); };
  for (const int samples : {2, 8, 32}) {
    double mse = 0, true_mse = 0, relmse = 0, true_relmse = 0;
    for (int seed = 0; seed < 10; ++seed) {
      Film film(128, 96);
      Random random(std::uint64_t(seed) + 1);
      for (int half = 0; half < 2; ++half) {
        test::add_samples(film, half, samples, random,
                          [&](int x, int, int, Random& r) { return test::exponential(float(mean(x)), r); });
      }
      const FilmError estimate = estimate_error(film, film.bounds());
      const TrueError truth = true_error(film, mean);
      ASSERT_TRUE(estimate.known);
      EXPECT_NEAR(estimate.rmse / std::sqrt(truth.mse), 1.0, 0.08) << samples << " samples, seed " << seed;
      mse += estimate.rmse * estimate.rmse;
      true_mse += truth.mse;
      relmse += estimate.relmse;
      true_relmse += truth.relmse;
    }
    EXPECT_NEAR(mse / true_mse, 1.0, 0.03) << samples;
    EXPECT_NEAR(relmse / true_relmse, 1.0, 0.04) << samples;
  }
}

TEST(EstimateError, IsCalibratedForStratifiedSamples) {
  constexpr int kSamples = 16;
  double mse = 0;
  for (int seed = 0; seed < 10; ++seed) {
    Film film(64, 64);
    Random random(std::uint64_t(seed) + 1);
    for (int half = 0; half < 2; ++half) {
      test::add_samples(film, half, kSamples, random,
                        [](int, int, int k, Random& r) { return (float(k) + r.next_float()) / kSamples; });
    }
    const FilmError error = estimate_error(film, film.bounds());
    mse += error.rmse * error.rmse / 10;
  }
  EXPECT_NEAR(mse * 24.0 * kSamples * kSamples * kSamples, 1.0, 0.03);  // 1 / (24 n^3): resolve_test.cpp
}

// One column in 16 shows half a small light, 1e4 times as bright as the rest: its noise is relative to what it shows.
// The mean M of a pixel, whose relative variance is 1 / (2 n) with n samples in each half, weighs by
// E[1 / M^2] = (1 + 3 / (2 n)) / r^2 to first order.
TEST(EstimateError, RelativeErrorOfLonelyBrightPixelsIsTheirOwn) {
  const auto mean = [](int x) { return x % 16 == 8 ? 500.0 : 0.05; };
  for (const int samples : {32, 128}) {
    double relmse = 0, true_relmse = 0;
    for (int seed = 0; seed < 10; ++seed) {
      Film film(128, 96);
      Random random(std::uint64_t(seed) + 1);
      for (int half = 0; half < 2; ++half) {
        test::add_samples(film, half, samples, random, [&](int x, int, int, Random& r) {
          if (x % 16 == 8) return r.next_float() < 0.5f ? 1000.0f : 0.0f;
          return float(mean(x)) * (0.5f + r.next_float());
        });
      }
      relmse += estimate_error(film, film.bounds()).relmse;
      true_relmse += true_error(film, mean).relmse;
    }
    EXPECT_NEAR(relmse / true_relmse, 1 + 1.5 / samples, 0.07) << samples;
  }
}

// Halves differ by 2 in one 32x32 tile, by 0.02 elsewhere: errors of 1 and 0.01.
TEST(EstimateError, NamesTheWorstTile) {
  Film film(96, 80);
  Random random(1);
  const PixelRect bad{32, 32, 64, 64};
  test::add_samples(film, 0, 1, random, [](auto...) { return 1.0f; });
  test::add_samples(film, 1, 1, random, [&](int x, int y, int, Random&) { return bad.contains(x, y) ? 3.0f : 1.02f; });
  const FilmError error = estimate_error(film, film.bounds());
  // 80 rows: the second row of tiles is 48 high, so the bad tile is 32x48 and two thirds full.
  EXPECT_NEAR(error.worst_tile_rmse, std::sqrt((32.0 * 32 + 1e-4 * 32 * 16) / (32 * 48)), 1e-6);
  EXPECT_NEAR(error.rmse, std::sqrt((1024 + 1e-4 * (96 * 80 - 1024)) / (96 * 80)), 1e-6);
  const FilmError region = estimate_error(film, bad);
  EXPECT_NEAR(region.worst_tile_rmse, 1.0, 1e-12);
  EXPECT_NEAR(region.rmse, 1.0, 1e-12);
  EXPECT_NEAR(region.relmse, 1.0 / (4 + 0.04), 1e-6) << "means 2, epsilon 0.01 2^2";
}

TEST(EstimateError, ATileIsCountedWhereverTheRegionStarts) {
  Film film(1500, 40);
  Random random(1);
  test::add_samples(film, 0, 1, random, [](auto...) { return 1.0f; });
  test::add_samples(film, 1, 1, random, [](int x, int, int, Random&) { return x == 1499 ? 9.0f : 1.0f; });
  // The last tile takes what is left of the width: 1500 - 3 = 46 * 32 + 25 columns, so it has 57.
  const FilmError error = estimate_error(film, {3, 0, 1500, 40});
  EXPECT_NEAR(error.worst_tile_rmse, std::sqrt(16.0 / 57), 1e-9);
  EXPECT_NEAR(error.rmse, std::sqrt(16.0 / 1497), 1e-9);
}

TEST(EstimateError, IsUnknownWhileAHalfIsMissing) {
  Film film(8, 8);
  Random random(1);
  test::add_samples(film, 0, 4, random, [](auto...) { return 1.0f; });
  FilmError error = estimate_error(film, film.bounds());
  EXPECT_FALSE(error.known);
  EXPECT_TRUE(std::isinf(error.rmse) && std::isinf(error.relmse) && std::isinf(error.worst_tile_rmse))
      << "so that no target is met by accident";
  test::add_samples(film, 1, 4, random, [](auto...) { return 1.0f; });
  error = estimate_error(film, film.bounds());
  EXPECT_TRUE(error.known);
  EXPECT_EQ(error.unproven, 0.0);
  EXPECT_EQ(error.rmse, 0.0);
}

void set_surface(Film& film, int x0, int x1, std::uint32_t hits, float albedo) {
  for (int y = 0; y < film.height(); ++y) {
    for (int x = x0; x < x1; ++x) {
      PixelFeatures& f = film.features(x, y);
      f.count = 64;
      f.hits = hits;
      for (float& a : f.albedo) a = albedo;
    }
  }
}

TEST(EstimateError, BlackProvesNothingWhereSurfacesReflect) {
  Film film(8, 8);
  Random random(1);
  for (int half = 0; half < 2; ++half) test::add_samples(film, half, 64, random, [](auto...) { return 0.0f; });
  set_surface(film, 0, 8, 1, 0.01f);
  FilmError error = estimate_error(film, film.bounds());
  EXPECT_TRUE(error.known);
  EXPECT_EQ(error.rmse, 0.0);
  EXPECT_EQ(error.unproven, 1.0);
  EXPECT_TRUE(std::isinf(error.hidden_rmse) && std::isinf(error.hidden_relmse)) << "nothing says how bright it may be";
  // A single dim photon: what has not been seen may be as bright.
  film.half(0, 3, 3).add(Rgb(0, 0, 1e-20f));
  error = estimate_error(film, film.bounds());
  EXPECT_EQ(error.unproven, 15.0 / 64);  // those farther than 3 pixels from it
  EXPECT_GT(error.rmse, 0.0);
  EXPECT_GT(error.hidden_rmse, 0.0);
  EXPECT_LT(error.hidden_rmse, 1e-20);
}

// A carried pixel's sum may round to 0 while its deviations do not: its brightest sample is not infinite for that.
TEST(EstimateError, ACarriedSumOfZeroHidesNoInfinity) {
  Film film(32, 32);
  set_surface(film, 0, 16, 64, 0.5f);
  for (int half = 0; half < 2; ++half) {
    for (int y = 0; y < 32; ++y) {
      for (int x = 0; x < 32; ++x) {
        for (int k = 0; k < 4; ++k) film.half(half, x, y).add(Rgb(x < 16 ? 0.0f : 1.0f));
      }
    }
    film.half(half, 3, 3).deviations[1] = 1e-30f;
  }
  const FilmError error = estimate_error(film, film.bounds());
  EXPECT_GT(error.unproven, 0.0);
  EXPECT_TRUE(std::isfinite(error.hidden_rmse)) << error.hidden_rmse;
  film.half(0, 3, 3).deviations[1] = 0;
  film.half(1, 3, 3).deviations[1] = 0;
  EXPECT_EQ(error.hidden_rmse, estimate_error(film, film.bounds()).hidden_rmse);
}

TEST(EstimateError, BlackIsProvenWhereNothingIsMetOrReflects) {
  Film film(8, 8);
  Random random(1);
  for (int half = 0; half < 2; ++half) test::add_samples(film, half, 64, random, [](auto...) { return 0.0f; });
  for (const bool met : {false, true}) {
    set_surface(film, 0, 8, met ? 64 : 0, met ? 0.0f : 0.5f);
    const FilmError error = estimate_error(film, film.bounds());
    EXPECT_TRUE(error.known);
    EXPECT_EQ(error.unproven, 0.0);
    EXPECT_EQ(error.hidden_rmse, 0.0);
    EXPECT_EQ(error.hidden_relmse, 0.0);
  }
}

// A share p of all samples is bright, but none of the dark half has been seen yet although 3 / p were taken there: the
// bound is above what the half really adds.
TEST(EstimateError, HiddenErrorBoundsWhatAKeyholeMayAdd) {
  constexpr int kSide = 64, kSamples = 8;
  constexpr float kLight = 5;
  Film film(kSide, kSide);
  Random random(3);
  for (int half = 0; half < 2; ++half) {
    test::add_samples(film, half, kSamples, random, [](int x, int, int, Random&) { return x < kSide / 2 ? kLight : 0; });
  }
  set_surface(film, 0, kSide, 8, 0.5f);
  const FilmError error = estimate_error(film, film.bounds());
  EXPECT_EQ(error.rmse, 0.0);
  EXPECT_EQ(error.unproven, 0.5 - 3.0 / kSide);
  const double pixels = error.unproven * kSide * kSide, samples = 2 * kSamples * pixels;
  const double variance = 3 / samples * kLight * kLight / (2 * kSamples);  // p L^2 / n
  EXPECT_NEAR(error.hidden_rmse, std::sqrt(variance * error.unproven), 1e-12);
  const double mean = kLight / 2;
  EXPECT_NEAR(error.hidden_relmse, variance * error.unproven / (0.01 * mean * mean), 1e-12);
}

}  // namespace
}  // namespace helio
