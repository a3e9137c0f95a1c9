#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "renderer/base/math.h"
#include "renderer/base/srgb.h"
#include "renderer/metrics/dssim.h"
#include "renderer/metrics/error_metrics.h"
#include "tests/support/random.h"
#include "tests/unit/picture/metrics/test_picture.h"

namespace helio {
namespace {

using test::Picture;
using test::Random;

TEST(SquaredErrorMetric, MatchesHandCalculation) {
  Picture x(2, 1, 1.0f), r(2, 1, 1.0f);
  x.channels[0][0] = 3.0f;   // distance 2
  x.channels[1][1] = -1.0f;  // distance 2
  const Result<SquaredError> e = squared_error(x.view(), r.view());
  ASSERT_TRUE(e.ok());
  EXPECT_DOUBLE_EQ(e->mse, 8.0 / 6);
  EXPECT_DOUBLE_EQ(e->distance_variance, 8.0 / 6 - (4.0 / 6) * (4.0 / 6));
}

TEST(RelativeErrorMetric, UsesTheEpsilonAskedFor) {
  Picture x(10, 1, 2.5f), r(10, 1, 2.0f);
  // (0.5)^2 / (4 + 0.01) and / (4 + 0.01 * 4).
  EXPECT_NEAR(relative_error(x.view(), r.view(), RelativeEpsilon::fixed())->relmse, 0.25 / 4.01, 1e-12);
  EXPECT_NEAR(relative_error(x.view(), r.view())->relmse, 0.25 / 4.04, 1e-12);
  EXPECT_NEAR(relative_error(x.view(), r.view(), RelativeEpsilon::fixed(1e-4))->relmse, 0.25 / 4.0001, 1e-12);
  const Picture black(10, 1, 0.0f);
  EXPECT_FALSE(relative_error(x.view(), black.view()).ok());
  EXPECT_TRUE(relative_error(x.view(), black.view(), RelativeEpsilon::fixed()).ok());
  EXPECT_FALSE(relative_error(x.view(), r.view(), RelativeEpsilon::fixed(0)).ok());
}

TEST(RelativeErrorMetric, ReportsTheLargestPixelsApart) {
  Picture x(100, 20, 1.1f);
  const Picture r(100, 20, 1.0f);
  for (int i : {3, 700}) {
    for (auto& c : x.channels) c[std::size_t(i)] = 101.0f;  // 2 of 2,000 pixels: 0.1 %
  }
  const Result<RelativeError> e = relative_error(x.view(), r.view(), RelativeEpsilon::fixed(1.0));
  ASSERT_TRUE(e.ok());
  EXPECT_NEAR(e->without_outliers, 0.01 / 2, 1e-6);
  EXPECT_NEAR(e->relmse, (1998 * 0.005 + 2 * 5000.0) / 2000, 1e-4);
  EXPECT_NEAR(e->outlier_share, 10000.0 / (10000.0 + 9.99), 1e-5);
}

TEST(BiasMetric, ComesWithItsStandardError) {
  const Picture r(4, 4, 2.0f);
  const Picture a(4, 4, 2.1f), b(4, 4, 2.3f);  // biases 0.05 and 0.15
  const PictureView both[] = {a.view(), b.view()};
  const Result<Bias> bias = estimate_bias(both, r.view());
  ASSERT_TRUE(bias.ok());
  EXPECT_NEAR(bias->bias, 0.1, 1e-6);
  EXPECT_NEAR(bias->standard_error, 0.05, 1e-6) << "sqrt(2 * 0.05^2 / 1 / 2)";
  const Result<Bias> single = estimate_bias({both, 1}, r.view());
  EXPECT_NEAR(single->bias, 0.05, 1e-6);
  EXPECT_TRUE(std::isinf(single->standard_error));
  EXPECT_FALSE(estimate_bias({}, r.view()).ok());
  const Picture black(4, 4, 0.0f);
  EXPECT_FALSE(estimate_bias(both, black.view()).ok());
}

TEST(BiasMetric, CoversTheTruthAsOftenAsItSays) {
  const Picture r(16, 16, 1.0f);
  int covered = 0;
  constexpr int kRounds = 200;
  Random random(5);
  for (int round = 0; round < kRounds; ++round) {
    std::vector<Picture> pictures;
    std::vector<PictureView> views;
    for (int seed = 0; seed < 16; ++seed) {
      Picture& p = pictures.emplace_back(16, 16, 0.0f);
      for (auto& c : p.channels) {
        for (float& v : c) v = 1.02f + random.next_float() - 0.5f;
      }
    }
    for (const Picture& p : pictures) views.push_back(p.view());
    const Bias bias = *estimate_bias(views, r.view());
    covered += std::abs(bias.bias - 0.02) < 2 * bias.standard_error;
  }
  // Student's t with 15 degrees of freedom: 93.6 % within two standard errors; 187 +- 3.5.
  EXPECT_NEAR(covered, 187, 14);
}

// By two-dimensional windows of 11 x 11 pixels, the sums of the definition.
TEST(DssimMetric, IsTheMeanOfTheDefinitionOverWindows) {
  for (const auto& [w, h] : {std::pair(17, 13), std::pair(4, 20), std::pair(1, 1)}) {
    Picture x(w, h, 0.0f), r(w, h, 0.0f);
    Random random(5);
    for (auto* picture : {&x, &r}) {
      for (float& v : picture->channels[0]) v = random.next_float();
      picture->channels[1] = picture->channels[2] = picture->channels[0];
    }
    const auto at = [w = w](const Picture& picture, int u, int v) {
      return double(encode_srgb(float(luminance(Rgb(picture.channels[0][std::size_t(v * w + u)])))));
    };
    double total = 0;
    for (int v = 0; v < h; ++v) {
      for (int u = 0; u < w; ++u) {
        double weight = 0, sx = 0, sr = 0, xx = 0, rr = 0, xr = 0;
        for (int j = std::max(0, v - 5); j <= std::min(h - 1, v + 5); ++j) {
          for (int i = std::max(0, u - 5); i <= std::min(w - 1, u + 5); ++i) {
            const double g = std::exp(-0.5 * ((i - u) * (i - u) + (j - v) * (j - v)) / (1.5 * 1.5));
            const double a = at(x, i, j), b = at(r, i, j);
            weight += g;
            sx += g * a;
            sr += g * b;
            xx += g * a * a;
            rr += g * b * b;
            xr += g * a * b;
          }
        }
        const double mx = sx / weight, mr = sr / weight;
        total += (2 * mx * mr + 1e-4) * (2 * (xr / weight - mx * mr) + 9e-4) /
                 ((mx * mx + mr * mr + 1e-4) * (xx / weight - mx * mx + rr / weight - mr * mr + 9e-4));
      }
    }
    EXPECT_NEAR(dssim(x.view(), r.view())->ssim, total / (w * h), 1e-6) << w << " x " << h;
  }
}

TEST(DssimMetric, IsZeroForEqualPicturesAndGrowsWithNoise) {
  Picture r(40, 30, 0.0f);
  for (auto& c : r.channels) {
    for (std::size_t i = 0; i < c.size(); ++i) c[i] = 0.2f + 0.2f * float(std::sin(0.3 * double(i % 40)));
  }
  EXPECT_NEAR(dssim(r.view(), r.view())->dssim, 0.0, 1e-12);
  double last = 0;
  for (const float noise : {0.01f, 0.05f, 0.2f}) {
    Picture x = r;
    Random random(1);
    for (auto& c : x.channels) {
      for (float& v : c) v += noise * (random.next_float() - 0.5f);
    }
    const Result<Dssim> d = dssim(x.view(), r.view());
    ASSERT_TRUE(d.ok());
    EXPECT_GT(d->dssim, last + 1e-4);
    EXPECT_NEAR(d->dssim, 1 / d->ssim - 1, 1e-12);
    last = d->dssim;
  }
  // Flat pictures: no structure, SSIM is (2 a b + C1) / (a^2 + b^2 + C1) of the encoded values. 0.2140411 is encoded as
  // 0.5 and 1 as 1: (1 + 1e-4) / (1.25 + 1e-4).
  EXPECT_NEAR(dssim(Picture(20, 20, 0.2140411f).view(), Picture(20, 20, 1.0f).view())->ssim, 1.0001 / 1.2501, 1e-6);
  EXPECT_NEAR(dssim(Picture(1, 1, 0.5f).view(), Picture(1, 1, 0.5f).view())->ssim, 1.0, 1e-12);
  EXPECT_FALSE(dssim(r.view(), r.view(), 0).ok());
}

TEST(Metrics, RefuseWhatCannotBeCompared) {
  const Picture a(3, 2, 1.0f), b(2, 3, 1.0f), empty(0, 0, 1.0f);
  Picture broken(3, 2, 1.0f);
  broken.channels[1][4] = std::numeric_limits<float>::quiet_NaN();
  EXPECT_FALSE(squared_error(a.view(), b.view()).ok());
  EXPECT_FALSE(squared_error(empty.view(), empty.view()).ok());
  const Result<SquaredError> nan = squared_error(broken.view(), a.view());
  ASSERT_FALSE(nan.ok());
  EXPECT_EQ(nan.error().to_string(), "picture: is not finite at pixel (1, 1), channel 1");
  EXPECT_EQ(dssim(a.view(), broken.view()).error().where, "reference");
}

}  // namespace
}  // namespace helio
