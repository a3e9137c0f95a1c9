// What a film keeps for reuse: encodings, shares, and what a source gathers of it.
#include <gtest/gtest.h>

#include <cfloat>
#include <cmath>
#include <cstring>
#include <limits>

#include "renderer/film/core/packed_values.h"
#include "renderer/film/estimate/resolve.h"
#include "renderer/film/history/film_history.h"
#include "renderer/film/history/history_source.h"
#include "tests/support/random.h"

namespace helio {
namespace {

using test::Random;

TEST(PackedValues, ShortFloatsKeepTheRangeAndTwoDigits) {
  for (const float x : {0.0f, 1e-38f, 3e-9f, 0.7f, 1.0f, 12345.0f, 1e30f, 3e38f})
    EXPECT_NEAR(unpack_short_float(pack_short_float(x)), x, x / 256);
  EXPECT_EQ(unpack_short_float(pack_short_float(0)), 0);
  const float infinity = std::numeric_limits<float>::infinity();
  EXPECT_EQ(unpack_short_float(pack_short_float(infinity)), infinity);
  EXPECT_EQ(unpack_short_float(pack_short_float(FLT_MAX)), infinity);  // rounded up, and so no NaN
}

TEST(PackedValues, AgesThatGrowByOneAreNotLost) {
  EXPECT_EQ(float(RootByte()), 0);
  EXPECT_EQ(float(RootByte(1)), 1);
  EXPECT_EQ(float(RootByte(-1)), 0);
  EXPECT_NEAR(float(RootByte(1e9f)), 254, 0.1);
  RootByte age;
  for (int moves = 1; moves <= 200; ++moves) {
    age = age + 1;
    EXPECT_GE(age, 0.8f * float(moves)) << moves;
    EXPECT_LE(age, 1.5f * float(moves)) << moves;
  }
}

TEST(PackedValues, MeansOfHalvesLoseAFractionOfWhatTheyAreApart) {
  const Rgb same(0.3f, 1e-20f, 7e30f);
  EXPECT_EQ(PackedMeans(same, same).mean(0), same);
  EXPECT_EQ(PackedMeans(same, same).mean(1), same);
  EXPECT_EQ(PackedMeans().mean(0), Rgb(0, 0, 0));
  Random random(4);
  for (int i = 0; i < 1000; ++i) {
    const auto number = [&] { return (random.next_float() - 0.2f) * std::exp2(60 * (random.next_float() - 0.5f)); };
    const Rgb a(number(), number(), number()), b = i % 2 ? Rgb(number(), a.y, number()) : a * 1.01f;
    const PackedMeans packed(a, b);
    for (int c = 0; c < 3; ++c) {
      const float apart = std::fabs(a[c] - b[c]), rounding = 2e-7f * std::max(std::fabs(a[c]), std::fabs(b[c]));
      EXPECT_NEAR(packed.mean(0)[c], a[c], apart / 256 + rounding);
      EXPECT_NEAR(packed.mean(1)[c], b[c], apart / 256 + rounding);
      EXPECT_EQ(std::min(packed.mean(0)[c], packed.mean(1)[c]), std::min(a[c], b[c])) << "no mean falls below zero";
    }
    // Packed again they are the same: a camera that comes back again and again wears nothing down.
    const PackedMeans again(packed.mean(0), packed.mean(1));
    EXPECT_EQ(again.mean(0), packed.mean(0));
    EXPECT_EQ(again.mean(1), packed.mean(1));
  }
  EXPECT_TRUE(std::isfinite(PackedMeans(Rgb(FLT_MAX), Rgb(0, 0, 0)).mean(0).x));
}

TEST(PackedValues, DirectionsKeepAFractionOfAMilliradian) {
  for (const V3f& v : {V3f(0, 0, 1), V3f(0, 0, -1), V3f(1, 0, 0), V3f(-1, 0, 0), V3f(0, -1, 0), V3f(0.3f, -0.5f, -0.8f),
                       V3f(-0.6f, 0.6f, 0.01f)}) {
    EXPECT_LT(length(unpack_direction(pack_direction(v.normalized())) - v.normalized()), 1e-4f);
  }
}

TEST(PackedValues, CoarseDirectionsKeepFourMilliradians) {
  for (const V3f& v : {V3f(0, 0, 1), V3f(0, 0, -1), V3f(1, 0, 0), V3f(0.3f, -0.5f, -0.8f), V3f(-0.6f, 0.6f, 0.01f)}) {
    const std::uint32_t packed = pack_direction<10>(v.normalized());
    EXPECT_LT(packed, 1u << 20);
    EXPECT_LT(length(unpack_direction<10>(packed) - v.normalized()), 4.8e-3f);
  }
}

TEST(PackedValues, CountsKeepFiveDigits) {
  for (const float x : {0.0f, 1e-38f, 0x1p-24f, 1.0f / 3, 1.0f, 12345.0f, 3e38f})
    EXPECT_NEAR(unpack_count(pack_count(x)), x, x * 0x1p-17f);
}

TEST(PackedValues, ShortNumbersKeepTheirMean) {
  for (const float x : {0.0f, 0x1p-60f, 0.375f, 1.0f, 13.0f, 0x1.cp63f}) {
    const std::uint32_t packed = pack_short_numbers(x, 1, 0);
    EXPECT_EQ(unpack_short_number(packed, 0), x) << "has four bits";
    EXPECT_EQ(unpack_short_number(packed, 1), 1);
    EXPECT_EQ(unpack_short_number(packed, 2), 0);
  }
  const float nan = std::numeric_limits<float>::quiet_NaN(), infinity = std::numeric_limits<float>::infinity();
  const std::uint32_t odd = pack_short_numbers(nan, infinity, -1);
  EXPECT_EQ(unpack_short_number(odd, 0), 0);
  EXPECT_EQ(unpack_short_number(odd, 1), 0x1.ep63f);
  EXPECT_EQ(unpack_short_number(odd, 2), 0);
  EXPECT_EQ(unpack_short_number(pack_short_numbers(-0.0f, 1e-30f, 1e30f), 0), 0);
  EXPECT_EQ(unpack_short_number(pack_short_numbers(-0.0f, 1e-30f, 1e30f), 1), 0);
  // Rounded to one of the neighbours, which are an eighth apart at most: of 10000 numbers the mean is off by less than
  // 4 / 100 of the deviation that this makes, at most half of that.
  double in = 0, out = 0;
  for (int i = 0; i < 10000; ++i) {
    const float x = 1 + float(i) * 1e-4f;
    const float y = unpack_short_number(pack_short_numbers(0, 0, x), 2);
    EXPECT_LT(std::fabs(y - x), 0.125f);
    in += double(x);
    out += double(y);
  }
  EXPECT_NEAR(out / in, 1, 0.04 * 0.0625 / 1.5);
}

TEST(PackedValues, ReflectancesKeepTheirDarkEnd) {
  for (const float x : {0.0f, 0.001f, 0.02f, 0.18f, 0.5f, 1.0f}) {
    const Rgb c = unpack_reflectance(pack_reflectance(Rgb(x, 0.5f, 1)));
    EXPECT_NEAR(c.x, x, 1e-3f * std::sqrt(x) + 1e-6f);
    EXPECT_EQ(c.z, 1);
  }
  const Rgb odd = unpack_reflectance(pack_reflectance(Rgb(-1, 7, std::numeric_limits<float>::quiet_NaN())));
  EXPECT_EQ(odd, Rgb(0, 1, 0));
}

// A film whose halves have `count` samples of the radiance that `value` gives, less or more by `noise` in turn.
template <class Value>
Film film_with(int width, int height, std::uint32_t count, float noise, const Value& value) {
  Film film(width, height, {.history = true});
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      CentreHit& centre = film.history()->centre(x, y);
      centre.instance = 1;
      centre.depth = 2;
      centre.albedo = pack_reflectance(Rgb(1, 1, 1));
      for (int h = 0; h < kHalves; ++h) {
        for (std::uint32_t i = 0; i < count; ++i) {
          const float v = value(x, y) + ((i + std::uint32_t(x + h)) % 2 ? noise : -noise);
          film.half(h, x, y).add(Rgb(v, v, v));
        }
      }
    }
  }
  return film;
}

