#include "renderer/metrics/reference_halves.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "tests/support/random.h"
#include "tests/unit/picture/metrics/test_picture.h"

namespace helio {
namespace {

using test::Picture;
using test::Random;

TEST(ReferenceHalves, AreProducts) {
  const Picture x(3, 2, 5.0f), a(3, 2, 4.0f), b(3, 2, 2.0f);  // products 1 x 3, r = 3
  const UnbiasedError mse = unbiased_squared_error(x.view(), a.view(), b.view()).value();
  EXPECT_DOUBLE_EQ(mse.value, 3);
  // (x - r)(a - b) = 2 x 2 in each of 18 values, all in one block: (72^2)^(1/2) / 18. In blocks of a pixel:
  // (6 x 12^2)^(1/2) / 18.
  EXPECT_DOUBLE_EQ(mse.standard_error, 4);
  EXPECT_DOUBLE_EQ(unbiased_squared_error(x.view(), a.view(), b.view(), {1})->standard_error, std::sqrt(6) * 12 / 18);
  // Columns 0 and 1, and column 2: (48^2 + 24^2)^(1/2) / 18.
  EXPECT_DOUBLE_EQ(unbiased_squared_error(x.view(), a.view(), b.view(), {2})->standard_error,
                   std::sqrt(48 * 48 + 24 * 24) / 18);
  const UnbiasedError relmse = unbiased_relative_error(x.view(), a.view(), b.view()).value();
  EXPECT_DOUBLE_EQ(relmse.value, 3 / (9 + 0.01 * 9));
  EXPECT_DOUBLE_EQ(relmse.standard_error, 4 / (9 + 0.01 * 9));
  EXPECT_DOUBLE_EQ(unbiased_relative_error(x.view(), a.view(), b.view(), RelativeEpsilon::fixed(1))->value, 3.0 / 10);
  // Between the halves: negative.
  EXPECT_DOUBLE_EQ(unbiased_squared_error(Picture(3, 2, 3.0f).view(), a.view(), b.view())->value, -1);
}

TEST(ReferenceHalves, AreTheSquaredErrorWhereTheReferenceHasNoNoise) {
  Picture x(20, 10, 0.0f), r(20, 10, 0.0f);
  Random random(3);
  for (int c = 0; c < 3; ++c) {
    for (std::size_t i = 0; i < 200; ++i) {
      x.channels[c][i] = random.next_float();
      r.channels[c][i] = random.next_float();
    }
  }
  const UnbiasedError mse = unbiased_squared_error(x.view(), r.view(), r.view()).value();
  EXPECT_NEAR(mse.value, squared_error(x.view(), r.view())->mse, 1e-12);
  EXPECT_EQ(mse.standard_error, 0);
  EXPECT_NEAR(unbiased_relative_error(x.view(), r.view(), r.view())->value, relative_error(x.view(), r.view())->relmse,
              1e-12);
}

// A picture that is 0.3 off the truth, against halves with noise of variance 1/3 that 2x2 pixels and all channels
// share: the plain error against their mean is 0.09 + 1/6.
TEST(ReferenceHalves, TakeTheNoiseOffAndTellTheirStandardError) {
  const int w = 32, h = 32;
  const Picture x(w, h, 2.3f);
  constexpr int kRounds = 400;
  Random random(11);
  double sum = 0, squares = 0, variances = 0, too_small = 0, plain = 0;
  for (int round = 0; round < kRounds; ++round) {
    Picture halves[2] = {Picture(w, h, 2.0f), Picture(w, h, 2.0f)}, mean(w, h, 0.0f);
    for (Picture& half : halves) {
      for (int y = 0; y < h; y += 2) {
        for (int k = 0; k < w; k += 2) {
          float noise = -6;  // normal, nearly: the sum of twelve uniform values has a variance of 1
          for (int i = 0; i < 12; ++i) noise += random.next_float();
          noise *= std::sqrt(1 / 3.0f);
          for (const int i : {y * w + k, y * w + k + 1, (y + 1) * w + k, (y + 1) * w + k + 1}) {
            for (int c = 0; c < 3; ++c) {
              half.channels[c][std::size_t(i)] += noise;
              mean.channels[c][std::size_t(i)] += 0.5f * half.channels[c][std::size_t(i)];
            }
          }
        }
      }
    }
    const UnbiasedError mse = unbiased_squared_error(x.view(), halves[0].view(), halves[1].view(), {4}).value();
    sum += mse.value;
    squares += mse.value * mse.value;
    variances += mse.standard_error * mse.standard_error;
    too_small += std::pow(unbiased_squared_error(x.view(), halves[0].view(), halves[1].view(), {1})->standard_error, 2);
    plain += squared_error(x.view(), mean.view())->mse;
  }
  const double mean = sum / kRounds, variance = squares / kRounds - mean * mean;
  EXPECT_NEAR(mean, 0.09, 4 * std::sqrt(variance / kRounds));
  EXPECT_NEAR(plain / kRounds, 0.09 + 1.0 / 6, 0.01);
  // A variance over 400 rounds is good for 7 %.
  EXPECT_NEAR(variances / kRounds / variance, 1, 0.2);
  EXPECT_NEAR(too_small / variances, 0.25, 0.03) << "blocks of a pixel miss that four share their noise";
}

TEST(ReferenceHalves, BearExtremesAndRefuseWhatCannotBeCompared) {
  const Picture bright(1, 1, 1e9f), faint(1, 1, std::numeric_limits<float>::denorm_min()), black(1, 1, 0.0f);
  EXPECT_DOUBLE_EQ(unbiased_squared_error(bright.view(), faint.view(), black.view())->value, 1e18);
  EXPECT_EQ(unbiased_squared_error(black.view(), black.view(), black.view())->value, 0);
  EXPECT_FALSE(unbiased_relative_error(bright.view(), black.view(), black.view()).ok()) << "no relative error exists";
  Picture broken = black;
  broken.channels[2][0] = std::nanf("");
  EXPECT_EQ(unbiased_squared_error(black.view(), black.view(), broken.view()).error().to_string(),
            "second half: is not finite at pixel (0, 0), channel 2");
  EXPECT_EQ(unbiased_squared_error(black.view(), broken.view(), black.view()).error().where, "first half");
  EXPECT_FALSE(unbiased_squared_error(black.view(), black.view(), Picture(2, 1, 0.0f).view()).ok());
  EXPECT_EQ(unbiased_squared_error(black.view(), black.view(), black.view(), {0}).error().where, "block");
}

}  // namespace
}  // namespace helio
