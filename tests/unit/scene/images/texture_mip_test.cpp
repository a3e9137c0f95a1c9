// What mip-mapping does to a texture's value, measured: the bias that TextureOptions speaks of.
//
// The truth for a square footprint is the mean of the reference lookup over it. A pyramid is right on average over
// positions, because every level keeps the mean, and off at each position by some deviation: it is a wider, smoother
// filter. The reference at the footprint's centre is right on average too and off by the texture's whole deviation, but
// that error is noise, which sampling averages away; the pyramid's is not.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>

#include "renderer/scene/images/texture.h"
#include "tests/support/random.h"

namespace helio {
namespace {

using test::Random;

constexpr int kSize = 64;

// Uncorrelated 0 / 1 texels: the worst case, every frequency alike; deviation 0.5.
Image noise_image(Random& random) {
  Image image;
  image.width = image.height = kSize;
  image.channels = 1;
  image.texels.resize(kSize * kSize);
  for (std::uint8_t& texel : image.texels) texel = random.next_u32() & 1 ? 255 : 0;
  return image;
}

TextureSlot repeat_slot() {
  TextureSlot slot;
  slot.image = 0;
  return slot;
}

double mean_over_square(const TextureTable& table, const V2f& centre, float width) {
  constexpr int kTaps = 48;
  double sum = 0;
  for (int y = 0; y < kTaps; ++y) {
    for (int x = 0; x < kTaps; ++x) {
      const V2f offset((x + 0.5f) / kTaps - 0.5f, (y + 0.5f) / kTaps - 0.5f);
      sum += table.lookup(repeat_slot(), centre + offset * width).x;
    }
  }
  return sum / (kTaps * kTaps);
}

TEST(TextureMip, BiasIsNoneOnAverageAndBoundedAtEachPlace) {
  Random random(11);
  const std::vector<Image> images = {noise_image(random)};
  const TextureTable table(images, {{repeat_slot()}});
  struct Row {
    float texels;              // footprint width
    double allowed_deviation;  // of the pyramid from the truth, r.m.s.
  };
  // Measured: 0.107, 0.069, 0.040, 0.020; a box of n texels of such noise itself deviates by about 0.5 / n.
  const Row rows[] = {{2, 0.14}, {4, 0.10}, {8, 0.05}, {16, 0.025}};
  for (const Row& row : rows) {
    double bias = 0, square = 0;
    constexpr int kPlaces = 400;
    for (int i = 0; i < kPlaces; ++i) {
      const V2f uv = random.next_v2f();
      const float width = row.texels / kSize;
      const double error = table.lookup(repeat_slot(), uv, width).x - mean_over_square(table, uv, width);
      bias += error / kPlaces;
      square += error * error / kPlaces;
    }
    const double deviation = std::sqrt(square);
    std::printf("footprint %2.0f texels: mean error %+.4f, deviation %.4f\n", row.texels, bias, deviation);
    EXPECT_LT(deviation, row.allowed_deviation);
    EXPECT_GT(deviation, row.allowed_deviation / 8);  // it is not free: a report of zero would be a broken test
    // Places are independent beyond a footprint: the mean error must be within five standard errors of 0, with no more
    // independent places than footprints in the texture.
    const double independent = std::min<double>(kPlaces, kSize * kSize / (row.texels * row.texels));
    EXPECT_LT(std::abs(bias), 5 * deviation / std::sqrt(independent));
  }
}

TEST(TextureMip, EveryLevelKeepsTheMean) {
  Random random(12);
  Image image = noise_image(random);
  image.width = 37;  // sizes that do not halve evenly
  image.height = 23;
  image.texels.resize(37 * 23);
  const std::vector<Image> images = {image};
  const TextureTable table(images, {{repeat_slot()}});
  // The last level is one texel: a footprint as wide as the texture returns it everywhere.
  const double mean = table.mean(0, TexelEncoding::linear).x;
  for (int i = 0; i < 10; ++i) EXPECT_NEAR(table.lookup(repeat_slot(), random.next_v2f(), 8.0f).x, mean, 1e-5);
}

TEST(TextureMip, OffByDefaultAndForFootprintsOfATexel) {
  Random random(13);
  const std::vector<Image> images = {noise_image(random)};
  const TextureTable plain(images), mipped(images, {{repeat_slot()}});
  for (int i = 0; i < 100; ++i) {
    const V2f uv = random.next_v2f();
    EXPECT_EQ(plain.lookup(repeat_slot(), uv, 0.5f), plain.lookup(repeat_slot(), uv));
    EXPECT_EQ(mipped.lookup(repeat_slot(), uv, 1.0f / kSize), plain.lookup(repeat_slot(), uv));
  }
  EXPECT_LT(plain.memory_bytes(), 1000u);
  // A third of the texels at 16 bytes.
  EXPECT_NEAR(double(mipped.memory_bytes() - plain.memory_bytes()), kSize * kSize * 16 / 3.0, 400);
}

}  // namespace
}  // namespace helio
