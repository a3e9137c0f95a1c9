// The display layer on films whose truth and noise are known.
#include "renderer/film/display/display_layer.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>

#include "renderer/film/estimate/resolve.h"
#include "tests/unit/picture/synthetic_film.h"

namespace helio::test {
namespace {

constexpr int kWidth = 150, kHeight = 70;  // more than one window, and no multiple of one

using Truth = std::function<float(int x, int y)>;

// Exponential noise around the truth, all surfaces the same: white, facing the camera, at distance 1.
Film noisy_film(const Truth& truth, int samples_of_half, std::uint64_t seed = 1) {
  Film film(kWidth, kHeight);
  Random random(seed);
  for (int h = 0; h < kHalves; ++h) {
    if (samples_of_half <= 64) {
      add_samples(film, h, samples_of_half, random,
                  [&](int x, int y, int, Random& r) { return exponential(truth(x, y), r); });
      continue;
    }
    // As many, of which four groups have one mean each.
    const float spread = std::sqrt(4 / float(samples_of_half));
    add_samples(film, h, 4, random, [&](int x, int y, int, Random& r) {
      return truth(x, y) + spread * (exponential(truth(x, y), r) - truth(x, y));
    });
  }
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      PixelFeatures& f = film.features(x, y);
      f.count = f.hits = 1;
      f.depth = 1;
      f.normal[2] = 1;
      for (float& albedo : f.albedo) albedo = 1;
    }
  }
  return film;
}

void make(DisplayLayer& layer, const Film& film, const PixelRect& region, bool backwards = false) {
  layer.begin(region);
  for (int sweep = 0; sweep < DisplayLayer::kSweeps; ++sweep) {
    const std::size_t parts = layer.parts();
    for (std::size_t i = 0; i < parts; ++i) layer.run(film, sweep, backwards ? parts - 1 - i : i);
    layer.finish_sweep(sweep);
  }
}

ResolvedTile shown(const DisplayLayer* layer, const Film& film, const PixelRect& window) {
  ResolvedTile tile = resolve_tile(film, window, film.bounds(), kResolveAll);
  DisplayLayer::resolve(layer, film, tile);
  return tile;
}

ResolvedTile display_of(const Film& film) {
  DisplayLayer layer(kWidth, kHeight);
  make(layer, film, film.bounds());
  return shown(&layer, film, film.bounds());
}

struct Errors {
  double raw = 0, display = 0, told = 0;  // root mean squares
};
Errors errors(const ResolvedTile& tile, const Truth& truth) {
  Errors e;
  std::size_t i = 0;
  for (int y = tile.window.y0; y < tile.window.y1; ++y) {
    for (int x = tile.window.x0; x < tile.window.x1; ++x, ++i) {
      for (int c = 0; c < 3; ++c) {
        e.raw += std::pow(double(tile.radiance[c][i]) - truth(x, y), 2) / 3;
        e.display += std::pow(double(tile.display[c][i]) - truth(x, y), 2) / 3;
      }
      e.told += std::pow(double(tile.display_error[i]), 2);
    }
  }
  const double pixels = double(tile.window.area());
  return {std::sqrt(e.raw / pixels), std::sqrt(e.display / pixels), std::sqrt(e.told / pixels)};
}

TEST(DisplayLayer, TakesNoiseOffASurfaceAndKnowsWhatIsLeft) {
  for (const int samples : {1, 2, 8, 32}) {
    const Truth even = [](int, int) { return 2.0f; };
    const ResolvedTile tile = display_of(noisy_film(even, samples));
    const Errors e = errors(tile, even);
    EXPECT_LT(e.display, 0.35 * e.raw) << samples;
    EXPECT_GT(e.told, 0.7 * e.display) << samples;
    EXPECT_LT(e.told, 1.65 * e.display) << samples;  // of a bias that is not there
    EXPECT_NEAR(mean_of(tile.display[0]), 2, 0.04) << samples;
  }
}

TEST(DisplayLayer, IsNoWorseThanTheFilmWhereNothingIsSmooth) {
  // Each pixel has a radiance of its own, which no feature tells.
  const Truth rough = [](int x, int y) { return 0.2f + float((x * 7919 + y * 104729) % 97) / 40; };
  for (const int samples : {2, 8, 32, 512, 1 << 14}) {
    const Errors e = errors(display_of(noisy_film(rough, samples)), rough);
    EXPECT_LT(e.display, 1.01 * e.raw) << samples;
    EXPECT_GT(e.told, 0.6 * e.display) << samples;
    EXPECT_LT(e.told, 1.4 * e.display) << samples;
  }
}

