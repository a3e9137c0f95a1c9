#include "renderer/film/film.h"

#include <gtest/gtest.h>

#include <limits>

#include "renderer/film/resolve.h"

namespace helio {
namespace {

TEST(Film, StartsEmptyAndClearsToEmpty) {
  Film film(7, 13);
  EXPECT_EQ(film.bounds(), (PixelRect{0, 0, 7, 13}));
  EXPECT_GE(film.bytes(), std::size_t(7 * 13) * (2 * sizeof(HalfPixel) + sizeof(PixelFeatures)));
  film.half(1, 6, 12).add(Rgb(1, 2, 3));
  film.features(6, 12).instance = 4;
  EXPECT_EQ(film.half(1, 6, 12).count, 1u);
  EXPECT_EQ(film.half(1, 6, 12).sum_squares[2], 9.0);
  film.clear();
  EXPECT_EQ(film.half(1, 6, 12).count, 0u);
  EXPECT_EQ(film.half(1, 6, 12).sum[0], 0.0);
  EXPECT_EQ(film.features(6, 12).instance, ~0u);
}

TEST(Film, TakesTheShapesOfTheHardCases) {
  for (const auto& [width, height] : {std::pair{1, 1}, {7, 13}, {16384, 1}, {1, 16384}}) {
    Film film(width, height);
    film.half(0, width - 1, height - 1).add(Rgb(2.0f));
    film.half(1, width - 1, height - 1).add(Rgb(4.0f));
    const ResolvedTile tile = resolve_tile(film, film.bounds(), film.bounds(), kResolveAll);
    EXPECT_EQ(tile.radiance[1].back(), 3.0f);
    EXPECT_EQ(tile.variance[1].back(), 1.0f) << "((2 - 4) / 2)^2: no other pixel has samples";
  }
}

// A float sum of 0.1 over 1e8 samples ends at 2,097,152 (a mean of 0.02); a double sum rounds at most 1e8 times by
// 2^-54 of itself on average, a relative drift far below 1e-8.
TEST(Film, HundredMillionSamplesDoNotDrift) {
  HalfPixel pixel;
  for (int i = 0; i < 100'000'000; ++i) pixel.add(Rgb(0.1f, 1e9f, 1e-6f));
  EXPECT_EQ(pixel.count, 100'000'000u);
  EXPECT_NEAR(pixel.sum[0] / pixel.count / double(0.1f), 1.0, 1e-8);
  EXPECT_NEAR(pixel.sum[1] / pixel.count / double(1e9f), 1.0, 1e-8);
  EXPECT_NEAR(pixel.sum[2] / pixel.count / double(1e-6f), 1.0, 1e-8);
}

}  // namespace
}  // namespace helio
