#include "renderer/film/splats/splat_buffer.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cfloat>
#include <cmath>
#include <limits>
#include <random>
#include <thread>
#include <vector>

#include "tests/support/random.h"

namespace helio {
namespace {

using test::Random;

struct Moments {
  double mean[3], variance[3];
};

Moments moments(const SplatBuffer& buffer, int half, int x, int y) {
  double mean[4], variance[4];
  buffer.read_row(half, y, x, x + 1, mean, variance);
  Moments m;
  std::copy_n(mean, 3, m.mean);
  std::copy_n(variance, 3, m.variance);
  return m;
}

// Of all magnitudes that pictures have.
std::vector<Splat> random_splats(int width, int height, std::size_t count, std::uint64_t seed) {
  Random random(seed);
  std::vector<Splat> splats(count);
  for (Splat& splat : splats) {
    splat.x = std::int32_t(random.next_double() * width);
    splat.y = std::int32_t(random.next_double() * height);
    for (int c = 0; c < 3; ++c) splat.radiance[c] = float(std::exp2(random.next_double() * 60 - 30));
  }
  return splats;
}

// Values are kept to 2^-60 of the film's pixels (128 here): of a sum of 40 values of 2^-30 at least, that is 2^-22 at
// worst, and 1e-12 where a value of more than 1e-6 is among them.
TEST(SplatBuffer, MeanAndVarianceAreThoseOfAllLightPaths) {
  constexpr int kWidth = 7, kHeight = 13;
  const std::vector<Splat> splats = random_splats(kWidth, kHeight, 4000, 1);
  SplatBuffer buffer(kWidth, kHeight);
  buffer.add(1, splats, 4500);
  buffer.add(1, {}, 500);
  EXPECT_EQ(buffer.light_paths(0), 0u);
  EXPECT_EQ(buffer.light_paths(1), 5000u);
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      const Moments found = moments(buffer, 1, x, y);
      for (int c = 0; c < 3; ++c) {
        double sum = 0, squares = 0;
        for (const Splat& s : splats) {
          if (s.x != x || s.y != y) continue;
          sum += s.radiance[c];
          squares += double(s.radiance[c]) * s.radiance[c];
        }
        const double mean = sum / 5000, variance = (squares / 5000 - mean * mean) / 4999;
        EXPECT_NEAR(found.mean[c] / mean, 1, 1e-11);
        EXPECT_NEAR(found.variance[c] / variance, 1, 1e-9);
        EXPECT_EQ(buffer.mean(1, x, y)[c], float(found.mean[c]));
        EXPECT_EQ(moments(buffer, 0, x, y).mean[c], 0.0) << "the other half's";
      }
    }
  }
}