TEST(DisplayLayer, KeepsBordersThatTheFirstHitsTell) {
  // So little apart that patches of noise do not tell.
  const Truth step = [](int x, int) { return x < 75 ? 1.0f : 1.3f; };
  for (const int what : {0, 1, 2, 3}) {
    Film film = noisy_film(step, 4);
    for (int y = 0; y < kHeight; ++y) {
      for (int x = 75; x < kWidth; ++x) {
        PixelFeatures& f = film.features(x, y);
        if (what == 0) f.depth = 2;
        if (what == 1) f.normal[0] = 1, f.normal[2] = 0;
        if (what == 2) f.albedo[0] = f.albedo[1] = f.albedo[2] = 0.3f;
        if (what == 3) f.albedo[0] = f.albedo[1] = f.albedo[2] = 0;
      }
    }
    const ResolvedTile tile = display_of(film);
    // Of the columns beside the border, over what those far from it have; their noise is averaged in both.
    const auto column = [&](int x) {
      double sum = 0;
      for (int y = 0; y < kHeight; ++y) sum += tile.display[0][std::size_t(y * kWidth + x)];
      return sum / kHeight;
    };
    EXPECT_NEAR(column(74), 1, 0.07) << what;
    EXPECT_NEAR(column(75), 1.3, 0.09) << what;
  }
}

TEST(DisplayLayer, LampsAreNoNeighboursOfADarkWall) {
  // Black, so that its radiance is its light; as bright as the wall's light, by what noise explains.
  const Truth step = [](int x, int) { return x < 75 ? 1.0f : 26.0f; };
  Film film = noisy_film(step, 4);
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      for (float& albedo : film.features(x, y).albedo) albedo = x < 75 ? 0.05f : 0.0f;
    }
  }
  const ResolvedTile tile = display_of(film);
  double beside = 0;
  for (int y = 0; y < kHeight; ++y) beside += tile.display[0][std::size_t(y * kWidth + 74)] / kHeight;
  EXPECT_NEAR(beside, 1, 0.08);
}

// Lamps of 3x3 pixels, thousands of times as bright as the wall that they hang on: the middle is all lamp, half of the
// rest. Albedo is the mean over the samples of half A, as a film has it.
struct LampFilm {
  static constexpr float kLamp = 4000, kAlbedo = 0.4f;
  Film film{kWidth, kHeight};

  // Pixels to the middle of the next lamp, the larger of both ways.
  static int distance(int x, int y) { return std::max(std::abs(x % 25 - 12), std::abs(y % 23 - 11)); }
  static float lamp_share(int x, int y) {
    const int d = distance(x, y);
    return d == 0 ? 1.0f : d == 1 ? 0.5f : 0.0f;
  }
  LampFilm(int samples_of_half, std::uint64_t seed) {
    Random random(seed);
    for (int y = 0; y < kHeight; ++y) {
      for (int x = 0; x < kWidth; ++x) {
        for (int h = 0; h < kHalves; ++h) {
          for (int k = 0; k < samples_of_half; ++k) {
            const bool lamp = random.next_double() < lamp_share(x, y);
            film.half(h, x, y).add(Rgb(lamp ? kLamp : exponential(1, random)));
            if (h == 0) film.features(x, y).add(Rgb(lamp ? 0 : kAlbedo), V3f(0, 0, 1), true);
          }
        }
        film.features(x, y).depth = 1;
      }
    }
  }
};

// Where both samples of a half miss all of a rim that the other half's found, nothing tells that it is no wall.
TEST(DisplayLayer, LampsHardlyLeakOnTheWallBesideThem) {
  struct Case {
    int samples;
    double leaks, brightness;  // at most: share of the pixels beside lamps, over the film's
  };
  for (const auto& [samples, most_leaks, most_brightness] :
       {Case{2, 0.01, 1.5}, Case{8, 0.002, 1.05}, Case{32, 0, 1.05}}) {
    double shown = 0, film = 0;
    int leaks = 0, pixels = 0;
    for (std::uint64_t seed = 1; seed <= 8; ++seed) {
      const LampFilm lamps(samples, seed);
      const ResolvedTile tile = display_of(lamps.film);
      for (int y = 0; y < kHeight; ++y) {
        for (int x = 0; x < kWidth; ++x) {
          const auto i = std::size_t(y * kWidth + x);
          if (LampFilm::distance(x, y) != 2) continue;
          ++pixels;
          leaks += tile.display[0][i] > std::max(tile.radiance[0][i], 5.0f);
          shown += tile.display[0][i];
          film += tile.radiance[0][i];
        }
      }
    }
    EXPECT_LE(leaks, most_leaks * pixels) << samples;
    EXPECT_LT(shown, most_brightness * film) << samples;
  }
}

