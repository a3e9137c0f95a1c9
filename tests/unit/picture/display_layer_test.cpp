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
    const Errors e = errors(display_of(noisy_film(even, samples)), even);
    EXPECT_LT(e.display, 0.35 * e.raw) << samples;
    EXPECT_GT(e.told, 0.6 * e.display) << samples;
    EXPECT_LT(e.told, 1.7 * e.display) << samples;
  }
}

TEST(DisplayLayer, IsNoWorseThanTheFilmWhereNothingIsSmooth) {
  // Each pixel has a radiance of its own, which no feature tells.
  const Truth rough = [](int x, int y) { return 0.2f + float((x * 7919 + y * 104729) % 97) / 40; };
  for (const int samples : {2, 8, 32, 512, 1 << 14}) {
    const Errors e = errors(display_of(noisy_film(rough, samples)), rough);
    EXPECT_LT(e.display, 1.05 * e.raw) << samples;
    EXPECT_GT(e.told, 0.6 * e.display) << samples;
    EXPECT_LT(e.told, 1.7 * e.display) << samples;
  }
}

TEST(DisplayLayer, KeepsBordersThatTheFirstHitsTell) {
  const Truth step = [](int x, int) { return x < 75 ? 1.0f : 10.0f; };
  for (const int what : {0, 1, 2}) {
    Film film = noisy_film(step, 4);
    for (int y = 0; y < kHeight; ++y) {
      for (int x = 75; x < kWidth; ++x) {
        PixelFeatures& f = film.features(x, y);
        if (what == 0) f.depth = 2;
        if (what == 1) f.normal[0] = 1, f.normal[2] = 0;
        if (what == 2) f.albedo[0] = f.albedo[1] = f.albedo[2] = 0.3f;
      }
    }
    const ResolvedTile tile = display_of(film);
    double left = 0, right = 0;
    for (int y = 0; y < kHeight; ++y) {
      left += tile.display[0][std::size_t(y * kWidth + 74)] / kHeight;
      right += tile.display[0][std::size_t(y * kWidth + 75)] / kHeight;
    }
    EXPECT_NEAR(left, 1, 0.15) << what;
    EXPECT_NEAR(right, 10, 1) << what;
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

TEST(DisplayLayer, BitsDoNotDependOnTheOrderOfParts) {
  const Film film = noisy_film([](int x, int y) { return float(1 + x % 9 + y % 5); }, 3);
  DisplayLayer forwards(kWidth, kHeight), backwards(kWidth, kHeight);
  make(forwards, film, film.bounds());
  make(backwards, film, film.bounds(), true);
  const ResolvedTile a = shown(&forwards, film, film.bounds()), b = shown(&backwards, film, film.bounds());
  for (int c = 0; c < 3; ++c) EXPECT_EQ(a.display[c], b.display[c]);
  EXPECT_EQ(a.display_error, b.display_error);
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
  for (std::size_t i = 0; i < empty.display_error.size(); ++i) ASSERT_EQ(empty.display[0][i], 0);
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
