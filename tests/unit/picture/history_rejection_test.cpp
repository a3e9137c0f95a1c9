#include "renderer/film/history/history_rejection.h"

#include <gtest/gtest.h>

#include <cmath>

#include "renderer/film/history/film_history.h"

namespace helio {
namespace {

constexpr int kSide = 24;
constexpr std::uint32_t kCarried = 64;

// Every pixel carries samples of mean `carried` and variance `variance`, and has got the fresh ones that `fresh` gives,
// per half.
template <class Fresh>
Film film_with(double carried, float variance, std::uint32_t samples, const Fresh& fresh) {
  Film film(kSide, kSide, {.history = true});
  for (int y = 0; y < kSide; ++y) {
    for (int x = 0; x < kSide; ++x) {
      CarriedPixel& pixel = film.history()->carried(x, y);
      pixel.means = PackedMeans(Rgb(float(carried)), Rgb(float(carried)));
      for (int h = 0; h < kHalves; ++h) {
        HalfPixel& half = film.half(h, x, y);
        pixel.count[h] = half.count = kCarried;
        for (int c = 0; c < 3; ++c) {
          half.sum[c] = carried * kCarried;
          half.deviations[c] = variance * (kCarried - 1);
        }
        for (std::uint32_t i = 0; i < samples; ++i) {
          const float v = fresh(x, y, h, i);
          half.add(Rgb(v, v, v));
        }
      }
    }
  }
  return film;
}

void review(Film& film) {
  HistoryRejection work(film, film.bounds());
  for (int sweep = 0; sweep < work.sweeps(); ++sweep) {
    for (std::size_t part = 0; part < work.parts(); ++part) work.run(sweep, part);
    work.finish_sweep(sweep);
  }
}

double mean_of(const Film& film, int x, int y) {
  double sum = 0;
  for (int h = 0; h < kHalves; ++h) sum += film.half(h, x, y).sum[1] / film.half(h, x, y).count / kHalves;
  return sum;
}

TEST(HistoryRejection, KeepsWhatFreshSamplesConfirm) {
  Film film = film_with(1, 0.01f, 4, [](int x, int y, int h, std::uint32_t i) {
    return 1 + ((x * 7 + y * 3 + h + int(i)) % 2 ? 0.1f : -0.1f);
  });
  review(film);
  for (int y = 0; y < kSide; ++y) {
    for (int x = 0; x < kSide; ++x) EXPECT_EQ(film.history()->carried(x, y).count[0], kCarried);
  }
}

TEST(HistoryRejection, TakesBackWhatTheyContradict) {
  // To the right of x = 12 the light has changed from 1 to 3.
  Film film = film_with(1, 0.01f, 4, [](int x, int y, int h, std::uint32_t i) {
    return (x < 12 ? 1 : 3) + ((x * 7 + y * 3 + h + int(i)) % 2 ? 0.1f : -0.1f);
  });
  review(film);
  EXPECT_EQ(film.history()->carried(4, 12).count[0], kCarried);
  for (int h = 0; h < kHalves; ++h) EXPECT_LT(film.history()->carried(20, 12).count[h], 4u);
  EXPECT_NEAR(film.history()->carried(20, 12).bias2, 4, 0.1);
  EXPECT_GT(mean_of(film, 20, 12), 2);
  EXPECT_EQ(film.attempted(0, 20, 12), 4u);  // what was taken back was none of this picture's samples
  EXPECT_GE(film.half(0, 20, 12).deviations[0], 0);
}

TEST(HistoryRejection, WhatWasExpectedIsNoContradiction) {
  // The same change of light, when reuse said that it may be off by that much: a square of 4, give or take 0.04 (four
  // deviations of 48 pixels' mean: of variance 0.24 a sample, of 64 carried ones and 4 fresh ones in each half).
  for (const auto& [expected, kept] : {std::pair(4.1f, true), std::pair(3.98f, true), std::pair(1.0f, false)}) {
    Film film = film_with(1, 0.01f, 4, [](int x, int y, int h, std::uint32_t i) {
      return 3 + ((x * 7 + y * 3 + h + int(i)) % 2 ? 0.1f : -0.1f);
    });
    for (int y = 0; y < kSide; ++y) {
      for (int x = 0; x < kSide; ++x) film.history()->carried(x, y).bias2 = expected;
    }
    review(film);
    for (int h = 0; h < kHalves; ++h) EXPECT_EQ(film.history()->carried(12, 12).count[h] == kCarried, kept);
    EXPECT_NEAR(film.history()->carried(12, 12).bias2, kept ? expected : 4, 0.1f);
  }
}

TEST(HistoryRejection, WhatFewSamplesMissIsNoContradiction) {
  // One sample in a hundred is 100, the others nothing: history has seen some, two fresh samples a pixel have not.
  Film film = film_with(1, 99.0f, 1, [](int, int, int, std::uint32_t) { return 0.0f; });
  review(film);
  for (int y = 0; y < kSide; ++y) {
    for (int x = 0; x < kSide; ++x) EXPECT_EQ(film.history()->carried(x, y).count[1], kCarried);
  }
}

TEST(HistoryRejection, SurvivesWhatNumbersMayBe) {
  for (const float value : {0.0f, 1e-38f, 1e9f, 3e38f}) {
    Film film = film_with(double(value), 0, 2, [&](int x, int, int, std::uint32_t) { return x % 2 ? value : 1.0f; });
    review(film);
    for (int x = 0; x < kSide; ++x) {
      const HalfPixel& half = film.half(0, x, 3);
      EXPECT_GE(half.count, 2u);
      EXPECT_TRUE(std::isfinite(half.sum[0]) && std::isfinite(half.deviations[0])) << value;
      EXPECT_GE(half.deviations[0], 0);
      EXPECT_GE(half.sum[0], 0);
    }
  }
}

TEST(HistoryRejection, DarkSamplesUnderBrightHistoryDoNotBecomeNegative) {
  // Thirds are no floats: what is taken back of a sum of 64 of them is not to the bit what was added.
  Film film = film_with(1e9 / 3, 1, 4, [](int, int, int, std::uint32_t) { return 1e-9f; });
  review(film);
  for (int x = 0; x < kSide; ++x) {
    for (int h = 0; h < kHalves; ++h) {
      EXPECT_LT(film.history()->carried(x, 3).count[h], kCarried);
      EXPECT_GE(film.half(h, x, 3).sum[1], 0);
    }
  }
}

TEST(HistoryRejection, PixelsWithoutFreshSamplesOfBothHalvesHaveNoSay) {
  Film film = film_with(1, 0.01f, 0, [](int, int, int, std::uint32_t) { return 9.0f; });
  for (int y = 0; y < kSide; ++y) {
    for (int x = 0; x < kSide; ++x) film.half(0, x, y).add(Rgb(9, 9, 9));
  }
  review(film);
  EXPECT_EQ(film.history()->carried(5, 5).count[0], kCarried);
}

TEST(HistoryRejection, PixelsWithoutFreshSamplesKeepSomethingToShow) {
  // Three pixels in four have fresh samples, which say that history is wrong altogether; its own variance is nothing.
  Film film = film_with(1, 1e-9f, 0, [](int, int, int, std::uint32_t) { return 0.0f; });
  for (int y = 0; y < kSide; ++y) {
    for (int x = 0; x < kSide; ++x) {
      for (int h = 0; h < kHalves && (x + 2 * y) % 4 > 0; ++h) film.half(h, x, y).add(Rgb(1000, 1000, 1000));
    }
  }
  review(film);
  for (int h = 0; h < kHalves; ++h) {
    EXPECT_EQ(film.half(h, 12, 12).count, 1u);  // a carried one
    EXPECT_NEAR(film.half(h, 12, 12).sum[1], 1, 1e-3);
    EXPECT_EQ(film.history()->carried(12, 12).count[h], 1u);
    EXPECT_LT(film.half(h, 13, 12).count, 4u);
  }
}

}  // namespace
}  // namespace helio