TEST(DisplayLayer, RimsOfLampsAreAsBrightAsTheFilmHasThem) {
  double shown = 0, film = 0;
  for (std::uint64_t seed = 1; seed <= 4; ++seed) {
    const LampFilm lamps(2, seed);
    const ResolvedTile tile = display_of(lamps.film);
    for (int y = 0; y < kHeight; ++y) {
      for (int x = 0; x < kWidth; ++x) {
        const auto i = std::size_t(y * kWidth + x);
        if (LampFilm::distance(x, y) > 1) continue;
        shown += tile.display[0][i];
        film += tile.radiance[0][i];
      }
    }
  }
  EXPECT_NEAR(shown / film, 1, 0.06);
}

// Squares of the errors differ by a factor of a thousand.
TEST(DisplayLayer, ErrorIsToldWhereItIs) {
  double told[2] = {}, found[2] = {};  // at the lamps' rims | on the wall
  for (std::uint64_t seed = 1; seed <= 4; ++seed) {
    const LampFilm lamps(4, seed);
    const ResolvedTile tile = display_of(lamps.film);
    for (int y = 0; y < kHeight; ++y) {
      for (int x = 0; x < kWidth; ++x) {
        const auto i = std::size_t(y * kWidth + x);
        const int d = LampFilm::distance(x, y);
        if (d == 2) continue;  // beside them
        const double share = LampFilm::lamp_share(x, y), truth = share * LampFilm::kLamp + (1 - share);
        told[d > 2] += std::pow(double(tile.display_error[i]), 2);
        found[d > 2] += std::pow(double(tile.display[0][i]) - truth, 2);
      }
    }
  }
  for (const int where : {0, 1}) {
    EXPECT_GT(told[where], found[where] / 4) << where;
    EXPECT_LT(told[where], found[where] * 30) << where;
  }
}

TEST(DisplayLayer, KeepsTextures) {
  const auto albedo = [](int x, int y) { return (x / 2 + y / 3) % 2 ? 0.8f : 0.1f; };
  const Truth textured = [&](int x, int y) { return albedo(x, y); };
  Film film = noisy_film(textured, 4);
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      for (float& a : film.features(x, y).albedo) a = albedo(x, y);
    }
  }
  const Errors e = errors(display_of(film), textured);
  EXPECT_LT(e.display, 0.4 * e.raw);
}

TEST(DisplayLayer, FillsWhatHasNoSamples) {
  const Truth even = [](int, int) { return 2.0f; };
  Film film = noisy_film(even, 8);
  film.half(0, 40, 30) = film.half(1, 40, 30) = HalfPixel();
  film.half(1, 60, 30) = HalfPixel();
  const ResolvedTile tile = display_of(film);
  EXPECT_NEAR(tile.display[0][std::size_t(30 * kWidth + 40)], 2, 0.4);
  EXPECT_NEAR(tile.display[0][std::size_t(30 * kWidth + 60)], 2, 0.4);
}

// As after a move, where what comes into view has had one sample.
TEST(DisplayLayer, WhereOneHalfHasSamplesItIsFilteredAndTheFilmsErrorIsTold) {
  const Truth even = [](int, int) { return 2.0f; };
  Film film = noisy_film(even, 1);
  const PixelRect lone{40, 20, 90, 60}, inside{52, 32, 78, 48};
  for (int y = lone.y0; y < lone.y1; ++y) {
    for (int x = lone.x0; x < lone.x1; ++x) film.half(1, x, y) = HalfPixel();
  }
  film.half(0, 65, 40).sum[0] = 4000;  // a stray sample
  DisplayLayer layer(kWidth, kHeight);
  make(layer, film, film.bounds());
  const ResolvedTile tile = shown(&layer, film, inside);
  double square = 0, raw = 0;
  for (std::size_t i = 0; i < tile.display_error.size(); ++i) {
    EXPECT_GT(tile.display_error[i], 0.5f);
    if (tile.radiance[0][i] > 1000) {
      EXPECT_LT(tile.display[0][i], 100);
      continue;
    }
    square += std::pow(tile.display[0][i] - 2.0, 2);
    raw += std::pow(tile.radiance[0][i] - 2.0, 2);
  }
  EXPECT_LT(square, 0.3 * raw);
}

