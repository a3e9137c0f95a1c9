#include "renderer/trace/sampling/sampler.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>
#include <vector>

#include "renderer/trace/sampling/sample_batch.h"
#include "renderer/trace/sampling/warp.h"

namespace helio {
namespace {

// Every 2^m consecutive, aligned points of a pair are a (0, m, 2)-net in base 2: each elementary interval of area
// 2^-m holds exactly one.
TEST(Sampler, AlignedBlocksAreNets) {
  for (std::uint32_t key : {1u, 77u, 0xdeadbeefu}) {
    for (std::uint32_t pair : {0u, 3u, 21u}) {
      for (int m = 0; m <= 9; ++m) {
        const std::uint32_t n = 1u << m;
        for (std::uint32_t first : {0u, 5 * n}) {
          for (int a = 0; a <= m; ++a) {
            std::set<std::uint32_t> cells;
            for (std::uint32_t i = first; i < first + n; ++i) {
              const SamplePair p = sample_pair(key, reverse_bits(i), pair);
              cells.insert(std::uint32_t(p.x * float(1u << a)) * (1u << (m - a)) +
                           std::uint32_t(p.y * float(1u << (m - a))));
            }
            ASSERT_EQ(cells.size(), n) << "key " << key << " pair " << pair << " m " << m << " a " << a;
          }
        }
      }
    }
  }
}

// The same where the index has more than 16 bits: the upper half of a word takes part in the matrix.
TEST(Sampler, BlocksOfMoreThanSixteenBitsAreNets) {
  constexpr int m = 18;
  constexpr std::uint32_t n = 1u << m;
  for (int a = 0; a <= m; a += 3) {
    std::vector<bool> cells(n, false);
    for (std::uint32_t i = 0; i < n; ++i) {
      const SamplePair p = sample_pair(77, reverse_bits(i), 3);
      cells[std::uint32_t(p.x * float(1u << a)) * (1u << (m - a)) + std::uint32_t(p.y * float(1u << (m - a)))] = true;
    }
    EXPECT_EQ(std::count(cells.begin(), cells.end(), true), n) << "a " << a;
  }
}

TEST(Sampler, OneDimensionIsStratified) {
  std::set<int> cells;
  for (std::uint32_t i = 0; i < 256; ++i) cells.insert(int(sample_1d(9, reverse_bits(i), 4) * 256));
  EXPECT_EQ(cells.size(), 256u);
}

// Different dimensions, pixels, halves and seeds are independent: the products of centred values average to zero.
// Standard deviation of the mean of n products of two uniform variates is 1 / (12 sqrt(n)).
TEST(Sampler, KeysAreIndependent) {
  const int n = 1 << 16;
  double pixels = 0, halves = 0, seeds = 0, pairs = 0, within = 0;
  for (int i = 0; i < n; ++i) {
    const int x = i & 255, y = i >> 8;
    const auto value = [](std::uint32_t key, std::uint32_t pair) { return sample_pair(key, reverse_bits(3), pair); };
    const double base = value(pixel_key(x, y, 0, 5), 2).x - 0.5;
    pixels += base * (value(pixel_key(x + 1, y, 0, 5), 2).x - 0.5);
    halves += base * (value(pixel_key(x, y, 1, 5), 2).x - 0.5);
    seeds += base * (value(pixel_key(x, y, 0, 6), 2).x - 0.5);
    pairs += base * (value(pixel_key(x, y, 0, 5), 3).x - 0.5);
    within += base * (value(pixel_key(x, y, 0, 5), 2).y - 0.5);
  }
  const double bound = 4.5 / (12 * std::sqrt(double(n)));
  EXPECT_LT(std::abs(pixels / n), bound);
  EXPECT_LT(std::abs(halves / n), bound);
  EXPECT_LT(std::abs(seeds / n), bound);
  EXPECT_LT(std::abs(pairs / n), bound);
  EXPECT_LT(std::abs(within / n), bound);
}

// The order in which two padded pairs visit their strata must differ, or their product space is covered badly: over 16
// samples the joint 4 x 4 cells of two x values would then always be the same few.
TEST(Sampler, PairsAreShuffledAgainstEachOther) {
  std::set<int> joint;
  for (std::uint32_t key = 0; key < 64; ++key) {
    for (std::uint32_t i = 0; i < 4; ++i) {
      const float a = sample_pair(hash32(key), reverse_bits(i), 2).x,
                  b = sample_pair(hash32(key), reverse_bits(i), 3).x;
      joint.insert(int(a * 4) * 4 + int(b * 4));
    }
  }
  EXPECT_EQ(joint.size(), 16u);
}

TEST(Sampler, StaysBelowOneAtTheLargestIndex) {
  for (std::uint32_t key = 0; key < 100000; ++key) {
    const SamplePair p = sample_pair(key, reverse_bits(0xffffffffu - key), key & 63);
    ASSERT_GE(p.x, 0.0f);
    ASSERT_LT(p.x, 1.0f);
    ASSERT_GE(p.y, 0.0f);
    ASSERT_LT(p.y, 1.0f);
  }
}

TEST(SampleBatch, HasTheBitsOfSingleVariates) {
  constexpr int kCount = 37;  // no multiple of a vector's width
  std::vector<std::uint32_t> keys(kCount);
  for (int i = 0; i < kCount; ++i) keys[std::size_t(i)] = combine_hash(7, std::uint32_t(i));
  std::vector<float> x(kCount), y(kCount), z(kCount);
  for (const std::uint32_t sample : {0u, 1u, 1000003u, ~0u}) {
    const std::uint32_t index = reverse_bits(sample);
    sample_pairs(keys.data(), kCount, index, 5, x.data(), y.data());
    for (std::size_t i = 0; i < kCount; ++i) {
      const SamplePair alone = sample_pair(keys[i], index, 5);
      EXPECT_EQ(x[i], alone.x);
      EXPECT_EQ(y[i], alone.y);
    }
    std::vector<float> a(kCount), b(kCount);
    cosine_hemispheres(x.data(), y.data(), kCount, a.data(), b.data(), z.data());
    for (std::size_t i = 0; i < kCount; ++i)
      EXPECT_EQ(V3f(a[i], b[i], z[i]), square_to_cosine_hemisphere(V2f(x[i], y[i])));
    sample_1ds(keys.data(), kCount, index, 9, z.data());
    for (std::size_t i = 0; i < kCount; ++i) EXPECT_EQ(z[i], sample_1d(keys[i], index, 9));
  }
}

}  // namespace
}  // namespace helio
