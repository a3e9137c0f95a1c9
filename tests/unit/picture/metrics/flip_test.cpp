#include "renderer/metrics/flip.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

#include "renderer/metrics/weighted_median.h"
#include "tests/unit/picture/metrics/flip_pairs.h"

namespace helio {
namespace {

using test::FlipPair;
using test::Picture;

Flip flip_of(const FlipPair& pair) {
  const auto flip = pair.hdr ? hdr_flip(pair.picture.view(), pair.reference.view())
                             : ldr_flip(pair.picture.view(), pair.reference.view());
  return flip.value();
}

// Printed by flip-evaluator 1.7 of PyPI for the pairs of flip_pairs.h, LDR with linear input clamped to [0, 1]: mean,
// weighted median, exposures, and every 500th pixel of the map. flip_evaluator_test.cpp prints them again.
struct Published {
  const char* name;
  double mean, weighted_median;
  int exposures;
  double errors[8];
};
const Published kPublished[] = {
    {"noise", 0.106111, 0.114393, 0, {0.299357, 0.073465, 0.106938, 0.192153, 0.045363, 0.153619, 0.092619, 0.097668}},
    {"one pixel aside",
     0.154764,
     0.190467,
     0,
     {0.054263, 0.058538, 0.148514, 0.058328, 0.089921, 0.081874, 0.042117, 0.053995}},
    {"other hues",
     0.631899,
     0.705571,
     0,
     {0.954713, 0.508662, 0.751816, 0.965293, 0.673433, 0.369283, 0.696909, 0.720506}},
    {"white dots",
     0.028584,
     0.115089,
     0,
     {0.000000, 0.015385, 0.005928, 0.000425, 0.008798, 0.011398, 0.000000, 0.000338}},
    {"noise over 12 stops",
     0.170403,
     0.179334,
     5,
     {0.405259, 0.122270, 0.231419, 0.133213, 0.121648, 0.170752, 0.192558, 0.104620}},
    {"a sun, a third too dark",
     0.436882,
     0.433816,
     18,
     {0.449768, 0.406676, 0.509731, 0.418227, 0.527185, 0.398613, 0.460363, 0.426740}},
    {"fireflies in the dark",
     0.332911,
     0.967665,
     8,
     {0.965225, 0.137182, 0.001155, 0.968359, 0.651929, 0.001273, 0.965225, 0.000000}},
};

TEST(FlipMetric, AgreesWithTheEvaluatorOfItsAuthors) {
  const std::vector<FlipPair> pairs = test::flip_pairs();
  ASSERT_EQ(pairs.size(), std::size(kPublished));
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    const Published& published = kPublished[i];
    SCOPED_TRACE(published.name);
    ASSERT_EQ(pairs[i].name, published.name);
    const Flip flip = flip_of(pairs[i]);
    EXPECT_NEAR(flip.mean, published.mean, 1e-4);
    EXPECT_NEAR(weighted_median(flip.error).value(), published.weighted_median, 1e-4);
    EXPECT_EQ(flip.exposures, published.exposures);
    for (std::size_t k = 0; k < std::size(published.errors); ++k)
      EXPECT_NEAR(flip.error[500 * k], published.errors[k], 1e-4) << "pixel " << 500 * k;
  }
}

TEST(FlipMetric, IsZeroForEqualPictures) {
  for (const FlipPair& pair : test::flip_pairs()) {
    for (const auto& flip :
         {ldr_flip(pair.picture.view(), pair.picture.view()), hdr_flip(pair.picture.view(), pair.picture.view())}) {
      ASSERT_TRUE(flip.ok());
      EXPECT_EQ(flip->mean, 0) << pair.name;
      EXPECT_EQ(*std::max_element(flip->error.begin(), flip->error.end()), 0);
    }
  }
}

// Without edges the error is the colour difference alone.
TEST(FlipMetric, OfFlatPicturesIsTheColourDifference) {
  const int w = 40, h = 30;
  const Picture black(w, h, 0.0f), white(w, h, 1.0f);
  const Picture green(w, h, 0, 1, 0), blue(w, h, 0, 0, 1);
  // The largest of all: L*a*b* (87.74, -86.18, 83.18) and (32.30, 79.19, -107.86); with the Hunt effect 203.302 apart.
  EXPECT_NEAR(ldr_flip(green.view(), blue.view())->mean, 1, 1e-6);
  const double largest = std::pow(203.302, 0.7);
  // 100 apart in L*: on the second line.
  const double contrast = 0.95 + 0.05 * (std::pow(100, 0.7) - 0.4 * largest) / (0.6 * largest);
  const Flip flip = ldr_flip(white.view(), black.view()).value();
  EXPECT_NEAR(flip.mean, contrast, 1e-5);
  EXPECT_NEAR(flip.mean, 0.96738, 1e-5);
  EXPECT_EQ(flip.error.front(), flip.error[std::size_t(w * h / 2)]) << "the border is no edge";
  // Greys, on the first line: L* = 116 cbrt(Y) - 16.
  const double apart = 116 * (std::cbrt(0.5) - std::cbrt(0.4));
  const Picture light(w, h, 0.5f), dark(w, h, 0.4f);
  EXPECT_NEAR(ldr_flip(light.view(), dark.view())->mean, std::pow(apart, 0.7) * 0.95 / (0.4 * largest), 1e-5);
  // On the line of L* near black, too: 903.3 Y.
  const Picture dim(w, h, 0.005f);
  EXPECT_NEAR(ldr_flip(dim.view(), black.view())->mean, std::pow(903.3 * 0.005, 0.7) * 0.95 / (0.4 * largest), 1e-5);
  // Values out of range are clamped.
  EXPECT_EQ(ldr_flip(Picture(w, h, 7.0f).view(), Picture(w, h, -3.0f).view())->mean, flip.mean);
}

TEST(FlipMetric, DoesNotDependOnOrderOrOrientation) {
  const int w = 45, h = 45;
  Picture x(w, h, 0.2f);
  for (const int at : {20, 21, 25}) x.channels[at % 3][std::size_t(at * w + 17)] = 1;
  const Picture r(w, h, 0.2f);
  const Flip flip = ldr_flip(x.view(), r.view()).value(), swapped = ldr_flip(r.view(), x.view()).value();
  EXPECT_EQ(flip.error, swapped.error);
  Picture turned(w, h, 0.2f);
  for (int c = 0; c < 3; ++c) {
    for (int y = 0; y < h; ++y) {
      for (int k = 0; k < w; ++k)
        turned.channels[c][std::size_t(k * w + y)] = x.channels[c][std::size_t((h - 1 - y) * w + k)];
    }
  }
  const Flip other = ldr_flip(turned.view(), r.view()).value();
  for (int y = 0; y < h; ++y) {
    for (int k = 0; k < w; ++k)
      ASSERT_NEAR(other.error[std::size_t(k * w + y)], flip.error[std::size_t((h - 1 - y) * w + k)], 2e-4);
  }
  // Filters end after ten pixels.
  EXPECT_EQ(flip.error[std::size_t(36 * w + 17)], 0);
  EXPECT_GT(flip.error[std::size_t(28 * w + 17)], 0);
  EXPECT_EQ(flip.error[std::size_t(20 * w + 28)], 0);
}

TEST(FlipMetric, SeesLessFromAfar) {
  const FlipPair noise = test::flip_pairs().front();
  double last = 1;
  for (const double pixels_per_degree : {20.0, 67.0, 200.0}) {
    const double mean = ldr_flip(noise.picture.view(), noise.reference.view(), {pixels_per_degree})->mean;
    EXPECT_LT(mean, 0.8 * last) << pixels_per_degree;
    last = mean;
  }
  for (const double pixels_per_degree : {1.0, 1000.0})
    EXPECT_TRUE(ldr_flip(noise.picture.view(), noise.reference.view(), {pixels_per_degree})->mean > 0);
}

TEST(FlipMetric, ChoosesExposuresByMedianAndMaximum) {
  // ACES shows 2.11887 as 0.85: (0.9036 x^2 + 0.018 x) / (0.8748 x^2 + 0.354 x + 0.14).
  Picture r(5, 1, 1.0f);
  for (auto& c : r.channels) c = {0.1f, 0.5f, 0.25f, 64.0f, 0.0f};
  const Flip flip = hdr_flip(r.view(), r.view()).value();
  EXPECT_NEAR(flip.start_exposure, std::log2(2.11887 / 64), 1e-4);
  EXPECT_NEAR(flip.stop_exposure, std::log2(2.11887 / 0.25), 1e-4);
  EXPECT_EQ(flip.exposures, 8) << "64 is eight stops above 0.25";
  // x / (1 + x) = 0.85.
  FlipOptions reinhard;
  reinhard.tone_mapper = FlipToneMapper::reinhard;
  EXPECT_NEAR(hdr_flip(r.view(), r.view(), reinhard)->start_exposure, std::log2(0.85 / 0.15 / 64), 1e-4);
  // flip-evaluator 1.7: 2^(-5.711836 + 6.273664) = 1.476 times ACES'.
  FlipOptions hable;
  hable.tone_mapper = FlipToneMapper::hable;
  EXPECT_NEAR(hdr_flip(r.view(), r.view(), hable)->start_exposure - flip.start_exposure, 0.561828, 1e-4);
  // One radiance: two exposures, which are the same. Black counts as 2^-23.
  EXPECT_EQ(hdr_flip(Picture(3, 3, 2.0f).view(), Picture(3, 3, 2.0f).view())->exposures, 2);
  EXPECT_NEAR(hdr_flip(r.view(), Picture(5, 1, 0.0f).view())->stop_exposure, 23 + std::log2(2.11887), 1e-4);
}

TEST(FlipMetric, OfRadianceDoesNotDependOnItsUnit) {
  const FlipPair pair = test::flip_pairs()[4];
  ASSERT_TRUE(pair.hdr);
  const Flip flip = flip_of(pair);
  for (const float scale : {0x1p-8f, 0x1p20f}) {
    Picture x = pair.picture, r = pair.reference;
    for (auto* picture : {&x, &r}) {
      for (auto& c : picture->channels) {
        for (float& v : c) v *= scale;
      }
    }
    const Flip scaled = hdr_flip(x.view(), r.view()).value();
    EXPECT_NEAR(scaled.start_exposure, flip.start_exposure - std::log2(scale), 1e-9);
    EXPECT_NEAR(scaled.mean, flip.mean, 1e-6);
  }
}

TEST(FlipMetric, OfRadianceIsTheSameByAnyNumberOfThreads) {
  const FlipPair pair = test::flip_pairs()[4];
  const Flip one = hdr_flip(pair.picture.view(), pair.reference.view()).value();
  for (const int threads : {2, 3, 64}) {
    FlipOptions options;
    options.threads = threads;
    const Flip flip = hdr_flip(pair.picture.view(), pair.reference.view(), options).value();
    EXPECT_EQ(flip.error, one.error);
    EXPECT_EQ(flip.mean, one.mean);
  }
  for (const int threads : {0, 65}) {
    FlipOptions options;
    options.threads = threads;
    EXPECT_EQ(hdr_flip(pair.picture.view(), pair.reference.view(), options).error().where, "threads");
  }
}

TEST(FlipMetric, BearsExtremeRadiance) {
  const float denormal = std::numeric_limits<float>::denorm_min(), largest = std::numeric_limits<float>::max();
  for (const float value : {0.0f, -1.0f, denormal, 1e-6f, 1e9f, largest}) {
    for (const float other : {0.0f, denormal, 1.0f, 1e9f, largest}) {
      Picture x(30, 20, 0.1f), r(30, 20, 0.3f);
      for (auto& c : x.channels) c[200] = value;
      for (auto& c : r.channels) c[400] = other;
      for (const auto& flip : {hdr_flip(x.view(), r.view()), ldr_flip(x.view(), r.view())}) {
        ASSERT_TRUE(flip.ok());
        for (const float e : flip->error) ASSERT_TRUE(e >= 0 && e <= 1) << value << " " << other << " " << e;
      }
    }
  }
  const Picture black(1, 1, 0.0f), one(1, 1, 1.0f), negative(1, 1, -1.0f), faint(1, 1, denormal);
  EXPECT_EQ(hdr_flip(black.view(), black.view())->mean, 0);
  EXPECT_LT(hdr_flip(faint.view(), black.view())->mean, 1e-20);
  EXPECT_EQ(hdr_flip(negative.view(), black.view())->mean, 0);
  EXPECT_NEAR(hdr_flip(one.view(), black.view())->mean, 0.96738, 1e-5) << "white beside black";
  EXPECT_GT(hdr_flip(black.view(), one.view())->mean, 0.9);
  EXPECT_EQ(ldr_flip(one.view(), one.view())->error.size(), 1u);
}

TEST(FlipMetric, RefusesWhatCannotBeCompared) {
  const Picture a(3, 2, 1.0f), b(2, 3, 1.0f);
  Picture broken(3, 2, 1.0f);
  broken.channels[2][5] = std::numeric_limits<float>::infinity();
  EXPECT_FALSE(ldr_flip(a.view(), b.view()).ok());
  EXPECT_EQ(hdr_flip(a.view(), broken.view()).error().to_string(),
            "reference: is not finite at pixel (2, 1), channel 2");
  for (const double pixels_per_degree : {0.0, 0.9, -5.0, 1001.0, std::nan("")})
    EXPECT_EQ(ldr_flip(a.view(), a.view(), {pixels_per_degree}).error().where, "pixels_per_degree");
}

TEST(WeightedMedian, HalvesTheSummedError) {
  const std::vector<float> errors{0.5f, 0, 0.25f, 0, 0.125f, 0};  // of 0.875 half are 0.4375
  EXPECT_EQ(weighted_median(errors).value(), 0.5);
  EXPECT_EQ(weighted_median(std::vector<float>{0.25f, 0.5f, 0.25f, 0, 0, 0}).value(), 0.25) << "half of it is in 0.25";
  EXPECT_EQ(weighted_median(std::vector<float>(9, 0.75f)).value(), 0.75);
  EXPECT_EQ(weighted_median(std::vector<float>{0.125f}).value(), 0.125);
  EXPECT_EQ(weighted_median(std::vector<float>(4, 0.0f)).value(), 0);
  // Of many values, unordered: by the definition.
  std::vector<float> many;
  for (std::uint32_t i = 0; i < 5000; ++i) many.push_back(std::exp2(-20 * test::hashed(i, 1, 2)) * float(i % 7 != 0));
  std::vector<float> sorted = many;
  std::sort(sorted.begin(), sorted.end());
  double half = 0, below = 0;
  for (const float error : sorted) half += 0.5 * error;
  std::size_t i = 0;
  for (; below + sorted[i] < half; ++i) below += sorted[i];
  EXPECT_EQ(weighted_median(many).value(), double(sorted[i]));
  EXPECT_EQ(weighted_median(std::vector<float>{-0.0f, 0.25f, -0.0f}).value(), 0.25);
  EXPECT_FALSE(weighted_median({}).ok());
  EXPECT_EQ(weighted_median(std::vector<float>{0.5f, std::nanf("")}).error().where, "error map[1]");
  EXPECT_EQ(weighted_median(std::vector<float>{-0.5f}).error().where, "error map[0]");
}

}  // namespace
}  // namespace helio
