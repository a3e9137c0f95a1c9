#include "renderer/film/estimate/resolve.h"

#include <gtest/gtest.h>

#include <cfloat>
#include <cstring>
#include <limits>

#include "renderer/film/history/film_history.h"
#include "tests/unit/picture/synthetic_film.h"

namespace helio {
namespace {

using test::Random;

constexpr float kInfinity = std::numeric_limits<float>::infinity();

TEST(Resolve, MeanWeighsTheHalvesEqually) {
  Film film(2, 1);
  film.half(0, 0, 0).add(Rgb(1.0f));
  for (int i = 0; i < 3; ++i) film.half(1, 0, 0).add(Rgb(3.0f));
  EXPECT_EQ(resolve_mean(film, 0, 0), Rgb(2.0f)) << "by count it would be 2.5";
  film.half(1, 1, 0).add(Rgb(5.0f));
  EXPECT_EQ(resolve_mean(film, 1, 0), Rgb(5.0f)) << "one half only";
  EXPECT_EQ(resolve_mean(Film(1, 1), 0, 0), Rgb(0.0f));
  for (const unsigned channels : {0u, unsigned(kResolveVariance)}) {
    const ResolvedTile tile = resolve_tile(film, film.bounds(), film.bounds(), channels);
    for (const auto& channel : tile.radiance) EXPECT_EQ(channel, (std::vector<float>{2, 5})) << channels;
  }
}

TEST(Resolve, FillsWhatIsAskedFor) {
  Film film(3, 2);
  Random random(1);
  test::add_samples(film, 0, 2, random, [](int x, int, int, Random&) { return float(x); });
  film.add_invalid(1, 2, 1, 5);
  film.add_invalid(0, 1, 1);
  PixelFeatures& f = film.features(2, 1);
  f.count = 4;
  f.hits = 3;
  f.albedo[1] = 0.5f;
  f.normal[2] = -1;
  f.depth = 7;
  const ResolvedTile tile = resolve_tile(film, {1, 1, 3, 2}, film.bounds(), kResolveAll);
  EXPECT_EQ(tile.window, (PixelRect{1, 1, 3, 2}));
  EXPECT_EQ(tile.radiance[0], (std::vector<float>{1, 2}));
  EXPECT_EQ(tile.samples, (std::vector<float>{2, 2}));
  EXPECT_EQ(tile.invalid_samples, 6u);
  EXPECT_EQ(tile.alpha, (std::vector<float>{0, 0.75f}));
  EXPECT_EQ(tile.albedo[1], (std::vector<float>{0, 0.5f}));
  EXPECT_EQ(tile.normal[2], (std::vector<float>{0, -1}));
  EXPECT_EQ(tile.depth[1], 7.0f);
  const ResolvedTile bare = resolve_tile(film, {1, 1, 3, 2}, film.bounds(), 0);
  EXPECT_EQ(bare.radiance[0].size(), 2u);
  EXPECT_TRUE(bare.variance[0].empty() && bare.samples.empty() && bare.alpha.empty() && bare.depth.empty() &&
              bare.normal[0].empty() && bare.albedo[0].empty());
}

// What was carried weighs 0.5 (6 / 8 + 6 / 12) = 0.625 in a pixel whose halves hold 8 and 12 samples, 6 of them carried
// each; 2 + 6 are fresh.
TEST(Resolve, TellsWhatWasCarriedAndHowFreshSamplesAreSpread) {
  Film film(4, 1, {.targets = true, .history = true});
  const auto hold = [&](int x, std::uint32_t a, std::uint32_t b) {
    film.half(0, x, 0).count = a;
    film.half(1, x, 0).count = b;
  };
  hold(0, 8, 12);
  film.history()->carried(0, 0).count[0] = film.history()->carried(0, 0).count[1] = 6;
  film.history()->carried(0, 0).age = 9;
  film.history()->carried(0, 0).bias2 = 0.0625f;
  hold(1, 2, 1);
  film.add_invalid(1, 1, 0);
  hold(2, 3, 3);  // all carried, and so far off that no float holds it
  film.history()->carried(2, 0).count[0] = film.history()->carried(2, 0).count[1] = 3;
  film.history()->carried(2, 0).age = 255;
  film.history()->carried(2, 0).bias2 = kInfinity;
  const unsigned channels = kResolveHistory | kResolveDensity;
  const ResolvedTile tile = resolve_tile(film, film.bounds(), film.bounds(), channels, 3);
  EXPECT_EQ(tile.history_weight, (std::vector<float>{0.625f, 0, 1, 0}));
  EXPECT_NEAR(tile.bias_bound[0], 0.625 * 0.25, 1e-7);
  EXPECT_EQ(tile.bias_bound[1], 0);
  EXPECT_EQ(tile.bias_bound[2], FLT_MAX);
  EXPECT_EQ(tile.bias_bound[3], 0);
  EXPECT_EQ(tile.history_age, (std::vector<float>{5.625f, 0, 255 * 255 / 256.0f, 0}));
  const float expected[] = {8.0f / 3, 4.0f / 3, 0, 0};  // the invalid one was traced as well
  for (std::size_t i = 0; i < 4; ++i) EXPECT_FLOAT_EQ(tile.density[i], expected[i]) << i;

  EXPECT_EQ(resolve_tile(film, film.bounds(), film.bounds(), channels).density, (std::vector<float>{1, 1, 1, 1}));
  const ResolvedTile window = resolve_tile(film, {1, 0, 3, 1}, film.bounds(), channels, 3);
  EXPECT_EQ(window.history_weight, (std::vector<float>{0, 1}));
  const ResolvedTile plain = resolve_tile(Film(2, 1), {0, 0, 2, 1}, {0, 0, 2, 1}, kResolveAll);
  for (const auto& channel : {plain.history_weight, plain.bias_bound, plain.history_age})
    EXPECT_EQ(channel, (std::vector<float>{0, 0})) << "a film without history";
  EXPECT_EQ(plain.density, (std::vector<float>{1, 1}));
  EXPECT_TRUE(resolve_tile(film, film.bounds(), film.bounds(), 0).history_weight.empty());
}

// n independent samples a half with variance s^2: the mean has s^2 / (2 n).
TEST(Variance, IsCalibratedForIndependentSamples) {
  for (const int samples : {1, 2, 8}) {
    double reported = 0, expected = 0, squared_error = 0;
    constexpr int kSeeds = 20;
    for (int seed = 0; seed < kSeeds; ++seed) {
      Film film(64, 48);
      Random random(std::uint64_t(seed) + 1);
      for (int half = 0; half < 2; ++half) {
        test::add_samples(film, half, samples, random,
                          [](int x, int, int, Random& r) { return test::exponential(1.0f + 0.02f * float(x), r); });
      }
      reported += test::mean_of(test::variance_of(film));
      for (int x = 0; x < 64; ++x) {
        const double mean = 1.0 + 0.02 * x;
        expected += mean * mean / (2.0 * samples) / 64;
        for (int y = 0; y < 48; ++y) {
          const double error = resolve_mean(film, x, y).x - mean;
          squared_error += error * error / (64 * 48);
        }
      }
    }
    EXPECT_NEAR(reported / expected, 1.0, 0.03) << samples << " samples a half";
    EXPECT_NEAR(reported / squared_error, 1.0, 0.04) << "against the true error, " << samples << " samples a half";
  }
}

// Jittered samples (k + u) / n of the integrand x: each has variance (1/n)^2 / 12, the half's mean 1 / (12 n^3), the
// picture's 1 / (24 n^3). The sample variance over the count says 1 / (24 n) instead: n^2 times too much.
TEST(Variance, IsCalibratedForStratifiedSamplesWhereTheSampleVarianceOverstates) {
  constexpr int kSamples = 8;
  double reported = 0, by_sample_variance = 0;
  constexpr int kSeeds = 20;
  for (int seed = 0; seed < kSeeds; ++seed) {
    Film film(64, 48);
    Random random(std::uint64_t(seed) + 1);
    for (int half = 0; half < 2; ++half) {
      test::add_samples(film, half, kSamples, random,
                        [](int, int, int k, Random& r) { return (float(k) + r.next_float()) / kSamples; });
    }
    reported += test::mean_of(test::variance_of(film)) / kSeeds;
    const HalfPixel& half = film.half(0, 5, 5);
    const double variance = half.deviations[0] / (kSamples - 1);
    by_sample_variance += variance / (2 * kSamples) / kSeeds;
  }
  const double expected = 1.0 / (24.0 * kSamples * kSamples * kSamples);
  EXPECT_NEAR(reported / expected, 1.0, 0.03);
  EXPECT_GT(by_sample_variance / expected, 40.0) << "the film of this test must be one where the choice matters";
}

// Half the picture is 30 times noisier. Score of an estimate v of a squared error e: log v + e / v, smaller is better
// (proper: minimal at the true variance). A plain 7x7 box smears the noisy side over the quiet one. The noise is
// skewed, as light's is; for noise with short tails the box alone would score better away from edges.
TEST(Variance, FollowsAnEdgeOfNoiseBetterThanABox) {
  constexpr int kWidth = 48, kHeight = 48, kSamples = 8;
  constexpr float kQuiet = 0.03f, kNoisy = 1.0f;
  double score = 0, box_score = 0, quiet_ratio = 0;
  for (int seed = 0; seed < 10; ++seed) {
    Film film(kWidth, kHeight);
    Random random(std::uint64_t(seed) + 1);
    for (int half = 0; half < 2; ++half) {
      test::add_samples(film, half, kSamples, random, [](int x, int, int, Random& r) {
        return 1.0f + (x < kWidth / 2 ? kQuiet : kNoisy) * (test::exponential(1.0f, r) - 1.0f);
      });
    }
    const std::vector<float> variance = test::variance_of(film);
    const auto difference = [&](int x, int y) {
      const double d = (film.half(0, x, y).sum[0] - film.half(1, x, y).sum[0]) / (2.0 * kSamples);
      return d * d;
    };
    for (int y = 0; y < kHeight; ++y) {
      for (int x = 0; x < kWidth; ++x) {
        double box = 0;
        int n = 0;
        for (int j = std::max(0, y - 3); j <= std::min(kHeight - 1, y + 3); ++j) {
          for (int i = std::max(0, x - 3); i <= std::min(kWidth - 1, x + 3); ++i, ++n) box += difference(i, j);
        }
        box /= n;
        const double v = variance[std::size_t(y * kWidth + x)];
        const double e = std::pow(resolve_mean(film, x, y).x - 1.0, 2);
        score += std::log(v) + e / v;
        box_score += std::log(box) + e / box;
        if (x == kWidth / 2 - 2) quiet_ratio += v / box / (10 * kHeight);
      }
    }
  }
  EXPECT_LT(score, box_score - 0.01 * 10 * kWidth * kHeight);
  EXPECT_NEAR(quiet_ratio, 0.5, 0.02) << "a quiet pixel beside the edge: half of the box is the floor";
}

TEST(Variance, IsNeverZeroWhereANeighbourIsNot) {
  Film film(20, 20);
  Random random(1);
  for (int half = 0; half < 2; ++half) test::add_samples(film, half, 4, random, [](auto...) { return 0.0f; });
  film.half(1, 9, 9).add(Rgb(1e-30f, 0, 0));
  for (int c = 0; c < 3; ++c) {
    const std::vector<float> variance = test::variance_of(film, c);
    for (int y = 0; y < 20; ++y) {
      for (int x = 0; x < 20; ++x) {
        const bool near = c == 0 && std::abs(x - 9) <= 3 && std::abs(y - 9) <= 3;
        EXPECT_EQ(variance[std::size_t(y * 20 + x)] > 0, near) << x << " " << y << " channel " << c;
      }
    }
  }
}

// Bits of every pixel, whatever the window; with holes, single samples and a region of interest.
class VarianceOfCuts : public testing::TestWithParam<bool> {};

TEST_P(VarianceOfCuts, DoesNotDependOnTheCut) {
  const bool counts_differ = GetParam();
  Film film(61, 47, FilmState{.targets = counts_differ});
  Random random(3);
  for (int y = 0; y < 47; ++y) {
    for (int x = 0; x < 61; ++x) {
      for (int half = 0; half < 2; ++half) {
        const int samples = x < 20 ? 4 : x >= 40 && counts_differ ? 1 << y % 6 : int(random.next_u32() % 4);
        for (int k = 0; k < samples; ++k) film.half(half, x, y).add(Rgb(test::exponential(2.0f, random)));
      }
    }
  }
  for (const PixelRect roi : {film.bounds(), PixelRect{5, 7, 50, 40}}) {
    const ResolvedTile whole = resolve_tile(film, roi, roi, kResolveAll);
    for (const int side : {1, 4, 7, 16, 64}) {
      for (int y = roi.y0; y < roi.y1; y += side) {
        for (int x = roi.x0; x < roi.x1; x += side) {
          const PixelRect window = intersect({x, y, x + side, y + side}, roi);
          const ResolvedTile tile = resolve_tile(film, window, roi, kResolveAll);
          for (int c = 0; c < 3; ++c) {
            for (int j = 0; j < window.height(); ++j) {
              const std::size_t at = std::size_t(y + j - roi.y0) * std::size_t(roi.width()) + std::size_t(x - roi.x0);
              const std::size_t bytes = sizeof(float) * std::size_t(window.width());
              const std::size_t row = std::size_t(j) * std::size_t(window.width());
              ASSERT_EQ(std::memcmp(&whole.variance[c][at], &tile.variance[c][row], bytes), 0) << x << " " << y;
              ASSERT_EQ(std::memcmp(&whole.radiance[c][at], &tile.radiance[c][row], bytes), 0) << x << " " << y;
            }
          }
        }
      }
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Films, VarianceOfCuts, testing::Bool(),
                         [](const auto& test) { return test.param ? "CountsDiffer" : "CountsAreAlike"; });

TEST_P(VarianceOfCuts, NeverReadsOutsideTheRegion) {
  const PixelRect roi{8, 8, 24, 24};
  std::vector<float> first;
  for (const float outside : {0.0f, 1e6f}) {
    Film film(32, 32, FilmState{.targets = GetParam()});
    Random random(5);
    for (int half = 0; half < 2; ++half) {
      test::add_samples(film, half, 2, random, [&](int x, int y, int k, Random& r) {
        const float inside = test::exponential(1.0f, r);
        return roi.contains(x, y) ? inside : outside * float(half + k);
      });
      for (int y = 0; y < 32 && GetParam(); ++y) {
        for (int k = 0; k < (outside > 0 ? 64 : 16); ++k) film.half(half, y < 16 ? 7 : 24, y).add(Rgb(outside));
      }
    }
    const std::vector<float> variance = resolve_tile(film, roi, roi, kResolveVariance).variance[0];
    if (first.empty()) first = variance;
    EXPECT_EQ(variance, first);
  }
}

TEST(Variance, OfPixelsOutsideTheRegionIsUnknown) {
  Film film(16, 16);
  Random random(5);
  for (int half = 0; half < 2; ++half) test::add_samples(film, half, 2, random, [](auto...) { return 1.0f; });
  const PixelRect roi{0, 0, 8, 16};
  const std::vector<float> variance = resolve_tile(film, film.bounds(), roi, kResolveVariance).variance[0];
  EXPECT_EQ(variance[7], 0.0f);
  EXPECT_EQ(variance[8], kInfinity);
  EXPECT_EQ(variance[15], kInfinity);
}

TEST(Variance, IsUnknownWithoutSamples) {
  Film film(9, 9);
  for (const float v : test::variance_of(film)) EXPECT_EQ(v, kInfinity);
  film.half(0, 4, 4).add(Rgb(1.0f));
  EXPECT_EQ(test::variance_of(film)[4 * 9 + 4], kInfinity) << "one pixel with one sample, no neighbour to compare with";
}

// Noise and counts that differ from pixel to pixel: a pixel with many samples does not get the variance of a neighbour
// with few.
TEST(Variance, FollowsTheCountsOfPixels) {
  const int side = 48, few = 8, many = 128;
  double reported[2] = {0, 0};
  for (int run = 0; run < 8; ++run) {
    Film film(side, side, FilmState{.targets = true});
    test::Random random(std::uint64_t(run + 1));
    for (int y = 0; y < side; ++y) {
      for (int x = 0; x < side; ++x) {
        for (int h = 0; h < kHalves; ++h) {
          for (int k = 0; k < ((x + y) % 2 ? many : few); ++k)
            film.half(h, x, y).add(Rgb(test::exponential(1, random)));
        }
      }
    }
    const std::vector<float> variance = test::variance_of(film);
    for (int i = 0; i < side * side; ++i)
      reported[(i % side + i / side) % 2] += variance[std::size_t(i)] / (4 * side * side);
  }
  EXPECT_NEAR(reported[0], 1.0 / (2 * few), 0.1 / (2 * few));
  EXPECT_NEAR(reported[1], 1.0 / (2 * many), 0.1 / (2 * many));
}

// Stripes of three pixels and of four: few samples of one noise, many of another, as at borders that carry nothing
// beside surfaces that carry what they had. Over all of a neighbourhood both would be given the mean of the two noises
// a sample.
TEST(Variance, IsThatOfPixelsWithAboutAsManySamples) {
  constexpr int kSide = 42, kPeriod = 7, kOfFew = 3, kMany = 64;
  struct Case {
    float few, many;  // deviation of a sample
  };
  for (const Case& c : {Case{0.1f, 1.0f}, Case{1.0f, 0.1f}}) {
    double few = 0, many = 0;
    constexpr int kRuns = 40;
    for (int run = 0; run < kRuns; ++run) {
      Film film(kSide, kSide, FilmState{.targets = true});
      Random random(std::uint64_t(run + 1));
      for (int h = 0; h < kHalves; ++h) {
        for (int y = 0; y < kSide; ++y) {
          for (int x = 0; x < kSide; ++x) {
            const bool scarce = y % kPeriod < kOfFew;
            for (int k = 0; k < (scarce ? 1 : kMany); ++k)
              film.half(h, x, y).add(Rgb(test::exponential(scarce ? c.few : c.many, random)));
          }
        }
      }
      const std::vector<float> variance = test::variance_of(film);
      for (int y = kPeriod; y < kSide - kPeriod; ++y) {
        for (int x = kPeriod; x < kSide - kPeriod; ++x)
          (y % kPeriod < kOfFew ? few : many) += variance[std::size_t(y * kSide + x)];
      }
    }
    // Per sample: of 21 and 28 pixels of a kind, and the mean of all 49 as one more.
    const double v_few = c.few * c.few, v_many = c.many * c.many, all = (3 * v_few + 4 * v_many) / 7;
    const double pixels = kRuns * (kSide - 2 * kPeriod) * (kSide - 2 * kPeriod) / double(kPeriod);
    EXPECT_NEAR(few / (kOfFew * pixels) / ((21 * v_few + all) / 22 / 2), 1, 0.05) << c.few;
    EXPECT_NEAR(many / ((kPeriod - kOfFew) * pixels) / ((28 * v_many + all) / 29 / (2 * kMany)), 1, 0.05) << c.few;
  }
}

// Rows of pixels with 16 samples a half, whose halves differ by 0.2, and rows with more that agree; samples scatter
// alike but for one pixel's. Four times as many are about as many, more are not.
TEST(Variance, IsPooledOverUpToFourTimesAsManySamples) {
  constexpr std::uint32_t kFew = 16;
  constexpr double kDifference = 0.1, kNoise = 2 * kFew * kDifference * kDifference;  // of half a mean | of a sample
  for (const std::uint32_t many : {4 * kFew, 4 * kFew + 1}) {
    Film film(21, 21, FilmState{.targets = true});
    for (int h = 0; h < kHalves; ++h) {
      for (int y = 0; y < 21; ++y) {
        for (int x = 0; x < 21; ++x) {
          HalfPixel& half = film.half(h, x, y);
          half.count = y % 2 == 0 ? kFew : many;
          const double mean = y % 2 == 0 ? (h == 0 ? 1 + kDifference : 1 - kDifference) : 1;
          for (int c = 0; c < 3; ++c) {
            half.sum[c] = mean * half.count;
            half.deviations[c] = (x == 10 && y == 10 ? 2.0f : 1.0f) * (float(half.count) - 1);
          }
        }
      }
    }
    const std::vector<float> variance = test::variance_of(film);
    const auto expect = [&](int x, int y, int noisy_rows, double spread) {
      const bool few = y % 2 == 0;
      const double all = kNoise * noisy_rows / 7;
      const int alike = 7 * (few ? noisy_rows : 7 - noisy_rows);
      double pooled = all, n = 49;
      if (many > 4 * kFew) {
        pooled = (alike * (few ? kNoise : 0) + all) / (alike + 1);
        n = alike;
      }
      // q / Q, where the pixel that scatters twice as much is among the n.
      const double ratio = spread * n / (n + 1);
      EXPECT_NEAR(variance[std::size_t(y * 21 + x)] / (pooled * (0.5 + 0.5 * ratio) / (2 * (few ? kFew : many))), 1,
                  1e-4)
          << x << " " << y << " " << many;
    };
    expect(10, 10, 3, 2);
    expect(9, 10, 3, 1);
    if (many == 4 * kFew) expect(10, 9, 4, 1);
    if (many > 4 * kFew) {
      EXPECT_NEAR(variance[9 * 21 + 10] / (kNoise * 4 / 7 / 22 / (2 * many)), 1, 1e-4);
    }
  }
}

// One that is alone with its count has half of what is around it, whatever its own halves say.
TEST(Variance, OfALonePixelOfFewSamplesIsNotItsOwnWord) {
  Film film(20, 20, FilmState{.targets = true});
  Random random(1);
  for (int h = 0; h < kHalves; ++h) {
    test::add_samples(film, h, 64, random, [](int, int, int, Random& r) { return test::exponential(1.0f, r); });
    film.half(h, 9, 9) = HalfPixel();
    film.half(h, 9, 9).add(Rgb(1.0f));
  }
  const std::vector<float> variance = test::variance_of(film);
  double around = 0;
  for (int y = 6; y <= 12; ++y) {
    for (int x = 6; x <= 12; ++x) {
      const double d = 0.5 * (film.half(0, x, y).sum[0] - film.half(1, x, y).sum[0]) / 64;
      if (x != 9 || y != 9) around += d * d * 128 / 49;
    }
  }
  EXPECT_NEAR(variance[9 * 20 + 9], 0.5 * around / 2, 1e-4 * around);
}

// One sample a pixel, in half A: the difference of neighbours stands in. Right where the picture is flat, more where it
// is not; the variance of that one sample is mean^2 (exponential noise).
TEST(Variance, OfOneHalfIsConservative) {
  double flat = 0, sloped = 0;
  for (int seed = 0; seed < 20; ++seed) {
    Film film(40, 40), slope(40, 40);
    test::Random random(std::uint64_t(seed) + 1), again(std::uint64_t(seed) + 1);
    test::add_samples(film, 0, 1, random, [](int, int, int, Random& r) { return test::exponential(1.0f, r); });
    test::add_samples(slope, 0, 1, again,
                      [](int x, int, int, Random& r) { return 2.0f * float(x) + test::exponential(1.0f, r); });
    flat += test::mean_of(test::variance_of(film)) / 20;
    sloped += test::mean_of(test::variance_of(slope)) / 20;
  }
  EXPECT_NEAR(flat, 1.0, 0.04);
  EXPECT_NEAR(sloped, 2.0, 0.08) << "plus (slope of 2)^2 / 2 in one of the two directions: 2 / 2";
}

TEST(Variance, SurvivesExtremes) {
  struct Case {
    float low, high;
    std::uint32_t count;
  };
  for (const Case& c : {Case{1e9f, 1.1e9f, 100'000'000}, {1e-40f, 3e-40f, 4}, {0.0f, 3e38f, 2}, {1e-6f, 1e9f, 1000}}) {
    Film film(10, 10);
    for (int i = 0; i < 100; ++i) {
      for (int half = 0; half < 2; ++half) {
        HalfPixel& p = film.half(half, i % 10, i / 10);
        const double mean = half == 0 ? c.low : c.high;
        p.count = c.count;
        for (int k = 0; k < 3; ++k) {
          p.sum[k] = mean * c.count;
          p.deviations[k] = float(std::min(0.5 * mean * mean * c.count, 0x1p127));
        }
      }
    }
    const double difference = 0.5 * (double(c.high) - c.low);
    const double expected = std::clamp(difference * difference, double(FLT_MIN), 1e34);
    const ResolvedTile tile = resolve_tile(film, film.bounds(), film.bounds(), kResolveAll);
    for (int i = 0; i < 100; ++i) {
      ASSERT_TRUE(std::isfinite(tile.radiance[0][std::size_t(i)]));
      ASSERT_NEAR(tile.variance[0][std::size_t(i)] / expected, 1.0, 1e-3) << c.low << " " << c.high;
    }
    const FilmError error = estimate_error(film, film.bounds());
    EXPECT_TRUE(error.known);
    EXPECT_NEAR(error.rmse / difference, 1.0, 1e-6) << c.low << " " << c.high;
    EXPECT_TRUE(std::isfinite(error.relmse));
  }
}

}  // namespace
}  // namespace helio
