#include "renderer/film/core/film.h"

#include <gtest/gtest.h>

#include <limits>

#include "renderer/film/core/film_extension.h"
#include "renderer/film/estimate/resolve.h"

namespace helio {
namespace {

TEST(Film, StartsEmptyAndClearsToEmpty) {
  Film film(7, 13);
  EXPECT_EQ(film.bounds(), (PixelRect{0, 0, 7, 13}));
  EXPECT_GE(film.bytes(), 7 * 13 * Film::bytes_per_pixel({}));
  EXPECT_GE(Film(7, 13, FilmState{.targets = true}).bytes(),
            7 * 13 * Film::bytes_per_pixel(FilmState{.targets = true}));
  film.half(1, 6, 12).add(Rgb(1, 2, 3));
  film.features(6, 12).primitive = 4;
  EXPECT_EQ(film.half(1, 6, 12).count, 1u);
  EXPECT_EQ(film.half(1, 6, 12).sum_squares(2), 9.0);
  film.clear();
  EXPECT_EQ(film.half(1, 6, 12).count, 0u);
  EXPECT_EQ(film.half(1, 6, 12).sum[0], 0.0);
  EXPECT_EQ(film.features(6, 12).primitive, ~0u);
}

TEST(Film, AnExtensionIsMadeClearedAndCountedWithIt) {
  struct Bytes final : FilmExtension {
    Bytes(int width, int height) : size(std::size_t(width) * std::size_t(height)) {}
    void clear(const PixelRect& window) override { cleared += window.area(); }
    void forget() override {}
    std::size_t bytes() const override { return size; }
    std::size_t size;
    std::int64_t cleared = 0;
  };
  static constexpr auto make = [](int width, int height) -> std::unique_ptr<FilmExtension> {
    return std::make_unique<Bytes>(width, height);
  };
  static constexpr FilmExtensionKind kind{1, make}, another{1, make};
  Film film(7, 13, {.extension = &kind});
  EXPECT_EQ(film.state(), FilmState{.extension = &kind});
  EXPECT_NE(film.state(), FilmState{.extension = &another});
  EXPECT_NE(film.state(), FilmState{});
  EXPECT_EQ(Film::bytes_per_pixel(film.state()), Film::bytes_per_pixel({}) + 1);
  EXPECT_EQ(film.bytes(), Film(7, 13).bytes() + 7 * 13);
  film.clear({1, 2, 4, 6});
  const auto& extension = static_cast<const Bytes&>(*film.extension());
  EXPECT_EQ(extension.cleared, 3 * 4);
  film.clear();
  EXPECT_EQ(extension.cleared, 3 * 4 + 7 * 13);
  EXPECT_EQ(Film(7, 13).extension(), nullptr);
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

// Sums of squares less squares of sums leave nothing of a deviation of 1e-9; what is added up here keeps its digits,
// and goes on growing beyond the 2^24 terms where a float sum would stand still.
TEST(Film, DeviationsKeepTheirDigits) {
  HalfPixel pixel;
  for (int i = 0; i < 50'000'000; ++i) {
    const float x = i % 2 == 0 ? 1.0f : -1.0f;
    pixel.add(Rgb(1e9f + 64 * x, 1e-6f * (2 + x), 0.5f));
  }
  EXPECT_NEAR(pixel.deviations[0] / (4096.0 * pixel.count), 1.0, 1e-3);
  EXPECT_NEAR(pixel.deviations[1] / (1e-12 * pixel.count), 1.0, 1e-3);
  EXPECT_EQ(pixel.deviations[2], 0.0f);
  for (const float x : {3e38f, -3e38f, 3e38f}) pixel.add(Rgb(x));
  EXPECT_EQ(pixel.deviations[0], 0x1p127f) << "too large to be told";
}

TEST(Film, CountsInvalidSamplesApart) {
  Film film(5, 4);
  EXPECT_EQ(film.invalid_in(film.bounds()), 0u);
  film.add_invalid(0, 1, 2);
  film.add_invalid(1, 4, 3, 7);
  EXPECT_EQ(film.invalid(0, 1, 2), 1u);
  EXPECT_EQ(film.invalid_in(film.bounds()), 8u);
  EXPECT_EQ(film.invalid_in({0, 0, 4, 4}), 1u);
  film.clear({0, 0, 2, 3});
  EXPECT_EQ(film.invalid_in(film.bounds()), 7u);
  film.clear();
  EXPECT_EQ(film.invalid_in(film.bounds()), 0u);
}

// Counts stay exact and means keep following their samples beyond 2^24 of them, where a float sum stands still.
TEST(Film, FeaturesStayRightBeyondTheFloatsDigits) {
  PixelFeatures f;
  std::uint32_t hits = 0;
  for (std::uint32_t i = 1; i <= (1u << 25) + 1; ++i) {
    const bool hit = i % 4 != 0;
    hits += hit;
    f.add(hit ? Rgb(0.8f, 1, 0.3f) : Rgb(0, 0, 0), hit ? V3f(0, -0.6f, 0.8f) : V3f(0, 0, 0), hit);
    if ((i & (i - 1)) != 0) continue;
    const double share = double(hits) / i;
    ASSERT_EQ(f.count, i);
    ASSERT_EQ(f.hits, hits);
    ASSERT_NEAR(f.albedo[0], share * 0.8f, 1e-4);
    ASSERT_NEAR(f.albedo[1], share, 1e-4);
    ASSERT_NEAR(f.albedo[2], share * 0.3f, 1e-4);
    ASSERT_NEAR(f.normal[1], share * -0.6f, 1e-4);
    ASSERT_NEAR(f.normal[2], share * 0.8f, 1e-4);
  }
  EXPECT_EQ(sizeof(PixelFeatures), 40u);
}

// What never changes is kept to the bit.
TEST(Film, ConstantFeaturesAreExact) {
  PixelFeatures f;
  for (int i = 0; i < 1000; ++i) f.add(Rgb(0.1f, 0.6f, 1), V3f(0.36f, -0.48f, 0.8f), true);
  EXPECT_EQ(f.albedo[0], 0.1f);
  EXPECT_EQ(f.albedo[1], 0.6f);
  EXPECT_EQ(f.normal[1], -0.48f);
}

}  // namespace
}  // namespace helio
