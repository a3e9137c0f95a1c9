#include "renderer/trace/weighed_directions.h"

#include <gtest/gtest.h>

#include <cfloat>
#include <initializer_list>
#include <limits>
#include <map>
#include <span>

namespace helio {
namespace {

constexpr int kAll = kHalves * DirectionReservoir::kPlaces;

WeighedDirections directions_of(std::initializer_list<WeighedDirection> from) {
  WeighedDirections directions;
  for (const WeighedDirection& d : from) directions.of[directions.count++] = d;
  return directions;
}

std::map<std::uint32_t, int> picked(std::span<const WeighedDirections* const> among, std::uint32_t key) {
  DirectionReservoir out;
  pick_directions(among, key, out);
  std::map<std::uint32_t, int> counts;
  for (const auto& half : out.place) {
    for (const std::uint32_t packed : half) ++counts[packed];
  }
  return counts;
}

TEST(WeighedDirections, EqualOnesAreMerged) {
  // 60 is hashed like 5.
  WeighedDirections directions = directions_of({{5, 1}, {6, 2}, {5, 4}, {60, 8}, {6, FLT_MAX}, {6, FLT_MAX}});
  directions.merge_equal();
  ASSERT_EQ(directions.count, 3u);
  EXPECT_EQ(directions.of[0].weight, 5);
  EXPECT_EQ(directions.of[1].weight, FLT_MAX);
  EXPECT_EQ(directions.of[2].packed, 60u);
}

TEST(WeighedDirections, ArePickedInProportionToTheirWeight) {
  const WeighedDirections a = directions_of({{1, 1}, {2, 0}, {3, 4.5f}}), b = directions_of({{4, 0.5f}, {1, 2}});
  const WeighedDirections none;
  const WeighedDirections* const among[] = {&a, &none, &b};
  constexpr int kTimes = 20000;
  double mean[5] = {};
  for (int i = 0; i < kTimes; ++i) {
    for (const auto& [packed, count] : picked(among, std::uint32_t(i))) {
      ASSERT_LT(packed, 5u);
      mean[packed] += double(count) / kTimes;
      // What weighs a place and more is in as many as that, or one more.
      if (packed == 3) {
        EXPECT_GE(count, 2);
        EXPECT_LE(count, 3);
      }
    }
  }
  EXPECT_EQ(mean[0], 0);
  EXPECT_EQ(mean[2], 0);
  EXPECT_NEAR(mean[1], 3 * kAll / 8.0, 0.02);
  EXPECT_NEAR(mean[3], 4.5 * kAll / 8, 0.02);
  EXPECT_NEAR(mean[4], 0.5 * kAll / 8, 0.02);
}

// A half whose places are not replaced by samples must not be left with those that came first.
TEST(WeighedDirections, EachPlaceIsAsLikelyToHoldEach) {
  const WeighedDirections four = directions_of({{1, 1}, {2, 1}, {3, 1}, {4, 1}});
  const WeighedDirections* const among[] = {&four};
  int first[5] = {};
  for (std::uint32_t key = 0; key < 8000; ++key) {
    DirectionReservoir out;
    pick_directions(among, key, out);
    ++first[std::uint32_t(out.place[0][0])];
  }
  for (int i = 1; i < 5; ++i) EXPECT_NEAR(first[i], 2000, 200);
}

TEST(WeighedDirections, NoWeightIsNoDirection) {
  const WeighedDirections zero = directions_of({{1, 0}, {2, 0}}), none;
  const WeighedDirections* const among[] = {&zero, &none};
  EXPECT_EQ(picked(among, 3), (std::map<std::uint32_t, int>{{DirectionReservoir::kNone, kAll}}));
  EXPECT_EQ(picked({}, 3), (std::map<std::uint32_t, int>{{DirectionReservoir::kNone, kAll}}));
}

TEST(WeighedDirections, ExtremeWeightsFillEveryPlace) {
  for (const float weight : {std::numeric_limits<float>::denorm_min(), 1e-30f, 1e30f, FLT_MAX}) {
    WeighedDirections full;
    for (std::uint32_t i = 0; i < kMostWeighed; ++i) full.of[full.count++] = {i + 1, weight};
    const WeighedDirections* const among[] = {&full, &full, &full, &full, &full, &full, &full, &full, &full};
    const WeighedDirections one = directions_of({{7, weight}, {8, 0}});
    const WeighedDirections* const alone[] = {&one};
    for (std::uint32_t key = 0; key < 1000; ++key) {
      EXPECT_FALSE(picked(among, key).contains(DirectionReservoir::kNone));
      EXPECT_EQ(picked(alone, key), (std::map<std::uint32_t, int>{{7, kAll}}));
    }
  }
}

}  // namespace
}  // namespace helio