// Light that one sample in sixteen finds: where nine pixels have found none, they are not known to be black.
TEST(DisplayLayer, WhatHasFoundNoLightYetIsAsBrightAsAroundIt) {
  Film film = noisy_film([](int, int) { return 0.0f; }, 1);
  Random random(3);
  for (int h = 0; h < kHalves; ++h) {
    add_samples(film, h, 1, random, [](int, int, int, Random& r) { return r.next_double() < 1.0 / 16 ? 16.0f : 0.0f; });
  }
  const ResolvedTile tile = display_of(film);
  int dark = 0, black = 0;
  for (std::size_t i = 0; i < tile.display[0].size(); ++i) {
    dark += tile.display[0][i] < 0.05f;
    black += tile.radiance[0][i] == 0;
  }
  EXPECT_GT(black, 0.8 * kWidth * kHeight) << "of the film";
  EXPECT_LT(dark, 0.02 * kWidth * kHeight);
}

TEST(DisplayLayer, AHoleDoesNotBlurItsNeighbours) {
  // Each pixel has a radiance of its own, so that none is to be filtered.
  const Truth rough = [](int x, int y) { return 0.2f + float((x * 7919 + y * 104729) % 97) / 40; };
  const auto around_hole = [&](int halves) {
    Film film = noisy_film(rough, 4);
    for (int h = 0; h < halves; ++h) film.half(h, 40, 30) = HalfPixel();
    const ResolvedTile tile = display_of(film);
    double square = 0;
    for (int y = 25; y <= 35; ++y) {
      for (int x = 35; x <= 45; ++x) {
        if (x != 40 || y != 30)
          square += std::pow(double(tile.display[0][std::size_t(y * kWidth + x)]) - rough(x, y), 2);
      }
    }
    return std::sqrt(square);
  };
  const double whole = around_hole(0);
  EXPECT_LT(around_hole(1), 1.1 * whole);
  EXPECT_LT(around_hole(2), 1.1 * whole);
}

TEST(DisplayLayer, BitsDoNotDependOnTheOrderOfParts) {
  const Film film = noisy_film([](int x, int y) { return float(1 + x % 9 + y % 5); }, 3);
  DisplayLayer forwards(kWidth, kHeight), backwards(kWidth, kHeight);
  make(forwards, film, film.bounds());
  make(backwards, film, film.bounds(), true);
  const ResolvedTile a = shown(&forwards, film, film.bounds()), b = shown(&backwards, film, film.bounds());
  for (int c = 0; c < 3; ++c) EXPECT_EQ(a.display[c], b.display[c]);
  EXPECT_EQ(a.display_error, b.display_error);
}

TEST(DisplayLayer, PicturesMayBeOfAPixelOrAStrip) {
  for (const PixelRect& region : {PixelRect{0, 0, 1, 1}, PixelRect{0, 0, 150, 1}, PixelRect{149, 0, 150, 70}}) {
    const Film film = noisy_film([](int x, int) { return float(1 + x % 9); }, 3);
    DisplayLayer layer(kWidth, kHeight);
    make(layer, film, region);
    const ResolvedTile tile = shown(&layer, film, region);
    for (std::size_t i = 0; i < tile.display_error.size(); ++i) {
      ASSERT_TRUE(std::isfinite(tile.display[0][i]) && tile.display[0][i] >= 0);
      ASSERT_TRUE(std::isfinite(tile.display_error[i]));
    }
  }
}

TEST(DisplayLayer, IsTheSameInAnyUnit) {
  const auto of_unit = [](double unit) {
    Film film = noisy_film([](int x, int y) { return float(1 + x % 9 + y % 5); }, 3);
    for (int h = 0; h < kHalves; ++h) {
      for (int y = 0; y < kHeight; ++y) {
        for (int x = 0; x < kWidth; ++x) {
          HalfPixel& half = film.half(h, x, y);
          for (double& sum : half.sum) sum *= unit;
          for (float& deviation : half.deviations) deviation = float(deviation * unit * unit);
        }
      }
    }
    return display_of(film);
  };
  const ResolvedTile one = of_unit(1);
  for (const double unit : {0x1p-40, 0x1p40}) {
    const ResolvedTile other = of_unit(unit);
    for (std::size_t i = 0; i < one.display_error.size(); ++i) {
      ASSERT_NEAR(other.display[0][i] / unit, one.display[0][i], 2e-3 * one.display[0][i]) << unit << ' ' << i;
      ASSERT_NEAR(other.display_error[i] / unit, one.display_error[i], 2e-2 * one.display_error[i]) << unit << ' ' << i;
    }
  }
}

