// Sums over neighbourhoods against sums of all pixels, one by one.
#include "renderer/film/display/blend_errors.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "tests/support/random.h"

namespace helio::test {
namespace {

struct Sums {
  double count = 0, film = 0, noise = 0, residuals = 0, squares = 0, apart = 0, gain = 0, rel_residuals = 0,
         rel_squares = 0, rel_apart = 0;

  void add(const BlendEvidence::Pixel& p) {
    const double scale = 1 / (std::pow(p.brightness, 2) + 1e-6);
    ++count;
    film += p.variance;
    noise += p.noise;
    residuals += p.residuals;
    squares += std::pow(p.residuals, 2);
    apart += p.apart;
    gain += (p.variance - p.noise + p.apart) * scale;
    rel_residuals += p.residuals * scale;
    rel_squares += std::pow(p.residuals * scale, 2);
    rel_apart += p.apart * scale;
  }
  static double bias(double mean, double mean_square, double n) {
    return mean > 0 ? std::pow(mean, 3) / (std::pow(mean, 2) + mean_square / n / 4) : 0;
  }
};

TEST(BlendEvidence, IsTheMeanOverTheNeighboursOfAClass) {
  for (const PixelRect& window : {PixelRect{0, 0, 1, 1}, PixelRect{3, 5, 4, 40}, PixelRect{7, 2, 135, 3},
                                  PixelRect{0, 0, 20, 13}}) {
    constexpr int kRadius = BlendEvidence::kRadius;
    Random random(11);
    BlendEvidence evidence;
    evidence.begin(window);
    const int wide = window.width() + 2 * kRadius;
    std::vector<BlendEvidence::Pixel> pixels;
    std::vector<int> classes;  // -1: without samples in both halves
    for (int y = window.y0 - kRadius; y < window.y1 + kRadius; ++y) {
      for (int x = window.x0 - kRadius; x < window.x1 + kRadius; ++x) {
        const auto u = [&] { return float(random.next_double()); };
        pixels.push_back({u(), u(), u() - 0.3f, u(), 2 * u()});
        classes.push_back(int(random.next_double() * 3) - 1);
        if (classes.back() >= 0) evidence.add(x, y, classes.back() == 1, pixels.back());
      }
    }
    evidence.average();
    for (int y = window.y0; y < window.y1; ++y) {
      for (int x = window.x0; x < window.x1; ++x) {
        for (const int of : {0, 1}) {
          Sums s;
          for (int dy = 0; dy <= 2 * kRadius; ++dy) {
            for (int dx = 0; dx <= 2 * kRadius; ++dx) {
              const auto i = std::size_t((y - window.y0 + dy) * wide + x - window.x0 + dx);
              if (classes[i] == of) s.add(pixels[i]);
            }
          }
          const BlendErrors errors = evidence.errors(x, y, of == 1);
          ASSERT_TRUE(errors.known);
          EXPECT_NEAR(errors.film, s.film / s.count, 1e-4);
          EXPECT_NEAR(errors.apart, s.apart / s.count, 1e-4);
          const double b = Sums::bias(s.residuals / s.count, s.squares / s.count, s.count);
          EXPECT_NEAR(errors.filtered, s.noise / s.count + b, 1e-4);
          const double rel_b = Sums::bias(s.rel_residuals / s.count, s.rel_squares / s.count, s.count);
          const double share = (s.gain / s.count - rel_b) / (2 * s.rel_apart / s.count);
          EXPECT_NEAR(evidence.best_share(x, y, of == 1), std::min(std::max(share, 0.0), 1.0), 1e-3);
        }
      }
    }
  }
}

TEST(BlendEvidence, KnowsNothingOfAClassWithoutPixels) {
  BlendEvidence evidence;
  evidence.begin({0, 0, 2, 2});
  evidence.add(0, 0, true, {1, 1, 0, 1, 1});
  evidence.average();
  EXPECT_TRUE(evidence.errors(1, 1, true).known);
  EXPECT_FALSE(evidence.errors(1, 1, false).known);
  EXPECT_EQ(evidence.best_share(1, 1, false), 0);
}

}  // namespace
}  // namespace helio::test