TEST(HistorySource, GathersMeansCountsAndSpreads) {
  const Film film = film_with(20, 9, 8, 0.25f, [](int x, int) { return 1.0f + float(x); });
  HistorySource source(20, 9);
  source.gather(film, film.bounds(), film.bounds());
  for (int x = 0; x < 20; ++x) {
    const SourcePixel& pixel = source.pixel(x, 4);
    for (int h = 0; h < kHalves; ++h) {
      EXPECT_FLOAT_EQ(pixel.means.mean(h)[1], 1.0f + float(x));
      EXPECT_FLOAT_EQ(pixel.inverse_count(h), 1.0f / 8);
      EXPECT_NEAR(pixel.spread(h).x, 0.0625f * 8 / 7, 0.0625f / 8);
    }
    EXPECT_EQ(pixel.bias2(), 0);
    // A ramp does not bend, and rises by one a pixel along x.
    EXPECT_EQ(pixel.bend2(0), 0);
    EXPECT_EQ(pixel.bend2(1), 0);
    if (x >= 2 && x < 18) {
      EXPECT_EQ(pixel.slope2(), 0.5f);  // of x and y; fewer pairs at the ends
    }
  }
}

TEST(HistorySource, AStepBendsAsMuchAsItsHeightSquared) {
  const Film film = film_with(20, 9, 2, 0, [](int x, int) { return x < 10 ? 1.0f : 3.0f; });
  HistorySource source(20, 9);
  source.gather(film, film.bounds(), film.bounds());
  double sum = 0;
  for (int x = 0; x < 20; ++x) {
    sum += double(source.pixel(x, 4).bend2(0));
    EXPECT_EQ(source.pixel(x, 4).bend2(1), 0);
  }
  // On a pixel's edge both neighbours bend by the step, and 3x3 means keep the sum: halves agree. Four bits of each.
  EXPECT_NEAR(sum, 2 * 2.0 * 2.0, 0.5);
}

