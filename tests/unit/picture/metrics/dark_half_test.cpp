// The dark half of a picture.
#include "renderer/metrics/dark_half.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

namespace helio {
namespace {

// Luminance of greys 1, 2, 3, 40: the dark half is 1 and 2, their mean 1.5. Differences 0.5 and -0.2.
TEST(DarkHalf, IsComparedWithItsOwnMean) {
  const float reference[4] = {40, 1, 3, 2}, picture[4] = {0, 1.5f, 9, 1.8f};
  const PictureView r{2, 2, {reference, reference, reference}}, x{2, 2, {picture, picture, picture}};
  const DarkHalf dark = compare_dark_half(x, r);
  EXPECT_NEAR(dark.bias, (0.5 - 0.2) / 2 / 1.5, 1e-7);
  const double epsilon = 1e-2 * 1.5 * 1.5;
  EXPECT_NEAR(dark.relmse, (0.25 / (1 + epsilon) + 0.04 / (4 + epsilon)) / 2, 1e-7);
}

TEST(DarkHalf, OfNothingButBlackIsNotANumber) {
  const float reference[3] = {0, 0, 5}, picture[3] = {1, 0, 5};
  const PictureView r{3, 1, {reference, reference, reference}}, x{3, 1, {picture, picture, picture}};
  EXPECT_TRUE(std::isnan(compare_dark_half(x, r).bias));
  EXPECT_TRUE(std::isnan(compare_dark_half(x, r).relmse));
}

// Five pixels: half of them are three, and the fourth is as bright as the third.
TEST(DarkHalf, HasTiesWithItsBrightestPixel) {
  const float reference[5] = {2, 7, 1, 2, 0};
  const PictureView r{5, 1, {reference, reference, reference}};
  EXPECT_EQ(dark_half_pixels(r), (std::vector<std::size_t>{0, 2, 3, 4}));
  EXPECT_TRUE(dark_half_pixels({}).empty());
}

}  // namespace
}  // namespace helio
