#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "client/report/pictures/difference_maps.h"
#include "client/report/pictures/picture_choice.h"
#include "client/report/pictures/rgbe_bytes.h"

namespace helio::report {
namespace {

// Back to radiance as the page's script does it.
TEST(RgbeBytes, KeepRadianceWithinTheirMantissa) {
  const int width = 8, height = 2;
  std::vector<float> channels[3];
  for (int i = 0; i < width * height; ++i) {
    channels[0].push_back(std::ldexp(0.999f + 0.0005f * float(i), 4 * i - 30));  // at a carry of the mantissa, too
    channels[1].push_back(0.5f * channels[0].back());
    channels[2].push_back(i == 3 ? -1.0f : 0.0f);
  }
  channels[0][5] = channels[1][5] = 0;
  channels[0][6] = std::numeric_limits<float>::quiet_NaN();
  channels[0][7] = std::numeric_limits<float>::infinity();
  std::vector<std::uint8_t> planes =
      rgbe_planes({width, height, {channels[0].data(), channels[1].data(), channels[2].data()}});
  const std::size_t pixels = 16;
  ASSERT_EQ(planes.size(), 4 * pixels);
  for (std::size_t row = 0; row < planes.size(); row += width) {
    for (std::size_t i = 1; i < width; ++i) planes[row + i] = std::uint8_t(planes[row + i] + planes[row + i - 1]);
  }
  const auto value = [&](std::size_t c, std::size_t i) {
    return std::ldexp(double(planes[c * pixels + i]), planes[3 * pixels + i] - 136);
  };
  for (std::size_t i = 0; i < pixels; ++i) {
    if (i == 6) {
      EXPECT_EQ(value(0, i), 0);
      EXPECT_NEAR(value(1, i) / channels[1][i], 1, 1.0 / 256);
    } else if (i == 7) {
      EXPECT_GT(value(0, i), 1e38);
    } else {
      const double largest = channels[0][i];
      EXPECT_NEAR(value(0, i), channels[0][i], largest / 255) << i;
      EXPECT_NEAR(value(1, i), channels[1][i], largest / 255) << i;
    }
    EXPECT_EQ(value(2, i), 0);
  }
}

LoadedPicture flat(int width, int height, float value) {
  LoadedPicture picture{width, height, {}, {}};
  for (auto& plane : picture.planes) plane.assign(std::size_t(width) * std::size_t(height), value);
  return picture;
}

TEST(DifferenceMaps, AreSignedAndSayWhatTheyAreMadeOf) {
  const LoadedPicture reference = flat(6, 4, 1);
  LoadedPicture picture = flat(6, 4, 1);
  for (auto& plane : picture.planes) plane[0] = 0.5f, plane[1] = 4;
  const SignedMap relative = signed_map(picture, reference);
  EXPECT_FALSE(relative.standard_errors);
  EXPECT_NEAR(relative.map.values[0], 0.5 - 0.25 / std::sqrt(1.01), 1e-6);
  EXPECT_EQ(relative.map.values[1], 1);
  EXPECT_EQ(relative.map.values[2], 0.5f);

  // Grey with variance v in each channel: the luminance has v times the sum of the squared weights.
  LoadedPicture known = reference;
  known.variance.emplace();
  for (auto& plane : *known.variance) plane.assign(24, 0.02f);
  picture.variance = known.variance;
  const SignedMap z = signed_map(picture, known);
  EXPECT_TRUE(z.standard_errors);
  const double deviation = std::sqrt(2 * 0.02 * (0.2126 * 0.2126 + 0.7152 * 0.7152 + 0.0722 * 0.0722));
  EXPECT_NEAR(z.map.values[0], 0.5 - 0.5 * (0.5 / deviation) / 5, 1e-6);
}

TEST(LoadedPicture, ReducesToMeans) {
  const std::vector<float> plane{1, 3, 5, 1, 3, 7};  // 3 x 2
  EXPECT_EQ(reduced(plane, 3, 2, 2), (std::vector<float>{2, 6}));
  EXPECT_EQ(reduced(plane, 3, 2, 1), plane);
}

TEST(PictureChoice, FitsThePage) {
  std::vector<std::uint32_t> views(100);
  for (std::uint32_t i = 0; i < 100; ++i) views[i] = i;
  // Two of nine pictures of 640 x 360 would not fit.
  PictureChoice choice = choose_pictures(views, 9, 640 * 360);
  EXPECT_EQ(choice.views, std::vector<std::uint32_t>{0});
  EXPECT_EQ(choice.factor, 1);
  choice = choose_pictures(views, 4, 160 * 90);
  ASSERT_EQ(choice.views.size(), kMostViews);
  EXPECT_EQ(choice.views.front(), 0u);
  EXPECT_EQ(choice.views.back(), 99u);
  choice = choose_pictures({0}, 9, 3840 * 2160);
  EXPECT_EQ(choice.factor, 6);  // 9 x 8.3 million / 36 = 2.07 million; by 5: 2.99 million
  EXPECT_TRUE(choose_pictures({}, 9, 100).views.empty());
}

}  // namespace
}  // namespace helio::report