TEST(SplatBuffer, SumsDoNotDependOnOrderOrThreads) {
  constexpr int kWidth = 33, kHeight = 21;
  std::vector<Splat> splats = random_splats(kWidth, kHeight, 20000, 2);
  Random random(3);
  for (std::size_t i = 0; i < splats.size(); i += 7) splats[i].radiance = -0.5f * splats[i].radiance;
  for (std::size_t i = 0; i < splats.size(); i += 101) splats[i].radiance[1] = std::numeric_limits<float>::quiet_NaN();
  for (std::size_t i = 0; i < splats.size(); i += 103) splats[i].x = kWidth;
  for (std::size_t i = 0; i < splats.size(); i += 107) splats[i].radiance[2] = 1e22f;  // squares stand still
  SplatBuffer whole(kWidth, kHeight);
  whole.add(0, splats, 30000);

  std::mt19937 shuffling(4);
  std::shuffle(splats.begin(), splats.end(), shuffling);
  SplatBuffer parts(kWidth, kHeight);
  constexpr std::size_t kThreads = 4;
  std::vector<std::thread> threads;
  for (std::size_t t = 0; t < kThreads; ++t) {
    threads.emplace_back([&, t] {
      for (std::size_t i = t * 50; i < splats.size(); i += kThreads * 50)
        parts.add(0, std::span(splats).subspan(i, std::min<std::size_t>(50, splats.size() - i)), 75);
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_TRUE(parts == whole);
  EXPECT_EQ(parts.light_paths(0), 30000u);
  EXPECT_GT(parts.invalid_in({0, 0, kWidth, kHeight}), 0u);
  parts.add(0, std::vector<Splat>{{0, 0, Rgb(1e-30f)}}, 0);
  EXPECT_FALSE(parts == whole) << "not even one that is next to nothing is lost";
}

TEST(SplatBuffer, TakesEveryFiniteValueWithinItsRange) {
  const auto one = [](float value) {
    SplatBuffer buffer(4, 4);
    buffer.add(0, std::vector<Splat>{{1, 2, Rgb(value)}}, 2);
    EXPECT_EQ(buffer.invalid_in({0, 0, 4, 4}), buffer.invalid_in({1, 2, 2, 3}));
    const double mean = moments(buffer, 0, 1, 2).mean[0];
    EXPECT_TRUE(buffer.invalid_in({1, 2, 2, 3}) == 0 || mean == 0) << value;
    return buffer.invalid_in({1, 2, 2, 3}) == 0 ? mean : std::numeric_limits<double>::quiet_NaN();
  };
  EXPECT_EQ(one(0.0f), 0);
  EXPECT_FALSE(std::signbit(one(-0.0f)));
  EXPECT_EQ(one(1.0f), 0.5);
  EXPECT_EQ(one(-1.5f), -0.75);
  EXPECT_NEAR(one(1e-9f) / (double(1e-9f) / 2), 1, 1e-8);
  EXPECT_EQ(one(1e9f), double(1e9f) / 2);
  EXPECT_EQ(one(FLT_TRUE_MIN), 0x1p-60 * 16 / 2) << "what is not zero is at least the quantum of a film of 16 pixels";
  EXPECT_EQ(one(-FLT_TRUE_MIN), -0x1p-60 * 16 / 2);
  EXPECT_EQ(one(0x1p59f), 0x1p58) << "the largest: 2^55 times 16 pixels";
  for (const float value : {0x1.1p59f, -0x1.1p59f, 1e30f, FLT_MAX, std::numeric_limits<float>::infinity(),
                            std::numeric_limits<float>::quiet_NaN()})
    EXPECT_TRUE(std::isnan(one(value))) << value << " must not enter";
}

// A sum of 2^20 values of 1e9 and as many of 1e-9 is right to the last digit of either.
TEST(SplatBuffer, LargeSumsKeepWhatIsSmall) {
  SplatBuffer buffer(1, 1);
  const std::vector<Splat> pair = {{0, 0, Rgb(1e9f, 1e9f, 1)}, {0, 0, Rgb(0x1p-30f, -1e9f, 1)}};
  std::vector<Splat> many;
  for (int i = 0; i < 1024; ++i) many.insert(many.end(), pair.begin(), pair.end());
  for (int i = 0; i < 1024; ++i) buffer.add(0, many, 2048);
  buffer.add(0, std::vector<Splat>{{0, 0, Rgb(0, 0x1p-30f, 0)}}, 0);
  const Moments m = moments(buffer, 0, 0, 0);
  EXPECT_EQ(m.mean[0], (1e9 + 0x1p-30) / 2);
  EXPECT_EQ(m.mean[1], 0x1p-51) << "what is left of 2^21 that cancel out";
  EXPECT_EQ(m.mean[2], 1);
  EXPECT_EQ(m.variance[2], 0) << "all are alike";
  EXPECT_NEAR(m.variance[0] / (2.5e17 / (0x1p21 - 1)), 1, 1e-9);
}

TEST(SplatBuffer, CountsWhatDoesNotEnter) {
  SplatBuffer buffer(5, 9);
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const std::vector<Splat> splats = {{-1, 0, Rgb(1)}, {5, 0, Rgb(1)},         {0, 9, Rgb(nan)}, {0, -1, Rgb(1)},
                                     {4, 8, Rgb(1)},  {3, 7, Rgb(1, nan, 1)}, {3, 7, Rgb(2)},   {0, 0, Rgb(1e38f)}};
  EXPECT_EQ(buffer.add(1, splats, 8), 6u);
  EXPECT_EQ(buffer.invalid_outside(), 4u);
  EXPECT_EQ(buffer.invalid_in({0, 0, 5, 9}), 2u);
  EXPECT_EQ(buffer.invalid_in({3, 7, 4, 8}), 1u);
  EXPECT_EQ(buffer.mean(1, 3, 7), Rgb(0.25f)) << "of a splat with one bad channel nothing enters";
  EXPECT_EQ(buffer.mean(1, 4, 8), Rgb(0.125f));
}

TEST(SplatBuffer, ForgetsEverythingAtOnce) {
  SplatBuffer buffer(6, 11);
  const std::vector<Splat> before = random_splats(6, 11, 500, 5);
  buffer.add(0, before, 500);
  buffer.add(1, before, 500);
  buffer.add(0, std::vector<Splat>{{9, 9, Rgb(1)}, {2, 2, Rgb(INFINITY)}}, 1);
  EXPECT_GT(buffer.brightest(4, 0, 6), 0);
  buffer.clear();
  EXPECT_TRUE(buffer == SplatBuffer(6, 11));
  for (int y = 0; y < 11; ++y) EXPECT_EQ(buffer.brightest(y, 0, 6), 0);
  EXPECT_EQ(buffer.invalid_in({0, 0, 6, 11}) + buffer.invalid_outside() + buffer.light_paths(0), 0u);
  // Rows that are written to again hold nothing else.
  buffer.add(0, std::vector<Splat>{{3, 5, Rgb(2)}}, 4);
  for (int y = 0; y < 11; ++y) {
    for (int x = 0; x < 6; ++x) EXPECT_EQ(buffer.mean(0, x, y), Rgb(x == 3 && y == 5 ? 0.5f : 0.0f));
  }
  EXPECT_EQ(buffer.brightest(5, 0, 6), 2);
  EXPECT_EQ(buffer.brightest(5, 0, 3), 0);
}

}  // namespace
}  // namespace helio
