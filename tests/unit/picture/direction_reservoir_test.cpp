// What a pixel remembers of its light: of each half two directions and a share, in twelve bytes.
#include "renderer/film/core/direction_reservoir.h"

#include <gtest/gtest.h>

#include <cfloat>
#include <cmath>
#include <initializer_list>

#include "tests/support/directions.h"
#include "tests/support/random.h"

namespace helio::test {
namespace {

constexpr int kPlaces = DirectionReservoir::kPlaces;

DirectionReservoir::Chances chances(Random& random) {
  DirectionReservoir::Chances u;
  for (float& place : u.place) place = random.next_float();
  u.share = random.next_float();
  return u;
}

TEST(DirectionReservoir, PlacesAndSharesAreKeptApart) {
  Random random(3);
  std::uint32_t expected[kHalves][kPlaces] = {};
  float shares[kHalves] = {1, 1};
  DirectionReservoir reservoir;
  EXPECT_EQ(reservoir.share(0), 1) << "of what nothing is known all may change";
  for (int i = 0; i < 2000; ++i) {
    const int h = i % 2, k = i / 2 % kPlaces;
    const auto code = std::uint32_t(random.next_float() * 0x1p20f);
    reservoir.set_direction(h, k, expected[h][k] = code);
    if (i % 3 == 0) reservoir.set_share(h, shares[h] = random.next_float());
    for (int a = 0; a < kHalves; ++a) {
      for (int b = 0; b < kPlaces; ++b) ASSERT_EQ(reservoir.direction(a, b), expected[a][b]);
      ASSERT_NEAR(reservoir.share(a), shares[a], 0.004);
    }
  }
}

TEST(DirectionReservoir, SmallSharesKeepDigits) {
  for (const float share : {0.0f, 2e-4f, 0.003f, 0.02f, 0.5f, 1.0f})
    EXPECT_NEAR(unpack_share(pack_share(share)), share, 0.003f * std::sqrt(share) + 4e-6f);
  for (const float beyond : {-1.0f, 2.0f}) EXPECT_EQ(unpack_share(pack_share(beyond)), beyond < 0 ? 0 : 1);
}

// Of 1 + 2 + ... + 8, the even ones by lobes alone, each sample has its share of the picks, in any order of arrival;
// black ones have none.
TEST(DirectionReservoir, PicksInProportionToWhatCounts) {
  constexpr int kSamples = 8, kTrials = 40000;
  const auto share_of = [](int brought) { return brought % 2 == 0 ? 1.0f : 0.0f; };
  const auto counts = [&](int i) { return double(i) * double(DirectionReservoir::counting(share_of(i))); };
  double all = 0;
  for (int i = 1; i <= kSamples; ++i) all += counts(i);
  for (const bool rising : {true, false}) {
    int picks[kSamples + 1] = {};
    Random random(1);
    for (int trial = 0; trial < kTrials; ++trial) {
      DirectionReservoir reservoir;
      double whole = 0;
      for (int i = 1; i <= kSamples; ++i) {
        const int brought = rising ? i : kSamples + 1 - i;
        reservoir.add(1, std::uint32_t(brought), float(brought), float(brought) * share_of(brought), whole += brought,
                      chances(random));
        reservoir.add(1, 99, 0, 0, whole, chances(random));
      }
      for (int k = 0; k < kPlaces; ++k) {
        EXPECT_EQ(reservoir.direction(0, k), DirectionReservoir::kNone) << "of the other half";
        const std::uint32_t picked = reservoir.direction(1, k);
        ASSERT_TRUE(picked >= 1 && picked <= kSamples);
        ++picks[picked];
      }
    }
    // As exactly as the share's byte is rounded.
    for (int i = 1; i <= kSamples; ++i) {
      const double expected = kPlaces * kTrials * counts(i) / all;
      EXPECT_NEAR(picks[i], expected, 4 * std::sqrt(expected) + 0.02 * expected) << i << (rising ? " rising" : "");
    }
  }
}

// The share is the mean over all samples, whatever the byte is rounded to on the way.
TEST(DirectionReservoir, TheShareIsThatOfAllSamples) {
  for (const int count : {1, 4, 256, 20000}) {
    for (const float often : {0.02f, 0.5f, 0.97f}) {
      Random random(1);
      const int trials = count > 1000 ? 200 : 20000;
      double mean = 0, truth = 0, squares = 0;
      for (int trial = 0; trial < trials; ++trial) {
        DirectionReservoir reservoir;
        double whole = 0, varies = 0;
        for (int i = 0; i < count; ++i) {
          const float brought = 0.5f + random.next_float(), of_lobes = random.next_float() < often ? brought : 0.0f;
          whole += double(brought);
          varies += double(of_lobes);
          reservoir.add(0, 1, brought, of_lobes, whole, chances(random));
        }
        mean += double(reservoir.share(0)) / trials;
        truth += varies / whole / trials;
        squares += std::pow(double(reservoir.share(0)) - varies / whole, 2) / trials;
      }
      EXPECT_NEAR(mean, truth, 4 * std::sqrt(squares / trials) + 1e-3) << count << ", " << often;
      EXPECT_LT(std::sqrt(squares), 0.06) << count << ", " << often;
    }
  }
}

TEST(DirectionReservoir, ExtremeSamplesLeaveNumbers) {
  Random random(1);
  for (const float brought : {0.0f, 1e-40f, 1e-20f, 1e20f, FLT_MAX}) {
    DirectionReservoir reservoir;
    double whole = 0;
    for (int i = 0; i < 100; ++i) {
      whole += double(brought);
      reservoir.add(0, 5, brought, 0.25f * brought, whole, chances(random));
    }
    if (!(brought > 0)) {
      EXPECT_TRUE(reservoir == DirectionReservoir());
      continue;
    }
    EXPECT_NEAR(reservoir.share(0), 0.25, 0.05) << brought;
    EXPECT_EQ(reservoir.direction(0, 0), 5u);
  }
}

}  // namespace
}  // namespace helio::test
