// Films to which light paths bring splats: means, variance and the picture's error are those of samples and splats.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "renderer/film/allocation/sample_demand.h"
#include "renderer/film/estimate/resolve.h"
#include "renderer/film/splats/splat_buffer.h"
#include "tests/unit/picture/synthetic_film.h"

namespace helio {
namespace {

using test::Random;

constexpr FilmState kSplats{.splats = true};

// `per_pixel` light paths a pixel in a half, each of which brings a random pixel of the region exponential noise around
// `mean`: the pixel's mean over the half has the variance mean^2 (2 - 1 / pixels) / per_pixel.
void add_splats(Film& film, int half, int per_pixel, float mean, Random& random) {
  const int pixels = film.width() * film.height();
  std::vector<Splat> splats(std::size_t(pixels) * std::size_t(per_pixel));
  for (Splat& splat : splats) {
    splat.x = std::int32_t(random.next_double() * film.width());
    splat.y = std::int32_t(random.next_double() * film.height());
    splat.radiance = Rgb(test::exponential(mean, random) * float(pixels));
  }
  film.splats()->add(half, splats, splats.size());
}

TEST(SplatFilm, MeansAreThoseOfSamplesPlusThoseOfSplats) {
  Film film(3, 1, kSplats);
  const std::vector<Splat> splats = {{0, 0, Rgb(8)}, {1, 0, Rgb(8)}, {2, 0, Rgb(8)}};
  film.splats()->add(0, splats, 16);  // 0.5
  film.splats()->add(1, splats, 4);   // 2
  for (int i = 0; i < 3; ++i) film.half(0, 0, 0).add(Rgb(1));
  film.half(1, 0, 0).add(Rgb(3));
  film.half(1, 1, 0).add(Rgb(3));
  EXPECT_EQ(resolve_mean(film, 0, 0), Rgb(3.25f)) << "((1 + 0.5) + (3 + 2)) / 2, whatever the counts";
  EXPECT_EQ(resolve_mean(film, 1, 0), Rgb(5)) << "one half alone";
  EXPECT_EQ(resolve_mean(film, 2, 0), Rgb(0)) << "no samples, no mean";
  for (const unsigned channels : {0u, unsigned(kResolveVariance)}) {
    const ResolvedTile tile = resolve_tile(film, film.bounds(), film.bounds(), channels);
    for (const auto& channel : tile.radiance) EXPECT_EQ(channel, (std::vector<float>{3.25f, 5, 0})) << channels;
  }
  const ResolvedTile tile = resolve_tile(film, film.bounds(), film.bounds(), kResolveVariance);
  EXPECT_EQ(tile.variance[0][0], 3.0625f) << "((1.5 - 5) / 2)^2: the only pixel with both halves";
  EXPECT_EQ(tile.variance[0][1], 1.53125f) << "(5 - 3.25)^2 / 2: the only neighbours with means";
}

TEST(SplatFilm, HasTheBitsOfAnyFilmWhereNothingLands) {
  constexpr int kWidth = 37, kHeight = 21;
  for (const bool targets : {false, true}) {
    Film plain(kWidth, kHeight, {.targets = targets}), film(kWidth, kHeight, {.targets = targets, .splats = true});
    for (Film* f : {&plain, &film}) {
      Random random(6);
      test::add_samples(*f, 0, 4, random, [](int x, int, int, Random& r) { return test::exponential(float(x), r); });
      test::add_samples(*f, 1, 3, random, [](int x, int, int, Random& r) { return test::exponential(float(x), r); });
      for (int x = 0; x < 9; ++x) f->half(0, x, 4) = {};
    }
    film.splats()->add(0, {}, 1000);
    const ResolvedTile a = resolve_tile(plain, plain.bounds(), plain.bounds(), kResolveAll);
    const ResolvedTile b = resolve_tile(film, film.bounds(), film.bounds(), kResolveAll);
    for (int c = 0; c < 3; ++c) {
      EXPECT_EQ(a.radiance[c], b.radiance[c]);
      EXPECT_EQ(a.variance[c], b.variance[c]);
    }
    EXPECT_EQ(sum_of_means(plain, plain.bounds(), 0), sum_of_means(film, film.bounds(), 0));
  }
}

// Windows and regions as for any film: the bits of a pixel depend on its neighbourhood alone.
TEST(SplatFilm, ResolvesToTheSameBitsHoweverItIsCut) {
  Film film(50, 30, kSplats);
  Random random(7);
  for (int h = 0; h < kHalves; ++h) {
    test::add_samples(film, h, 2, random, [](int, int, int, Random& r) { return test::exponential(1, r); });
    add_splats(film, h, 2, 0.5f, random);
  }
  film.half(1, 20, 11) = {};
  const ResolvedTile whole = resolve_tile(film, film.bounds(), film.bounds(), kResolveAll);
  for (const PixelRect& window : {PixelRect{0, 0, 25, 30}, PixelRect{13, 7, 31, 19}, PixelRect{20, 11, 21, 12}}) {
    const ResolvedTile part = resolve_tile(film, window, film.bounds(), kResolveAll);
    const ResolvedTile bare = resolve_tile(film, window, film.bounds(), 0);
    std::size_t i = 0;
    for (int y = window.y0; y < window.y1; ++y) {
      for (int x = window.x0; x < window.x1; ++x, ++i) {
        const auto j = std::size_t(y) * 50 + std::size_t(x);
        ASSERT_EQ(part.radiance[1][i], whole.radiance[1][j]);
        ASSERT_EQ(bare.radiance[1][i], whole.radiance[1][j]);
        ASSERT_EQ(resolve_mean(film, x, y)[1], whole.radiance[1][j]);
        ASSERT_EQ(part.variance[1][i], whole.variance[1][j]);
      }
    }
  }
}

// Samples of exponential noise, variance 1 / 8 of the mean of 4 + 4, and splats of mean 0.5, 0.25 (2 - 1/P) / 6 of that
// of 3 + 3 light paths a pixel. Over 64 x 64 pixels the mean of the estimates has a relative standard deviation of
// about 0.04 (squares of differences, each in 49 neighbourhoods): seeds are fixed, and 0.12 is three of them.
TEST(SplatFilm, VarianceIsThatOfSamplesAndSplats) {
  constexpr int kSide = 64;
  Film film(kSide, kSide, kSplats);
  Random random(8);
  for (int h = 0; h < kHalves; ++h) {
    test::add_samples(film, h, 4, random, [](int, int, int, Random& r) { return test::exponential(1, r); });
    add_splats(film, h, 3, 0.5f, random);
  }
  const double expected = 1.0 / 8 + 0.25 * (2 - 1.0 / (kSide * kSide)) / 6;
  EXPECT_NEAR(test::mean_of(test::variance_of(film)) / expected, 1, 0.12);
  const FilmError error = estimate_error(film, film.bounds());
  ASSERT_TRUE(error.known);
  EXPECT_NEAR(error.rmse * error.rmse / expected, 1, 0.12);
  EXPECT_NEAR(error.relmse / (expected / (1.5 * 1.5 * 1.01)), 1, 0.15);
  EXPECT_EQ(error.unproven, 0);
  EXPECT_NEAR(test::mean_of(resolve_tile(film, film.bounds(), film.bounds(), 0).radiance[0]) / 1.5, 1, 0.03);
}

// The samples are without noise: what there is comes from splats alone, in the left half of the film.
TEST(SplatFilm, VarianceSitsWhereSplatsLand) {
  constexpr int kWidth = 64, kHeight = 32, kPerPixel = 4;
  Film film(kWidth, kHeight, kSplats);
  Random random(9);
  constexpr int kPaths = kWidth * kHeight * kPerPixel;
  for (int h = 0; h < kHalves; ++h) {
    test::add_samples(film, h, 2, random, [](int, int, int, Random&) { return 1.0f; });
    std::vector<Splat> splats;
    for (int i = 0; i < kPaths; ++i) {
      const auto x = std::int32_t(random.next_double() * kWidth), y = std::int32_t(random.next_double() * kHeight);
      if (x < kWidth / 2) splats.push_back({x, y, Rgb(float(kWidth * kHeight))});
    }
    film.splats()->add(h, splats, kPaths);
  }
  const std::vector<float> variance = test::variance_of(film);
  double left = 0;
  for (int y = 0; y < kHeight; ++y) {
    const float* row = variance.data() + std::size_t(y * kWidth);
    for (int x = 0; x < kWidth / 2 - 3; ++x) left += row[x];
    for (int x = kWidth / 2 + 3; x < kWidth; ++x) EXPECT_EQ(row[x], 0);
  }
  left /= (kWidth / 2 - 3) * kHeight;
  EXPECT_NEAR(left / (1.0 / (2 * kPerPixel)), 1, 0.15) << "a count of 4 a half, each worth 1 / 4: 4 / 16, halved";
}

// Splats land in even columns alone, with the variance v of the mean. Of the seven columns around an odd one four are
// even: D = 4/7 v, and D / 2 is what a pixel without spread of its own gets. Around an even one three are, and its q is
// 7/3 of those around: 3/7 v (1/2 + 1/2 7/3). That is 2.5 times as much; without the splats' spread both would get D.
TEST(SplatFilm, VarianceIsShapedByTheSpreadOfSplats) {
  constexpr int kSide = 64, kPerPixel = 4;
  Film film(kSide, kSide, kSplats);
  Random random(11);
  for (int h = 0; h < kHalves; ++h) {
    test::add_samples(film, h, 2, random, [](int, int, int, Random&) { return 1.0f; });
    std::vector<Splat> splats;
    for (int i = 0; i < kSide * kSide * kPerPixel; ++i) {
      const auto x = std::int32_t(random.next_double() * kSide), y = std::int32_t(random.next_double() * kSide);
      if (x % 2 == 0) splats.push_back({x, y, Rgb(float(kSide * kSide))});
    }
    film.splats()->add(h, splats, kSide * kSide * kPerPixel);
  }
  const std::vector<float> variance = test::variance_of(film);
  double of[2] = {0, 0};
  for (int y = 0; y < kSide; ++y) {
    for (int x = 8; x < kSide - 8; ++x) of[x % 2] += variance[std::size_t(y * kSide + x)];
  }
  EXPECT_NEAR(of[0] / of[1], 2.5, 0.2);
  EXPECT_NEAR(of[1] / (kSide * (kSide / 2 - 8)) / (2.0 / 7 / (2 * kPerPixel)), 1, 0.15);
}

// Counts differ from pixel to pixel as dithered powers of two do. The samples' part of the estimate follows the pixel's
// own count; that of the splats is 1/2 + 1/2 n/n_own of theirs, n: mean around (variance_pool.h), on average 1 1/16.
TEST(SplatFilm, VarianceWhereCountsDifferIsNearlyThatOfSamplesAndSplats) {
  constexpr int kSide = 64;
  Film film(kSide, kSide, {.targets = true, .splats = true});
  Random random(12);
  for (int h = 0; h < kHalves; ++h) {
    for (int y = 0; y < kSide; ++y) {
      for (int x = 0; x < kSide; ++x) {
        for (int k = 0; k < 4 << (x + y) % 2; ++k) film.half(h, x, y).add(Rgb(test::exponential(1, random)));
      }
    }
    add_splats(film, h, 3, 0.5f, random);
  }
  const std::vector<float> variance = test::variance_of(film);
  double few = 0, many = 0;
  for (int y = 0; y < kSide; ++y) {
    for (int x = 0; x < kSide; ++x) ((x + y) % 2 == 0 ? few : many) += variance[std::size_t(y * kSide + x)];
  }
  const double splats = 0.25 * 2 / 6, pixels = kSide * kSide / 2;
  EXPECT_NEAR(few / pixels / (1.0 / 8 + 1.25 * splats), 1, 0.12);
  EXPECT_NEAR(many / pixels / (1.0 / 16 + 0.875 * splats), 1, 0.12);
  EXPECT_NEAR(std::pow(estimate_error(film, film.bounds()).rmse, 2) / (3.0 / 32 + splats), 1, 0.12);
}

// Black that reflects is unproven; a pixel on which any light landed is not, and neither are those around it.
TEST(SplatFilm, LightThatLandedProvesThatAPixelIsNotBlack) {
  constexpr int kSide = 40;
  Film film(kSide, kSide, kSplats);
  Random random(10);
  for (int h = 0; h < kHalves; ++h) test::add_samples(film, h, 2, random, [](int, int, int, Random&) { return 0.0f; });
  for (int y = 0; y < kSide; ++y) {
    for (int x = 0; x < kSide; ++x) film.features(x, y).add(Rgb(0.5f), V3f(0, 0, 1), true);
  }
  EXPECT_EQ(estimate_error(film, film.bounds()).unproven, 1);
  EXPECT_TRUE(std::isinf(estimate_error(film, film.bounds()).hidden_rmse)) << "nothing was seen at all";
  film.splats()->add(0, std::vector<Splat>{{20, 20, Rgb(1e-20f)}}, 1u << 20);
  const FilmError lit = estimate_error(film, film.bounds());
  EXPECT_DOUBLE_EQ(lit.unproven, 1 - 49.0 / (kSide * kSide));
  // Of U pixels of four samples each, none of which saw light: a share of 3 / (4 U) may, each as bright as the splat
  // was, over the area: (3 / (4 U)) L^2 (U / 4) / area.
  film.splats()->add(1, std::vector<Splat>{{20, 20, Rgb(3200)}}, 1u << 20);
  const double brightest = 3200.0 / (kSide * kSide);
  EXPECT_NEAR(estimate_error(film, film.bounds()).hidden_rmse,
              std::sqrt(3.0 / 16 * brightest * brightest / (kSide * kSide)), 1e-9);
}

TEST(SplatFilm, CountsInvalidSplatsBesideSamples) {
  Film film(8, 8, kSplats);
  film.add_invalid(0, 1, 1);
  film.splats()->add(0, std::vector<Splat>{{1, 1, Rgb(NAN)}, {7, 7, Rgb(NAN)}, {8, 8, Rgb(1)}}, 3);
  EXPECT_EQ(resolve_tile(film, {0, 0, 4, 4}, film.bounds(), 0).invalid_samples, 2u);
  EXPECT_EQ(film.attempted(0, 1, 1), 1u) << "a splat is no sample of the pixel's";
}

TEST(SplatFilm, SplatsGoWithTheWholeFilm) {
  Film film(8, 8, kSplats);
  EXPECT_EQ(film.state(), kSplats);
  EXPECT_EQ(Film(8, 8).splats(), nullptr);
  EXPECT_EQ(Film::bytes_per_pixel(kSplats), Film::bytes_per_pixel({}) + SplatBuffer::kBytesPerPixel);
  EXPECT_GE(film.bytes(), Film(8, 8).bytes() + 64 * SplatBuffer::kBytesPerPixel);
  film.half(0, 2, 2).add(Rgb(1));
  film.splats()->add(0, std::vector<Splat>{{2, 2, Rgb(1)}}, 1);
  film.clear({0, 0, 4, 4});
  EXPECT_EQ(film.half(0, 2, 2).count, 0u);
  EXPECT_EQ(film.splats()->light_paths(0), 1u) << "a new picture's pieces clear what an older left, one by one";
  EXPECT_EQ(film.splats()->mean(0, 2, 2), Rgb(1));
  film.clear();
  EXPECT_TRUE(*film.splats() == SplatBuffer(8, 8));
}

// Where counts follow demand, splats are part of the mean that a relative error is relative to; their noise is not the
// pixel's own.
TEST(SplatFilm, DemandIsRelativeToTheWholeMean) {
  Film film(9, 9, {.targets = true, .splats = true});
  for (int y = 0; y < 9; ++y) {
    for (int x = 0; x < 9; ++x) {
      for (int h = 0; h < kHalves; ++h) {
        film.half(h, x, y).add(Rgb(0));
        film.half(h, x, y).add(Rgb(2));
      }
      film.splats()->add(1, std::vector<Splat>{{x, y, Rgb(4)}}, 0);
    }
  }
  film.splats()->add(1, {}, 2);
  int visited = 0;
  for (int h = 0; h < kHalves; ++h) {
    // What half h is given follows from what the other one saw: a mean of 1, and 2 of splats in half B.
    const double mean = h == 0 ? 3 : 1;
    EXPECT_EQ(sum_of_means(film, film.bounds(), 1 - h), 81 * 3 * mean);
    find_demand(film, film.bounds(), film.bounds(), h, AllocationMeasure::relative, 0, DemandPixels::all,
                [&](int, int, const PixelDemand& demand) {
                  EXPECT_NEAR(demand.squared, 3 * 2 / (mean * mean), 1e-5) << "variance of {0, 2}: 2";
                  ++visited;
                });
  }
  EXPECT_EQ(visited, 2 * 81);
}

// With all light tiles off a film is one without splats, as long as they are.
TEST(SplatFilm, TilesThatAreAllOffHideThem) {
  Film film(40, 40, {.splats = true});
  auto tiles = std::make_shared<LightTiles>(40, 40, false);
  film.set_light_tiles(tiles);
  EXPECT_EQ(film.splats(), nullptr);
  EXPECT_TRUE(film.state().splats);
  film.set_light_tiles(nullptr);
  EXPECT_NE(film.splats(), nullptr);
  tiles = std::make_shared<LightTiles>(40, 40, false);
  tiles->set(1, true);
  film.set_light_tiles(tiles);
  EXPECT_NE(film.splats(), nullptr);
}

}  // namespace
}  // namespace helio
