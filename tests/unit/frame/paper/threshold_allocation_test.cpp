// Adaptive sampling as published, through the render loop.
#include "renderer/frame/paper/threshold_allocation.h"

#include <gtest/gtest.h>

#include "adaptive_frames.h"

namespace helio {
namespace {

// Schalk's rule, which decides by the samples that it averages: paper 000's fault 4.
TEST(ThresholdAllocation, AsPublishedItIsTooDark) {
  RenderSettings settings = adaptive(128, 128, ModeVariant::paper);
  double taken = 0;
  const double bias = bias_of(settings, samples(6), taken);
  std::printf("as published: bias %.1f %% at %.1f samples\n", 100 * bias, taken);
  EXPECT_LT(bias, -0.2);
}

// Algorithm 1 pixel by pixel, as it is printed (with tau decremented), against the same samples.
TEST(ThresholdAllocation, IsAlgorithmOne) {
  const int width = 24, height = 20;
  FakeIntegrator fake;
  fake.mean = 0.4f;
  fake.noise = 0.04f;
  fake.noisy_from = 0.5f;
  RenderSettings settings = adaptive(width, height, ModeVariant::paper);
  settings.adaptive.max_samples = 12;
  std::vector<double> counts(std::size_t(width * height));
  double total = 0;
  const FrameEnd end = render(fake, settings, samples(6), 1, [&](int x, int y, double, double n) {
    counts[std::size_t(y * width + x)] = n;
    total += n;
  });
  ASSERT_EQ(end.reason, FrameEndReason::samples);
  // The same on one pixel, until as many iterations are done.
  struct Pixel {
    HalfPixel half[kHalves];
    std::uint32_t n = 0;
  };
  std::vector<Pixel> pixels(std::size_t(width * height));
  const auto take = [&](int x, int y) {
    Pixel& p = pixels[std::size_t(y * width + x)];
    const int h = int(p.n % 2);
    const float noise = float(x) < fake.noisy_from * float(width) ? fake.noise : 10 * fake.noise;
    p.half[h].add(Rgb(fake.mean + noise * (2 * hash_sample(0, x, y, h, p.n / 2) - 1)));
    ++p.n;
  };
  double mine = 0, tau = 1;
  for (std::uint32_t iteration = 0; iteration < 12 && mine < total; ++iteration) {
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) {
        const Pixel& p = pixels[std::size_t(y * width + x)];
        if (p.n >= 4 && relative_deviation(p.half[0], p.half[1]) < tau) continue;
        take(x, y);
        ++mine;
      }
    }
    if (iteration >= 4) tau -= 1.0 / (12 - 4);
  }
  EXPECT_EQ(mine, total);
  for (int i = 0; i < width * height; ++i) EXPECT_EQ(counts[std::size_t(i)], pixels[std::size_t(i)].n) << "pixel " << i;
}

}  // namespace
}  // namespace helio
