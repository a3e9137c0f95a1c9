#include "renderer/trace/gbuffer/weighed_directions.h"

#include <gtest/gtest.h>

#include <cfloat>
#include <initializer_list>
#include <limits>
#include <map>
#include <span>

#include "tests/support/directions.h"

namespace helio::test {
namespace {

constexpr int kAll = kHalves * DirectionReservoir::kPlaces;

// light: over what they weigh.
WeighedDirections directions_of(std::initializer_list<WeighedDirection> from, double light = 1) {
  WeighedDirections directions;
  for (const WeighedDirection& d : from) {
    directions.of[directions.count++] = d;
    directions.light += light * double(d.weight);
  }
  return directions;
}

std::map<std::uint32_t, int> picked(std::span<const WeighedDirections* const> among, std::uint32_t key) {
  DirectionReservoir out;
  pick_directions(among, key, out);
  std::map<std::uint32_t, int> counts;
  for (const std::uint32_t packed : directions_in(out)) ++counts[packed];
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
    ++first[out.direction(0, 0)];
  }
  for (int i = 1; i < 5; ++i) EXPECT_NEAR(first[i], 2000, 200);
}

// A pixel with as much light that lobes bring as its neighbours have together.
TEST(WeighedDirections, TheShareIsThatOfWhatIsPickedAmong) {
  DirectionReservoir lobes, base;
  lobes.set_share(0, 1);
  for (int h = 0; h < kHalves; ++h) base.set_share(h, 0);
  WeighedDirections a, b;
  a.add(lobes, 0, 6);
  b.add(base, 1, 2);
  b.add(base, 0, 8);
  EXPECT_EQ(a.of[0].weight, 3);
  EXPECT_EQ(b.of[0].weight, DirectionReservoir::kMatte);
  const WeighedDirections* const among[] = {&a, &b};
  double mean = 0;
  constexpr int kTimes = 4000;
  for (std::uint32_t key = 0; key < kTimes; ++key) {
    DirectionReservoir out;
    pick_directions(among, key, out);
    EXPECT_NEAR(out.share(1), 3.0 / 8, 0.005) << "a byte's step";
    mean += double(out.share(1)) / kTimes;
  }
  EXPECT_NEAR(mean, 3.0 / 8, 2e-4) << "rounded by chance";
  // What weighs more than its light could, for it was estimated, is all of it.
  DirectionReservoir out;
  const WeighedDirections heavy = directions_of({{1, 2}}, 0.5), light = directions_of({{1, 1e-3f}}, 1e3);
  const WeighedDirections *const one[] = {&heavy}, *const other[] = {&light};
  pick_directions(one, 1, out);
  EXPECT_EQ(out.share(0), 1);
  pick_directions(other, 1, out);
  EXPECT_EQ(out.share(0), 0);
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
}  // namespace helio::test
