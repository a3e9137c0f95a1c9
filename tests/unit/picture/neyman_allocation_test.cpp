// Counts from the other half's pilot: in proportion to what samples scatter, over the root of what they cost.
#include "renderer/film/allocation/neyman_allocation.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <vector>

#include "renderer/film/allocation/sample_demand.h"
#include "renderer/film/core/sample_targets.h"
#include "tests/support/allocation_rounds.h"

namespace helio {
namespace {

// Columns of blocks, for costs are kept by block; two pixels of 7x7 neighbourhoods see across their border.
constexpr int kWidth = 8 * kFilmBlock, kHeight = 2 * kFilmBlock;
constexpr PixelRect kLeft = {0, 0, kWidth / 2 - 4, kHeight}, kRight = {kWidth / 2 + 4, 0, kWidth, kHeight};
constexpr int kPilot = 8;

using OfPixel = std::function<float(int half, int x)>;

// A pilot of kPilot samples of each half everywhere, of mean 1.
Film pilot(const OfPixel& deviation, const OfPixel& rays) {
  Film film(kWidth, kHeight, {.targets = true});
  for (int h = 0; h < kHalves; ++h) {
    for (int y = 0; y < kHeight; ++y) {
      for (int x = 0; x < kWidth; ++x) {
        for (int i = 0; i < kPilot; ++i) film.half(h, x, y).add(Rgb(1 + (i % 2 ? 1 : -1) * deviation(h, x)));
      }
    }
    for (int y = 0; y < kHeight; y += kFilmBlock) {
      for (int x = 0; x < kWidth; x += kFilmBlock) {
        const std::uint64_t paths = kPilot * kFilmBlock * kFilmBlock;
        film.add_work(h, x, y, std::uint64_t(rays(h, x) * float(paths)), paths);
      }
    }
  }
  return film;
}

void allocate(Film& film, double mean, std::uint64_t seed = 0) {
  AllocationSettings settings;
  settings.min_samples = 2 * kPilot;
  settings.seed = seed;
  AllocationRequest request;
  request.mean = mean;
  test::allocate_round(film, settings, request);
}

OfPixel constant(float value) {
  return [value](int, int) { return value; };
}
OfPixel right_half(float left, float right) {
  return [=](int, int x) { return x < kWidth / 2 ? left : right; };
}

TEST(SampleDemand, IsTheDeviationOverTheRootOfTheCost) {
  const Film film = pilot(right_half(0.2f, 0.6f), right_half(2, 18));
  for (int h = 0; h < kHalves; ++h) {
    int visited = 0;
    find_demand(film, film.bounds(), film.bounds(), h, AllocationMeasure::absolute, 1, DemandPixels::all,
                [&](int x, int, const PixelDemand& demand) {
                  if (x >= kLeft.x1 && x < kRight.x0) return;
                  const bool right = x >= kRight.x0;
                  // Three channels; of n samples +-s the sample variance is s^2 n / (n - 1).
                  const double variance = 3 * (right ? 0.36 : 0.04) * kPilot / (kPilot - 1.0);
                  EXPECT_NEAR(demand.squared, variance, 1e-4 * variance);
                  EXPECT_EQ(demand.cost, right ? 18 : 2);
                  EXPECT_NEAR(log_demand(demand), 0.5 * std::log2(variance / demand.cost), 1e-4);
                  ++visited;
                });
    EXPECT_EQ(visited, kLeft.area() + kRight.area());
  }
}

// A dark wall asks for no less where a lamp is beside it: relative errors are relative to what a pixel shows.
TEST(SampleDemand, RelativeDemandEndsWhereALampDoes) {
  Film film(kWidth, kHeight);
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      const float mean = x < kWidth / 2 ? 1000.0f : 1.0f;
      for (int h = 0; h < kHalves; ++h) {
        for (int i = 0; i < kPilot; ++i) film.half(h, x, y).add(Rgb(mean * (i % 2 == 0 ? 1.1f : 0.9f)));
      }
    }
  }
  const double variance = 3 * 0.01 * kPilot / (kPilot - 1.0);
  find_demand(film, film.bounds(), film.bounds(), 0, AllocationMeasure::relative, 1e-6, DemandPixels::all,
              [&](int x, int, const PixelDemand& demand) {
                EXPECT_NEAR(demand.squared, variance, 1e-3 * variance) << x;
                EXPECT_NEAR(demand.own_squared, variance, 1e-3 * variance) << x;
              });
}

// Three times the deviation and nine times the cost ask for the same count.
TEST(SampleDemand, DeviationAndCostCanBalance) {
  const Film film = pilot(right_half(0.2f, 0.6f), right_half(2, 18));
  double first = 0, most_off = 0;
  find_demand(film, film.bounds(), film.bounds(), 0, AllocationMeasure::absolute, 1, DemandPixels::all,
              [&](int x, int y, const PixelDemand& demand) {
                if (x == 0 && y == 0) first = log_demand(demand);
                if (x < kLeft.x1 || x >= kRight.x0) most_off = std::max(most_off, std::abs(log_demand(demand) - first));
              });
  EXPECT_LT(most_off, 1e-3);
}

// n ~ s / sqrt(c); the dither keeps the mean of powers of two in proportion.
TEST(NeymanAllocation, CountsFollowTheDeviationOverTheRootOfTheCost) {
  const struct {
    float deviation[2], rays[2];
    double ratio;  // of the right half's counts over the left one's
  } cases[] = {{{0.1f, 0.4f}, {2, 2}, 4}, {{0.3f, 0.3f}, {2, 32}, 0.25}, {{0.1f, 0.4f}, {2, 8}, 2}};
  for (const auto& [deviation, rays, ratio] : cases) {
    Film film = pilot(right_half(deviation[0], deviation[1]), right_half(rays[0], rays[1]));
    allocate(film, 256);
    for (int h = 0; h < kHalves; ++h) {
      EXPECT_NEAR(test::mean_target(film, h, kRight) / test::mean_target(film, h, kLeft), ratio, 0.05 * ratio)
          << deviation[1] << " " << rays[1];
      EXPECT_LE(test::mean_target(film, h, film.bounds()), 256);
      EXPECT_GT(test::mean_target(film, h, film.bounds()), 250);
    }
  }
}

