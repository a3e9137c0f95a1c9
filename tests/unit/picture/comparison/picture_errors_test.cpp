// All errors of one picture: that noise of the reference is taken off, regions, and what is not defined.
#include "renderer/comparison/picture_errors.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <utility>

#include "renderer/base/cancel.h"
#include "renderer/metrics/flip_reference.h"
#include "tests/unit/picture/comparison/draws.h"
#include "tests/unit/picture/metrics/test_picture.h"

namespace helio {
namespace {

using test::Picture;

std::optional<double> find(const std::vector<MeasuredValue>& values, Measure measure, const std::string& region = {}) {
  for (const MeasuredValue& value : values) {
    if (value.measure == measure && value.region == region) return value.value;
  }
  return std::nullopt;
}

ReferenceView plain(const Picture& picture) {
  ReferenceView reference;
  reference.mean = picture.view();
  return reference;
}

TEST(ComparisonPictureErrors, HaveEveryMeasureOnce) {
  const Picture reference(40, 25, 0.5f), picture(40, 25, 0.6f);
  const auto values = picture_errors(picture.view(), plain(reference));
  ASSERT_TRUE(values.ok()) << values.error().to_string();
  for (int i = 0; i < kMeasures; ++i) {
    int found = 0;
    for (const MeasuredValue& value : *values) found += value.measure == Measure(i) && value.region.empty();
    const bool elsewhere = Measure(i) == Measure::flicker || Measure(i) == Measure::told_rmse;
    EXPECT_EQ(found, elsewhere ? 0 : 1) << to_string(Measure(i));
  }
  EXPECT_NEAR(*find(*values, Measure::mse), 0.01, 1e-6);
  EXPECT_NEAR(*find(*values, Measure::relmse), 0.01 / (0.25 * 1.01), 1e-6);
  EXPECT_NEAR(*find(*values, Measure::bias), 0.2, 1e-6);
  EXPECT_NEAR(*find(*values, Measure::distance_variance), 0, 1e-6);
  EXPECT_NEAR(*find(*values, Measure::outlier_share), 1.0 / 1000, 1e-6);
}

TEST(ComparisonPictureErrors, AreThoseThatAreAskedFor) {
  const Picture reference(16, 16, 0.5f), picture(16, 16, 0.6f);
  PictureErrorOptions options;
  options.measures = 1u << unsigned(Measure::flip_median);
  const auto values = picture_errors(picture.view(), plain(reference), options);
  ASSERT_TRUE(values.ok());
  ASSERT_EQ(values->size(), 1u);
  EXPECT_EQ((*values)[0].measure, Measure::flip_median);
}

TEST(ComparisonPictureErrors, AreTheSameWithAKeptReferenceOfFlip) {
  const Picture reference(40, 25, 0.5f), picture(40, 25, 0.6f);
  FlipReference flip = FlipReference::create(reference.view(), {.ldr = true, .hdr = true}).value();
  ASSERT_EQ(flip.keep(std::numeric_limits<std::uint64_t>::max()).value(), flip.bytes());
  ReferenceView kept = plain(reference);
  kept.flip = &flip;
  const auto values = picture_errors(picture.view(), kept), before = picture_errors(picture.view(), plain(reference));
  ASSERT_TRUE(values.ok() && before.ok());
  ASSERT_EQ(values->size(), before->size());
  for (std::size_t i = 0; i < values->size(); ++i) {
    EXPECT_EQ((*values)[i].measure, (*before)[i].measure);
    EXPECT_EQ((*values)[i].value, (*before)[i].value) << to_string((*values)[i].measure);
  }
}

TEST(ComparisonPictureErrors, EndWhenTheyAreCancelled) {
  const Picture reference(40, 25, 0.5f), picture(40, 25, 0.6f);
  CancelToken cancel;
  PictureErrorOptions options;
  options.cancel = &cancel;
  EXPECT_TRUE(picture_errors(picture.view(), plain(reference), options).ok());
  cancel.cancel();
  EXPECT_EQ(picture_errors(picture.view(), plain(reference), options).error().code, ErrorCode::cancelled);
}

// A truth of 1, a picture 0.1 above it, and halves with noise of variance 0.04 each: their mean has 0.02.
TEST(ComparisonPictureErrors, AreFreeOfTheNoiseOfTheReference) {
  test::Draws draws(3);
  const Picture picture(64, 64, 1.1f);
  Picture a(64, 64, 1), b(64, 64, 1), mean(64, 64, 1), variance(64, 64, 0.02f);
  for (std::size_t c = 0; c < 3; ++c) {
    for (std::size_t i = 0; i < 64 * 64; ++i) {
      a.channels[c][i] += float(0.2 * draws.normal());
      b.channels[c][i] += float(0.2 * draws.normal());
      mean.channels[c][i] = (a.channels[c][i] + b.channels[c][i]) / 2;
    }
  }
  ReferenceView with_noise = plain(mean), with_halves = with_noise, with_variance = with_noise;
  with_halves.half_a = a.view();
  with_halves.half_b = b.view();
  with_variance.variance = variance.view();
  PictureErrorOptions options;
  options.regions = {{"window", {8, 8, 40, 56}}};
  const auto noisy = picture_errors(picture.view(), with_noise, options);
  const auto halves = picture_errors(picture.view(), with_halves, options);
  const auto variances = picture_errors(picture.view(), with_variance, options);
  ASSERT_TRUE(noisy.ok() && halves.ok() && variances.ok());
  EXPECT_NEAR(*find(*noisy, Measure::mse), 0.03, 0.002);
  EXPECT_NEAR(*find(*halves, Measure::mse), 0.01, 0.003);
  EXPECT_NEAR(*find(*variances, Measure::mse), 0.01, 0.002);
  EXPECT_NEAR(*find(*halves, Measure::mse, "window"), 0.01, 0.005);
  EXPECT_NEAR(*find(*variances, Measure::mse, "window"), 0.01, 0.004);
  // (x - a)(x - b) = (x - r)^2 - (a - b)^2 / 4: what is taken off is the reference's own error, for both.
  for (const auto& [values, view] : {std::pair(&*halves, &with_halves), std::pair(&*variances, &with_variance)}) {
    const double taken_off = *find(*noisy, Measure::relmse) - *find(*values, Measure::relmse);
    EXPECT_NEAR(taken_off, *reference_error(*view) * *reference_error(*view), 1e-9);
  }
  // sqrt(0.02 / 1.01) but for the noise of the denominator.
  EXPECT_NEAR(*reference_error(with_halves), std::sqrt(0.02 / 1.01), 0.006);
  EXPECT_NEAR(*reference_error(with_variance), std::sqrt(0.02 / 1.01), 0.006);
  EXPECT_FALSE(reference_error(with_noise).has_value());
}

// A reference whose halves are lost, but not their variance, pixel by pixel: every value is as before.
TEST(ComparisonPictureErrors, AreTheSameByTheHalvesAndByTheirVariance) {
  test::Draws draws(5);
  Picture picture(40, 32, 0), a(40, 32, 0), b(40, 32, 0), mean(40, 32, 0), variance(40, 32, 0);
  for (std::size_t c = 0; c < 3; ++c) {
    for (std::size_t i = 0; i < 40 * 32; ++i) {
      const double truth = 0.1 + double(i % 40) / 20;
      picture.channels[c][i] = float(truth * draws.log_normal(0.3));
      a.channels[c][i] = float(truth * draws.log_normal(0.3));
      b.channels[c][i] = float(truth * draws.log_normal(0.3));
      mean.channels[c][i] = 0.5f * a.channels[c][i] + 0.5f * b.channels[c][i];
      const double difference = double(a.channels[c][i]) - b.channels[c][i];
      variance.channels[c][i] = float(difference * difference / 4);
    }
  }
  ReferenceView halves = plain(mean), kept = halves;
  halves.half_a = a.view();
  halves.half_b = b.view();
  kept.variance = variance.view();
  PictureErrorOptions options;
  options.regions = {{"window", {3, 5, 17, 9}}};
  const auto before = picture_errors(picture.view(), halves, options),
             after = picture_errors(picture.view(), kept, options);
  ASSERT_TRUE(before.ok() && after.ok());
  ASSERT_EQ(before->size(), after->size());
  for (std::size_t i = 0; i < before->size(); ++i) {
    const MeasuredValue &x = (*before)[i], &y = (*after)[i];
    EXPECT_EQ(x.measure, y.measure);
    EXPECT_EQ(x.region, y.region);
    EXPECT_NEAR(x.value, y.value, 1e-6 * std::abs(x.value)) << to_string(x.measure) << " " << x.region;
    EXPECT_NEAR(x.reference_error, y.reference_error, 1e-6 * x.reference_error);
    EXPECT_EQ(x.reference_error > 0, x.measure == Measure::bias);
  }
  EXPECT_NEAR(*reference_error(halves), *reference_error(kept), 1e-6);
}

// How far the means of many references lie from the truth.
TEST(ComparisonPictureErrors, TellTheStandardErrorOfTheReferencesMean) {
  test::Draws draws(8);
  const Picture picture(16, 16, 1);
  double squares = 0, told = 0;
  constexpr int kRuns = 400;
  for (int run = 0; run < kRuns; ++run) {
    Picture a(16, 16, 1), b(16, 16, 1), mean(16, 16, 1);
    for (std::size_t i = 0; i < 16 * 16; ++i) {
      const float of_a = float(0.3 * draws.normal()), of_b = float(0.3 * draws.normal());
      for (std::size_t c = 0; c < 3; ++c) {  // the channels of a pixel err alike
        a.channels[c][i] += of_a;
        b.channels[c][i] += of_b;
        mean.channels[c][i] = (a.channels[c][i] + b.channels[c][i]) / 2;
      }
    }
    ReferenceView reference = plain(mean);
    reference.half_a = a.view();
    reference.half_b = b.view();
    PictureErrorOptions options;
    options.measures = 1u << unsigned(Measure::bias);
    const auto values = picture_errors(picture.view(), reference, options);
    ASSERT_TRUE(values.ok());
    const MeasuredValue& bias = values->front();
    squares += bias.value * bias.value / kRuns;
    told += bias.reference_error * bias.reference_error / kRuns;
  }
  EXPECT_NEAR(std::sqrt(told), 0.3 / std::sqrt(2) / 16, 0.001);
  EXPECT_NEAR(std::sqrt(squares / told), 1, 0.1);
}

// The reference itself: the variance of its mean is all that the error is, so that it comes to less than 0 or near it.
TEST(ComparisonPictureErrors, MayBeNegative) {
  const Picture reference(8, 8, 1), variance(8, 8, 0.02f);
  ReferenceView view = plain(reference);
  view.variance = variance.view();
  const auto values = picture_errors(reference.view(), view);
  ASSERT_TRUE(values.ok());
  EXPECT_NEAR(*find(*values, Measure::mse), -0.02, 1e-7);
  EXPECT_LT(*find(*values, Measure::relmse, kDarkHalf), 0);
}

TEST(ComparisonPictureErrors, OfRegionsCountTheirPixelsAlone) {
  Picture reference(8, 4, 1), picture(8, 4, 1);
  for (int y = 0; y < 4; ++y) {
    for (int x = 4; x < 8; ++x) reference.channels[0][std::size_t(y * 8 + x)] = 4;
  }
  for (auto& channel : picture.channels) channel[3 * 8 + 1] = 3;
  PictureErrorOptions options;
  options.regions = {{"corner", {0, 2, 2, 4}}, {"right", {4, 0, 8, 4}}};
  const auto values = picture_errors(picture.view(), plain(reference), options);
  ASSERT_TRUE(values.ok());
  EXPECT_NEAR(*find(*values, Measure::mse, "corner"), 4.0 / 4, 1e-6);
  EXPECT_NEAR(*find(*values, Measure::relmse, "corner"), 4.0 / 4 / 1.01, 1e-6);
  EXPECT_NEAR(*find(*values, Measure::bias, "corner"), 2.0 / 4, 1e-6);
  EXPECT_NEAR(*find(*values, Measure::mse, "right"), 9.0 / 3, 1e-6);
  EXPECT_NEAR(*find(*values, Measure::bias, "right"), -1.0 / 2, 1e-6);
  // The left half is the darker one.
  EXPECT_NEAR(*find(*values, Measure::mse, kDarkHalf), 4.0 / 16, 1e-6);
  EXPECT_FALSE(find(*values, Measure::dssim, "right").has_value());
  EXPECT_FALSE(find(*values, Measure::flip, kDarkHalf).has_value());
}

// FLIP looks at pictures as wholes, and regions have the errors that their pixels have there.
TEST(ComparisonPictureErrors, OfDisksAreThoseOfTheWholePicture) {
  Picture reference(24, 16, 0.2f), picture(24, 16, 0.2f);
  test::Draws draws(3);
  for (auto& channel : picture.channels)
    for (float& value : channel) value += float(0.1 * draws.normal() * draws.normal());
  PictureErrorOptions options;
  options.measures = 1u << unsigned(Measure::flip) | 1u << unsigned(Measure::hdr_flip_median) | 1u;
  const PixelDisk disk{12, 8, 5, false}, around{12, 8, 5, true};
  options.regions = {{"disk", {}, disk}, {"around", {}, around}};
  const std::size_t inside = options.regions[0].pixels(24, 16).size(), outside = options.regions[1].pixels(24, 16).size();
  EXPECT_EQ(inside + outside, 24u * 16u);
  EXPECT_EQ(inside, 80u);  // as the circle's area, 78.5
  const auto values = picture_errors(picture.view(), plain(reference), options);
  ASSERT_TRUE(values.ok());
  for (const Measure measure : {Measure::flip, Measure::mse}) {
    const double whole = *find(*values, measure), a = *find(*values, measure, "disk"),
                 b = *find(*values, measure, "around");
    EXPECT_NEAR(a * double(inside) + b * double(outside), whole * 24 * 16, 1e-4 * whole * 24 * 16);
    EXPECT_NE(a, b);
  }
  EXPECT_GT(*find(*values, Measure::hdr_flip_median, "disk"), 0);
  EXPECT_FALSE(find(*values, Measure::flip_median, "disk").has_value());
}

// A tenth of a percent of fewer than 1,000 pixels is no pixel, and the share of one of them would be another measure.
TEST(ComparisonPictureErrors, HaveNoShareOfOutliersOfFewerThanAThousandPixels) {
  Picture reference(50, 50, 1), picture(50, 50, 1);
  for (auto& channel : picture.channels) channel[0] = 3;
  PictureErrorOptions options;
  options.measures = 1u << unsigned(Measure::outlier_share);
  options.regions = {{"999", {0, 0, 27, 37}}, {"1000", {0, 0, 40, 25}}};
  const auto values = picture_errors(picture.view(), plain(reference), options);
  ASSERT_TRUE(values.ok()) << values.error().to_string();
  EXPECT_NEAR(*find(*values, Measure::outlier_share), 1, 1e-6);
  EXPECT_FALSE(find(*values, Measure::outlier_share, "999").has_value());
  EXPECT_NEAR(*find(*values, Measure::outlier_share, "1000"), 1, 1e-6);

  const Picture small(27, 37, 1);
  const auto of_small = picture_errors(small.view(), plain(small));
  ASSERT_TRUE(of_small.ok()) << of_small.error().to_string();
  EXPECT_FALSE(find(*of_small, Measure::outlier_share).has_value());
  EXPECT_FALSE(find(*of_small, Measure::outlier_share, kDarkHalf).has_value());
}

TEST(ComparisonPictureErrors, LeaveOutWhatIsNotDefined) {
  const Picture black(40, 40, 0), picture(40, 40, 0.5f);
  const auto values = picture_errors(picture.view(), plain(black));
  ASSERT_TRUE(values.ok()) << values.error().to_string();
  EXPECT_FALSE(find(*values, Measure::relmse).has_value());
  EXPECT_FALSE(find(*values, Measure::bias).has_value());
  EXPECT_FALSE(find(*values, Measure::outlier_share).has_value());
  EXPECT_NEAR(*find(*values, Measure::mse), 0.25, 1e-6);
  for (const MeasuredValue& value : *values) EXPECT_TRUE(std::isfinite(value.value)) << to_string(value.measure);
  EXPECT_FALSE(reference_error(plain(black)).has_value());
  EXPECT_TRUE(worst_pixels(picture.view(), black.view(), 4).empty());
}

TEST(ComparisonPictureErrors, AreFiniteForHugeAndTinyRadiance) {
  for (const float scale : {1e30f, 1e-30f, 1e-44f}) {
    const Picture reference(16, 16, scale), picture(16, 16, 2 * scale);
    const auto values = picture_errors(picture.view(), plain(reference));
    ASSERT_TRUE(values.ok()) << values.error().to_string();
    for (const MeasuredValue& value : *values) EXPECT_TRUE(std::isfinite(value.value)) << to_string(value.measure);
    EXPECT_NEAR(find(*values, Measure::relmse).value_or(0), 1 / 1.01, 1e-6) << scale;
  }
}

TEST(ComparisonPictureErrors, RefuseWhatCannotBeCompared) {
  const Picture reference(8, 8, 1), small(4, 8, 1);
  Picture broken(8, 8, 1), negative(8, 8, 1);
  broken.channels[1][5] = std::numeric_limits<float>::quiet_NaN();
  negative.channels[2][9] = -0.5f;
  const auto size = picture_errors(small.view(), plain(reference));
  ASSERT_FALSE(size.ok());
  EXPECT_EQ(size.error().code, ErrorCode::invalid_argument);
  EXPECT_FALSE(picture_errors(broken.view(), plain(reference)).ok());
  ReferenceView view = plain(reference);
  view.variance = negative.view();
  const auto variance = picture_errors(reference.view(), view);
  ASSERT_FALSE(variance.ok());
  EXPECT_NE(variance.error().to_string().find("channel 2 of pixel (1, 1)"), std::string::npos)
      << variance.error().to_string();
}

TEST(ComparisonWorstPixels, AreTheLargestFirstAndByPlaceWhereEqual) {
  const Picture reference(4, 2, 1);
  Picture picture(4, 2, 1);
  picture.channels[0][6] = 3;  // error 4
  picture.channels[0][1] = 2;  // 1
  picture.channels[0][4] = 2;  // 1
  const auto worst = worst_pixels(picture.view(), reference.view(), 10);
  ASSERT_EQ(worst.size(), 3u);
  EXPECT_EQ(worst[0].x, 2);
  EXPECT_EQ(worst[0].y, 1);
  EXPECT_NEAR(worst[0].share, 4.0 / 6, 1e-12);
  EXPECT_EQ(worst[1].x, 1);
  EXPECT_EQ(worst[1].y, 0);
  EXPECT_EQ(worst[2].x, 0);
  EXPECT_EQ(worst[2].y, 1);
  EXPECT_EQ(worst_pixels(picture.view(), reference.view(), 1).size(), 1u);
  EXPECT_TRUE(worst_pixels(picture.view(), reference.view(), 0).empty());
}

}  // namespace
}  // namespace helio
