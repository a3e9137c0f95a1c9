// Films whose pixels carry samples of earlier pictures while light paths bring splats to the fresh ones.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "renderer/film/allocation/sample_demand.h"
#include "renderer/film/estimate/resolve.h"
#include "renderer/film/history/film_history.h"
#include "renderer/film/history/history_rejection.h"
#include "renderer/film/history/history_source.h"
#include "renderer/film/history/splat_row.h"
#include "renderer/film/splats/splat_buffer.h"
#include "tests/support/directions.h"
#include "tests/unit/picture/synthetic_film.h"

namespace helio {
namespace {

using test::Random;

constexpr FilmState kBoth{.history = true, .splats = true};

// Samples of mean `mean` and variance `variance` each, of an earlier picture.
void carry(Film& film, int h, int x, int y, std::uint32_t count, float mean, float variance) {
  CarriedPixel& carried = film.history()->carried(x, y);
  HalfPixel& half = film.half(h, x, y);
  carried.count[h] = half.count = count;
  const bool alone = carried.count[1 - h] == 0;
  const Rgb own(mean), other = alone ? own : carried.means.mean(1 - h);
  carried.means = h == 0 ? PackedMeans(own, other) : PackedMeans(other, own);
  for (int c = 0; c < 3; ++c) {
    half.sum[c] = double(mean) * count;
    half.deviations[c] = variance * (float(count) - 1);
  }
}

// So many light paths a pixel, all of which bring their pixel `value`.
void splat_evenly(Film& film, int h, int per_pixel, float value) {
  std::vector<Splat> splats;
  for (int y = 0; y < film.height(); ++y) {
    for (int x = 0; x < film.width(); ++x) {
      for (int i = 0; i < per_pixel; ++i) splats.push_back({x, y, Rgb(value * float(film.width() * film.height()))});
    }
  }
  film.splats()->add(h, splats, splats.size());
}

TEST(CarriedSplats, CountAsMuchAsTheFreshSamplesThatTheyComeWith) {
  Film film(4, 1, kBoth);
  for (int h = 0; h < kHalves; ++h) {
    for (int x = 0; x < 3; ++x) carry(film, h, x, 0, 3, 10, 0);
    splat_evenly(film, h, 1, 4);
  }
  film.half(0, 0, 0).add(Rgb(2));
  film.half(1, 0, 0).add(Rgb(2));
  film.half(0, 1, 0).add(Rgb(2));
  film.half(0, 3, 0).add(Rgb(2));
  const std::vector<float> expected = {
      9,     // (3 * 10 + 1 * (2 + 4)) / 4 in both halves
      9.5f,  // the second half has but what is carried
      10,    // no fresh sample, though light paths have run
      6,     // nothing carried
  };
  for (int x = 0; x < 4; ++x) EXPECT_EQ(resolve_mean(film, x, 0), Rgb(expected[std::size_t(x)])) << x;
  for (const unsigned channels : {0u, unsigned(kResolveVariance)}) {
    const ResolvedTile tile = resolve_tile(film, film.bounds(), film.bounds(), channels);
    EXPECT_EQ(tile.radiance[1], expected) << channels;
  }
  EXPECT_EQ(sum_of_means(film, {0, 0, 3, 1}, 0), 3 * (9.0 + 9 + 10));
  HistorySource source(4, 1);
  source.gather(film, film.bounds(), film.bounds());
  for (int x = 0; x < 4; ++x)
    EXPECT_EQ(source.pixel(x, 0).means.mean(0)[2], x == 1 ? 9 : expected[std::size_t(x)]) << x;
  EXPECT_EQ(source.pixel(1, 0).means.mean(1)[2], 10);
}

// Carried samples say 6; fresh camera samples 2, and all light paths 4: nothing
// scatters. Taken as they are the samples do: by 8 * 8 / 16 (6 - 2)^2.
TEST(CarriedSplats, AreNoScatterOfThePixelsSamples) {
  Film film(1, 1, kBoth);
  for (int h = 0; h < kHalves; ++h) {
    carry(film, h, 0, 0, 8, 6, 0);
    for (int i = 0; i < 8; ++i) film.half(h, 0, 0).add(Rgb(2));
    splat_evenly(film, h, 8, 4);
  }
  EXPECT_FLOAT_EQ(film.half(0, 0, 0).deviations[0], 64);
  SplatRow row;
  row.look(film, 0, 0, 0, 1, true);
  EXPECT_DOUBLE_EQ(row.mean(0, 0), 2);
  EXPECT_DOUBLE_EQ(row.deviation(0, 0), -64);
  EXPECT_NEAR(row.sample_variance(film.half(0, 0, 0), 0, 0), 0, 1e-9);
  HistorySource source(1, 1);
  source.gather(film, film.bounds(), film.bounds());
  EXPECT_NEAR(source.pixel(0, 0).spread(0).x, 0, 1e-4);
  EXPECT_EQ(estimate_error(film, film.bounds()).rmse, 0);
}

// A sample's noise is that of its camera path, 1/4, and that of 4 of 4 light paths, 4 * 1/8; what is carried has the
// same, 3/4. Of 12 carried and 4 fresh samples in each half the mean has 3/4 / 16 / 2, and a sample 3/4, half or two
// thirds of which is splats'.
TEST(CarriedSplats, VarianceIsThatOfAllSamples) {
  constexpr int kSide = 64, kFresh = 4, kCarried = 12;
  Film film(kSide, kSide, kBoth);
  Random random(21);
  for (int h = 0; h < kHalves; ++h) {
    for (int y = 0; y < kSide; ++y) {
      for (int x = 0; x < kSide; ++x) {
        float mean = 0;
        for (int i = 0; i < kCarried; ++i) mean += test::exponential(std::sqrt(0.75f), random) / kCarried;
        carry(film, h, x, y, kCarried, 1 + mean - std::sqrt(0.75f), 0.75f);
        for (int i = 0; i < kFresh; ++i) film.half(h, x, y).add(Rgb(test::exponential(0.5f, random)));
      }
    }
    std::vector<Splat> splats(std::size_t(kSide * kSide * kFresh));
    for (Splat& splat : splats) {
      splat.x = std::int32_t(random.next_double() * kSide);
      splat.y = std::int32_t(random.next_double() * kSide);
      splat.radiance = Rgb(test::exponential(0.5f, random) * float(kSide * kSide));
    }
    film.splats()->add(h, splats, splats.size());
  }
  const double expected = 0.75 / (kCarried + kFresh) / 2;
  EXPECT_NEAR(test::mean_of(test::variance_of(film)) / expected, 1, 0.05);
  EXPECT_NEAR(std::pow(estimate_error(film, film.bounds()).rmse, 2) / expected, 1, 0.05);
  HistorySource source(kSide, kSide);
  source.gather(film, film.bounds(), film.bounds());
  double spread = 0, demand = 0;
  for (int y = 0; y < kSide; ++y) {
    for (int x = 0; x < kSide; ++x) spread += double(source.pixel(x, y).spread(1).y) / (kSide * kSide);
  }
  EXPECT_NEAR(spread / 0.75, 1, 0.08) << "a thirtieth too much: the splats' noise is between the groups as well";
  // Of samples of both kinds: 12 of 3/4 and 4 of 1/4 of 16, in the mean of what pixels' deviations say.
  find_demand(film, film.bounds(), film.bounds(), 0, AllocationMeasure::absolute, 1, DemandPixels::all,
              [&](int, int, const PixelDemand& pixel) { demand += pixel.own_squared / (3.0 * kSide * kSide); });
  EXPECT_NEAR(demand / (10.0 / 16), 1, 0.1);
}

void review(Film& film) {
  HistoryRejection work(film, film.bounds());
  for (int sweep = 0; sweep < work.sweeps(); ++sweep) {
    for (std::size_t part = 0; part < work.parts(); ++part) work.run(sweep, part);
    work.finish_sweep(sweep);
  }
}

// Half of what was carried is what light paths brought: it is no contradiction when fresh samples bring the other half,
// and light paths this one; it is when they do not.
TEST(CarriedSplats, FreshSamplesAreReviewedWithTheirSplats) {
  constexpr int kSide = 24;
  for (const bool lands : {true, false}) {
    Film film(kSide, kSide, kBoth);
    Random random(22);
    for (int h = 0; h < kHalves; ++h) {
      for (int y = 0; y < kSide; ++y) {
        for (int x = 0; x < kSide; ++x) {
          carry(film, h, x, y, 64, 2, 0.02f);
          for (int i = 0; i < 8; ++i) film.half(h, x, y).add(Rgb(0.9f + 0.2f * float(random.next_double())));
        }
      }
      splat_evenly(film, h, 8, lands ? 1.0f : 0.0f);
    }
    review(film);
    const CarriedPixel& carried = film.history()->carried(12, 12);
    const HalfPixel& half = film.half(1, 12, 12);
    if (lands) {
      EXPECT_EQ(carried.count[0], 64u);
      EXPECT_EQ(carried.bias2, 0);
    } else {
      EXPECT_LT(carried.count[0], 16u);
      EXPECT_NEAR(carried.bias2, 1, 0.1);
      EXPECT_LT(half.sum[0] / half.count, 1.7);
    }
    EXPECT_GE(half.deviations[0], 0);
    EXPECT_EQ(film.attempted(0, 12, 12), 8u);
  }
}

// The other way round: light paths bring what nobody has seen before.
TEST(CarriedSplats, WhatLightPathsAloneFindTakesHistoryBack) {
  constexpr int kSide = 24;
  Film film(kSide, kSide, kBoth);
  Random random(23);
  for (int h = 0; h < kHalves; ++h) {
    for (int y = 0; y < kSide; ++y) {
      for (int x = 0; x < kSide; ++x) {
        carry(film, h, x, y, 64, 1, 0.02f);
        for (int i = 0; i < 8; ++i) film.half(h, x, y).add(Rgb(0.9f + 0.2f * float(random.next_double())));
      }
    }
    splat_evenly(film, h, 8, 2);
  }
  review(film);
  for (int h = 0; h < kHalves; ++h) {
    EXPECT_LT(film.history()->carried(12, 12).count[h], 4u);
    SplatRow row;
    row.look(film, h, 12, 12, 13, true);
    // Light paths that land where chance has it: 2^2. What the samples had between them, 64 * 8 / 72 * 2^2 over 71,
    // stays theirs; that fresh ones lack the splats' part of what was carried is no scatter any more.
    EXPECT_NEAR(row.sample_variance(film.half(h, 12, 12), 12, 0), 4 + 0.4, 0.1);
  }
  EXPECT_NEAR(film.history()->carried(12, 12).bias2, 4, 0.1);
  EXPECT_GT(resolve_mean(film, 12, 12).x, 2.5f);
}

TEST(CarriedSplats, LeaveADirectionInProportionToWhatTheyBring) {
  constexpr int kSide = 64;
  SplatBuffer buffer(kSide, kSide, true), backwards(kSide, kSide, true);
  std::vector<Splat> splats;
  constexpr std::uint32_t kBright = 0xbcdefu;  // 20 bits
  for (int y = 0; y < kSide; ++y) {
    for (int x = 0; x < kSide; ++x) {
      for (int i = 0; i < 4; ++i) splats.push_back({x, y, Rgb(0.25f), {std::uint32_t(1 + i), 1}});  // 1 together
      splats.push_back({x, y, Rgb(3), {kBright, 0.25f}});
      if (x == 7 && y == 9) splats.resize(splats.size() - 5);
    }
  }
  splats.push_back({7, 9, Rgb(0), {5, 1}});
  buffer.add(0, splats, splats.size());
  std::reverse(splats.begin(), splats.end());
  for (const Splat& splat : splats) backwards.add(0, std::vector<Splat>{splat}, 1);
  EXPECT_TRUE(buffer == backwards) << "whatever the order";
  int bright = 0, told = 0;
  for (int y = 0; y < kSide; ++y) {
    for (int x = 0; x < kSide; ++x) {
      const ToldLight light = buffer.told(0, x, y);
      bright += light.direction == kBright;
      told += light.direction != 0;
      EXPECT_NEAR(light.share, light.direction == kBright ? 0.25 : 1, 0.002);
      EXPECT_EQ(buffer.told(1, x, y).direction, 0u);
    }
  }
  EXPECT_EQ(told, kSide * kSide - 1);
  EXPECT_NEAR(double(bright) / told, 0.75, 0.03);
  EXPECT_EQ(buffer.told(0, 7, 9).direction, 0u) << "nothing but a black splat";
  EXPECT_EQ(SplatBuffer(4, 4).told(0, 1, 1).direction, 0u);
  buffer.clear();
  EXPECT_EQ(buffer.told(0, 3, 3).direction, 0u);
}

// A pixel's reservoir holds what camera paths have met; of its places as many are splats' as these have a share in what
// counts of the mean: 8 of 16 samples are fresh, and of each 3 of 4 are the splats': 3/8 of the light.
TEST(CarriedSplats, DirectionsOfASourceAreThoseOfCameraPathsAndSplats) {
  constexpr int kSide = 64;
  constexpr double kSplatted = 0.375;
  const auto mixed = [](float of_camera, float of_splats) {
    Film film(kSide, kSide, kBoth);
    for (int h = 0; h < kHalves; ++h) {
      std::vector<Splat> splats;
      for (int y = 0; y < kSide; ++y) {
        for (int x = 0; x < kSide; ++x) {
          carry(film, h, x, y, 8, 4, 0);
          for (int i = 0; i < 8; ++i) film.half(h, x, y).add(Rgb(1));
          film.history()->directions(x, y) = test::in_each_half(77, 77, of_camera);
          for (int i = 0; i < 8; ++i) splats.push_back({x, y, Rgb(3.0f * kSide * kSide), {99, of_splats}});
        }
      }
      film.splats()->add(h, splats, splats.size());
    }
    HistorySource source(kSide, kSide);
    source.gather(film, film.bounds(), film.bounds());
    return source;
  };
  for (const auto& [of_camera, of_splats] : {std::pair(1.0f, 1.0f), {0.0f, 1.0f}, {0.25f, 0.0f}}) {
    const HistorySource source = mixed(of_camera, of_splats);
    const double splatted = kSplatted * double(DirectionReservoir::counting(of_splats));
    const double expected = splatted / (splatted + (1 - kSplatted) * double(DirectionReservoir::counting(of_camera)));
    double share[kHalves * DirectionReservoir::kPlaces] = {};
    for (int y = 0; y < kSide; ++y) {
      for (int x = 0; x < kSide; ++x) {
        int place = 0;
        for (const std::uint32_t direction : test::directions_in(source.directions(x, y))) {
          EXPECT_TRUE(direction == 77 || direction == 99);
          share[place++] += direction == 99 ? 1.0 / (kSide * kSide) : 0;
        }
        for (int h = 0; h < kHalves; ++h) {
          EXPECT_NEAR(source.directions(x, y).share(h),
                      kSplatted * double(of_splats) + (1 - kSplatted) * double(of_camera), 0.004);
        }
      }
    }
    for (const double of_place : share) EXPECT_NEAR(of_place, expected, 0.03);
  }
}

TEST(CarriedSplats, AHalfWithoutSamplesHasNoDirectionsOfSplats) {
  Film film(4, 4, kBoth);
  film.half(0, 1, 1).add(Rgb(1));
  for (int h = 0; h < kHalves; ++h) film.splats()->add(h, std::vector<Splat>{{1, 1, Rgb(300), {99, 0}}}, 1);
  HistorySource source(4, 4);
  source.gather(film, film.bounds(), film.bounds());
  const DirectionReservoir& directions = source.directions(1, 1);
  EXPECT_EQ(directions.direction(0, 0), 99u);
  EXPECT_EQ(directions.direction(1, 0), DirectionReservoir::kNone);
  EXPECT_EQ(directions.share(1), 1);
}

TEST(CarriedSplats, MemoryIsAsDocumented) {
  EXPECT_EQ(Film::bytes_per_pixel(kBoth), 120u + 194 + 196 + 16);
  EXPECT_EQ(Film::bytes_per_pixel({.history = true, .carried_only = true, .splats = true}), 120u + 30 + 196)
      << "without sources nothing asks for directions";
  EXPECT_GE(Film(16, 16, kBoth).bytes(), Film(16, 16, {.history = true}).bytes() + 256 * 212);
}

}  // namespace
}  // namespace helio
