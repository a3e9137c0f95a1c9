// Mode adaptive through the render loop: counts, bias, gain, and the same bits however the work was shared.
#include <gtest/gtest.h>

#include <cmath>
#include <tuple>

#include "adaptive_frames.h"
#include "renderer/film/core/sample_targets.h"

namespace helio {
namespace {

// At each stop, by a number of samples or by the error that is looked for, at most 0.5 %. A sample deviates by 5 from a
// mean of 1, so that 16 pictures of 256^2 pixels leave a standard error of 0.1 % at 24 samples and less later: what
// is unbiased passes with four of them to spare.
TEST(AdaptiveFrame, ARareBrightEventDoesNotBiasTheMean) {
  constexpr int kSeeds = 16;
  Budget by_error;
  by_error.error = 0.7;  // 5 / sqrt(n), after about 52 samples: counts differ after 16
  for (const Budget& budget : {samples(24), samples(48), samples(64), by_error}) {
    double sum = 0, squares = 0, all_taken = 0;
    for (int seed = 1; seed <= kSeeds; ++seed) {
      RenderSettings settings = adaptive(256, 256);
      settings.seed = std::uint64_t(seed);
      double taken = 0;
      const double bias = bias_of(settings, budget, taken);
      EXPECT_NEAR(taken, budget.samples.value_or(52), 0.05 * taken);
      sum += bias;
      squares += bias * bias;
      all_taken += taken / kSeeds;
    }
    const double bias = sum / kSeeds;
    const double error = std::sqrt((squares / kSeeds - bias * bias) / (kSeeds - 1));
    std::printf("stopped after %.1f samples: bias %+.3f %% +- %.3f %%\n", all_taken, 100 * bias, 100 * error);
    EXPECT_LT(std::abs(bias), 0.005);
    EXPECT_LT(error, 0.00125);
  }
}

// A picture whose right tenth is ten times as noisy: squared error and samples, summed over pixels.
struct NoisyTenth {
  double error = 0, taken = 0, pixels = 0;
  FrameEnd end;

  explicit NoisyTenth(const Budget& budget) {
    FakeIntegrator fake;
    fake.noise = 0.05f;
    fake.noisy_from = 0.9f;
    RenderSettings settings = adaptive(160, 96);
    settings.adaptive.measure = ErrorMeasure::rmse;
    end = render(fake, settings, budget, 2, [&](int, int, double mean, double n) {
      error += (mean - 0.5) * (mean - 0.5);
      taken += n;
      ++pixels;
    });
  }
};

// Of that picture: mean square error over that of uniform counts, and the ceiling.
TEST(AdaptiveFrame, SamplesGoWhereTheNoiseIs) {
  const NoisyTenth picture(samples(256));
  const auto [error, taken, pixels] = std::tuple(picture.error, picture.taken, picture.pixels);
  const double sigma2 = 0.05 * 0.05 / 3, mean_s2 = 0.9 * sigma2 + 0.1 * 100 * sigma2;
  const double mean_s = std::sqrt(sigma2) * (0.9 + 0.1 * 10);
  const double ceiling = mean_s2 / (mean_s * mean_s);
  const double gain = mean_s2 / (taken / pixels) / (error / pixels);
  std::printf("gain %.2f of at most %.2f at %.1f samples\n", gain, ceiling, taken / pixels);
  EXPECT_NEAR(taken / pixels, 256, 8);
  EXPECT_GT(gain, 0.8 * ceiling);
}

TEST(AdaptiveFrame, SameBitsForAnyNumberOfThreads) {
  FakeIntegrator fake = rare_event();
  for (const ModeVariant variant : {ModeVariant::bounded, ModeVariant::paper}) {
    std::vector<double> first;
    for (const int threads : {1, 2, 4}) {
      std::vector<double> seen(2 * 70 * 45);
      fake.counters = std::make_shared<FakeIntegrator::Counters>();
      render(fake, adaptive(70, 45, variant), samples(40), threads, [&](int x, int y, double mean, double n) {
        seen[std::size_t(2 * (y * 70 + x))] = mean;
        seen[std::size_t(2 * (y * 70 + x) + 1)] = n;
      });
      if (first.empty()) first = seen;
      EXPECT_EQ(seen, first) << to_string(variant) << ", " << threads << " threads";
    }
  }
}

TEST(AdaptiveFrame, EndsAtItsBudgetEvenWithOnePixel) {
  for (const int side : {1, 3, 17}) {
    for (const std::uint32_t n : {1u, 2u, 15u, 16u, 17u, 100u}) {
      FakeIntegrator fake;
      double taken = 0;
      const FrameEnd end =
          render(fake, adaptive(side, side), samples(n), 2, [&](int, int, double, double s) { taken += s; });
      EXPECT_EQ(end.reason, FrameEndReason::samples);
      EXPECT_LE(taken, double(n) * side * side);
      EXPECT_GE(taken, std::min(16.0, double(n)) * side * side);
    }
  }
}

TEST(AdaptiveFrame, ATargetErrorIsReached) {
  Budget budget;
  budget.error = 0.004;
  const NoisyTenth picture(budget);
  const auto [error, taken, pixels] = std::tuple(picture.error, picture.taken, picture.pixels);
  const FrameEnd& end = picture.end;
  EXPECT_EQ(end.reason, FrameEndReason::error);
  std::printf("error %.5f at %.1f samples\n", std::sqrt(error / pixels), taken / pixels);
  EXPECT_NEAR(std::sqrt(error / pixels), 0.004, 0.1 * 0.004);
}

}  // namespace
}  // namespace helio