TEST(DisplayLayer, IsFiniteInExtremeUnits) {
  for (const double unit : {0x1p-120, 0x1p-80, 0x1p80, 0x1p120}) {
    Film film = noisy_film([](int x, int y) { return float(1 + x % 9 + y % 5); }, 3);
    double mean = 0;
    for (int h = 0; h < kHalves; ++h) {
      for (int y = 0; y < kHeight; ++y) {
        for (int x = 0; x < kWidth; ++x) {
          HalfPixel& half = film.half(h, x, y);
          for (double& sum : half.sum) sum *= unit;
          for (float& deviation : half.deviations) deviation = float(std::min(deviation * unit * unit, 0x1p127));
          mean += half.sum[0] / (2 * 3 * kWidth * kHeight);
        }
      }
    }
    const ResolvedTile tile = display_of(film);
    double shown = 0;
    for (std::size_t i = 0; i < tile.display_error.size(); ++i) {
      ASSERT_TRUE(std::isfinite(tile.display[0][i]) && !std::isnan(tile.display_error[i])) << unit << ' ' << i;
      shown += double(tile.display[0][i]) / double(tile.display_error.size());
    }
    EXPECT_NEAR(shown / mean, 1, 0.05) << unit;
  }
}

TEST(DisplayLayer, ExtremePixelsStayWhereTheyAre) {
  const Truth even = [](int, int) { return 1.0f; };
  for (const double extreme : {1e6, 1e20, 1e37, -1e6}) {
    Film film = noisy_film(even, 4);
    for (int h = 0; h < kHalves; ++h) film.half(h, 75, 35).sum[0] = 4 * extreme;
    const ResolvedTile tile = display_of(film);
    for (int y = 0; y < kHeight; ++y) {
      for (int x = 0; x < kWidth; ++x) {
        const auto i = std::size_t(y * kWidth + x);
        ASSERT_TRUE(std::isfinite(tile.display[0][i]) && std::isfinite(tile.display_error[i])) << extreme;
        if (std::abs(x - 75) > 20) {
          ASSERT_LT(std::fabs(tile.display[0][i]), 20) << extreme << ' ' << x << ' ' << y;
        }
      }
    }
  }
}

TEST(DisplayLayer, ABlackFilmIsBlack) {
  const ResolvedTile tile = display_of(noisy_film([](int, int) { return 0.0f; }, 2));
  for (std::size_t i = 0; i < tile.display_error.size(); ++i) {
    ASSERT_EQ(tile.display[0][i], 0);
    ASSERT_EQ(tile.display_error[i], 0);
  }
  const Film none(kWidth, kHeight);
  const ResolvedTile empty = display_of(none);
  for (std::size_t i = 0; i < empty.display_error.size(); ++i) {
    ASSERT_EQ(empty.display[0][i], 0);
    ASSERT_EQ(empty.display_error[i], std::numeric_limits<float>::infinity());
  }
}

TEST(DisplayLayer, GivenUpItStaysAsItWas) {
  const Film few = noisy_film([](int x, int) { return float(1 + x); }, 2);
  const Film more = noisy_film([](int x, int) { return float(1 + x); }, 8);
  DisplayLayer layer(kWidth, kHeight);
  make(layer, few, few.bounds());
  const std::vector<float> before = shown(&layer, few, few.bounds()).display[0];
  layer.begin(few.bounds());
  for (std::size_t i = 0; i < layer.parts(); ++i) layer.run(more, 0, i);
  layer.finish_sweep(0);
  layer.run(more, 1, 0);
  EXPECT_TRUE(layer.known());
  EXPECT_EQ(shown(&layer, few, few.bounds()).display[0], before);
  layer.begin({1, 1, 20, 20});
  EXPECT_FALSE(layer.known());
}

TEST(DisplayLayer, ShowsTheFilmWhereItHasNoPicture) {
  const Film film = noisy_film([](int x, int) { return float(1 + x); }, 2);
  DisplayLayer layer(kWidth, kHeight);
  const PixelRect region{30, 10, 90, 60};
  make(layer, film, region);
  const ResolvedTile inside = shown(&layer, film, region), beyond = shown(&layer, film, film.bounds());
  EXPECT_NE(inside.display[0], inside.radiance[0]);
  EXPECT_EQ(beyond.display[0], beyond.radiance[0]);
  layer.forget();
  EXPECT_EQ(shown(&layer, film, region).display[0], inside.radiance[0]);
  const ResolvedTile without = shown(nullptr, film, region);
  EXPECT_EQ(without.display[0], inside.radiance[0]);
  EXPECT_FLOAT_EQ(without.display_error[0], std::sqrt((without.variance[0][0] + without.variance[1][0] +
                                                       without.variance[2][0]) / 3));
}

}  // namespace
}  // namespace helio::test