TEST(HistorySource, NoiseOfTheHalvesIsNoStructure) {
  // Halves that differ by noise of opposite signs: their products are negative, and count as nothing.
  Film film(12, 12, {.history = true});
  for (int y = 0; y < 12; ++y) {
    for (int x = 0; x < 12; ++x) {
      film.history()->centre(x, y).instance = 1;
      const float noise = (x + y) % 2 ? 0.5f : -0.5f;
      film.half(0, x, y).add(Rgb(1 + noise, 1 + noise, 1 + noise));
      film.half(1, x, y).add(Rgb(1 - noise, 1 - noise, 1 - noise));
    }
  }
  HistorySource source(12, 12);
  source.gather(film, film.bounds(), film.bounds());
  EXPECT_EQ(source.pixel(5, 5).bend2(0), 0);
  EXPECT_EQ(source.pixel(5, 5).slope2(), 0);
}

TEST(HistorySource, KnowsNothingWithoutSamplesAndMarksBorders) {
  Film film = film_with(8, 8, 4, 0, [](int x, int y) { return x == 3 && y == 3 ? 100.0f : 1.0f; });
  film.history()->centre(3, 3).border = 1;
  for (int h = 0; h < kHalves; ++h) film.half(h, 6, 6) = {};
  film.half(1, 1, 1) = {};  // one half only
  HistorySource source(8, 8);
  source.gather(film, film.bounds(), film.bounds());
  EXPECT_TRUE(source.centre(3, 3).border);
  EXPECT_EQ(source.pixel(3, 3).means.mean(0)[0], 100);
  EXPECT_EQ(source.pixel(2, 3).slope2(), 0) << "a difference across a border";
  EXPECT_EQ(source.pixel(2, 3).bend2(0), 0);
  EXPECT_TRUE(source.pixel(6, 6).empty());
  EXPECT_FALSE(source.pixel(6, 6).known(0) || source.pixel(6, 6).known(1));
  EXPECT_TRUE(source.pixel(1, 1).known(0));
  EXPECT_FALSE(source.pixel(1, 1).known(1));
}

TEST(HistorySource, WindowsAndTheWholeGiveTheSame) {
  const Film film = film_with(40, 30, 4, 0.3f, [](int x, int y) { return 1.0f + float((x * 7 + y * 13) % 11); });
  HistorySource whole(40, 30), cut(40, 30);
  whole.gather(film, film.bounds(), film.bounds());
  for (const PixelRect& window : {PixelRect{0, 0, 16, 16}, PixelRect{16, 0, 40, 16}, PixelRect{0, 16, 40, 30}})
    cut.gather(film, window, film.bounds());
  for (int y = 0; y < 30; ++y) {
    for (int x = 0; x < 40; ++x) EXPECT_EQ(std::memcmp(&whole.pixel(x, y), &cut.pixel(x, y), sizeof(SourcePixel)), 0);
  }
}

TEST(FilmHistory, CarriedSamplesAreNoAttempts) {
  Film film(4, 4, {.history = true});
  CarriedPixel& carried = film.history()->carried(2, 1);
  carried.count[0] = 5;
  carried.count[1] = 3;
  film.half(0, 2, 1).count = 5;
  film.half(1, 2, 1).count = 3;
  EXPECT_EQ(film.attempted(0, 2, 1), 0u);
  film.half(0, 2, 1).add(Rgb(1, 1, 1));
  EXPECT_EQ(film.attempted(0, 2, 1), 1u);
  EXPECT_EQ(film.attempted(1, 2, 1), 0u);
  film.clear();
  EXPECT_EQ(film.history()->carried(2, 1).count[0], 0u);
}

TEST(FilmHistory, BiasFadesAsFreshSamplesArriveAndCountsAsVariance) {
  Film film = film_with(9, 9, 16, 0, [](int, int) { return 1.0f; });
  for (int y = 0; y < 9; ++y) {
    for (int x = 0; x < 9; ++x) {
      film.history()->carried(x, y).count[0] = film.history()->carried(x, y).count[1] = 4;
      film.history()->carried(x, y).bias2 = 0.75f;
    }
  }
  EXPECT_DOUBLE_EQ(film.history()->weight(4, 4, 16, 16), 0.25);
  EXPECT_NEAR(film.history()->bias2(4, 4, 16, 16), 0.75 / 16, 1e-8);
  const ResolvedTile tile = resolve_tile(film, film.bounds(), film.bounds(), kResolveVariance);
  EXPECT_NEAR(tile.variance[1][40], 0.75f / 16, 1e-6f);  // nothing else: the halves agree
  const FilmError error = estimate_error(film, film.bounds());
  EXPECT_NEAR(error.rmse, std::sqrt(0.75 / 16), 1e-6);
}

}  // namespace
}  // namespace helio