TEST(NeymanAllocation, WhereNothingDiffersCountsAreUniform) {
  Film film = pilot(constant(0.3f), constant(3));
  allocate(film, 100);
  EXPECT_EQ(film.targets()->exponent, 0);
  for (int h = 0; h < kHalves; ++h) {
    for (int y = 0; y < kHeight; ++y) {
      for (int x = 0; x < kWidth; ++x) EXPECT_EQ(film.targets()->target(h, x, y), 100u);
    }
  }
}

// What half A scatters, and what its paths cost, is the business of half B's counts.
TEST(SampleDemand, OfAHalfComesFromTheOtherOne) {
  const auto noisy_in_first = [](int half, int x) { return half == 0 && x >= kWidth / 2 ? 0.8f : 0.1f; };
  const auto dear_in_first = [](int half, int x) { return half == 0 && x >= kWidth / 2 ? 32.0f : 2.0f; };
  for (const bool by_cost : {false, true}) {
    Film film = by_cost ? pilot(constant(0.3f), dear_in_first) : pilot(noisy_in_first, constant(2));
    const Film& seen = film;
    std::vector<double> demand[kHalves];
    for (int h = 0; h < kHalves; ++h) {
      find_demand(seen, seen.bounds(), seen.bounds(), h, AllocationMeasure::absolute, 1, DemandPixels::all,
                  [&](int, int, const PixelDemand& pixel) { demand[h].push_back(log_demand(pixel)); });
    }
    const std::size_t right = kWidth - 1;
    EXPECT_NEAR(demand[0][0], demand[0][right], 1e-6);
    EXPECT_GT(std::abs(demand[1][0] - demand[1][right]), 1.5);
  }
}

// Later rounds scale the counts of the first, whatever its samples have brought.
TEST(NeymanAllocation, LaterRoundsOnlyScale) {
  Film film = pilot(right_half(0.1f, 0.4f), constant(2));
  allocate(film, 64);
  const double first = test::mean_target(film, 0, kRight) / test::mean_target(film, 0, kLeft);
  for (int h = 0; h < kHalves; ++h) {
    for (int y = 0; y < kHeight; ++y) {
      for (int x = 0; x < kWidth; ++x) {  // noise where there was none
        while (film.half(h, x, y).count < film.targets()->target(h, x, y))
          film.half(h, x, y).add(Rgb(x < kWidth / 2 && film.half(h, x, y).count % 2 ? 9.0f : 1.0f));
      }
    }
  }
  allocate(film, 512);
  EXPECT_NEAR(test::mean_target(film, 0, kRight) / test::mean_target(film, 0, kLeft), first, 0.05 * first);
  EXPECT_NEAR(test::mean_target(film, 0, film.bounds()), 512, 6);
}

// The gaze is a factor of the counts, with noise and without.
TEST(NeymanAllocation, CountsFollowTheGaze) {
  constexpr int kSide = 8 * kFilmBlock;
  for (const bool by_noise : {true, false}) {
    Film film(kSide, kSide, {.targets = true});
    for (int h = 0; h < kHalves; ++h) {
      for (int y = 0; y < kSide; ++y) {
        for (int x = 0; x < kSide; ++x) {
          for (int i = 0; i < kPilot; ++i) film.half(h, x, y).add(Rgb(i % 2 ? 1.5f : 0.5f));
        }
      }
    }
    AllocationSettings settings;
    settings.min_samples = by_noise ? 2 * kPilot : 2;
    settings.by_noise = by_noise;
    settings.density.emplace(Gaze{0, 0}, kSide, 2.0);
    AllocationRequest request;
    request.mean = 64;
    test::allocate_round(film, settings, request);
    const double seen = test::mean_target(film, 0, {0, 0, 8, 8});
    const double mean = settings.density->mean_over(film.bounds());
    EXPECT_NEAR(seen, 64 / mean, 0.35 * 64 / mean) << by_noise;
    EXPECT_NEAR(test::mean_target(film, 0, film.bounds()), 64, 4) << by_noise;
    const PixelRect far{kSide - 16, kSide - 16, kSide, kSide};
    const double there = double(settings.density->at(float(far.x0 + 8), float(far.y0 + 8)));
    EXPECT_NEAR(test::mean_target(film, 1, far), std::max(seen * there, by_noise ? 8.0 : 1.0), 0.35 * seen * there + 1)
        << by_noise;
    // The gaze moves: the same mean lies elsewhere, and nothing of the pilot is asked for again.
    settings.density.emplace(Gaze{double(kSide), double(kSide)}, kSide, 2.0);
    test::allocate_round(film, settings, request);
    EXPECT_NEAR(test::mean_target(film, 0, {kSide - 8, kSide - 8, kSide, kSide}), seen, 0.2 * seen) << by_noise;
  }
}

TEST(NeymanAllocation, WithoutAGazeAndWithoutNoiseCountsAreOneNumber) {
  Film film = pilot(constant(0.5f), constant(3));
  AllocationSettings settings;
  settings.min_samples = 2;
  settings.by_noise = false;
  AllocationRequest request;
  request.mean = 100;
  test::allocate_round(film, settings, request);
  for (int x = 0; x < kWidth; ++x) EXPECT_EQ(film.targets()->target(0, x, 3), 100u);
}

}  // namespace
}  // namespace helio
