// Binary trees of boxes: every primitive lies in one leaf, below boxes that hold it, and no way is longer than allowed.
#include "renderer/trace/accel/bvh_builder.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/random.h"

namespace helio::test {
namespace {

std::vector<BvhPrimitive> scattered(std::size_t count, float size) {
  Random random(1);
  std::vector<BvhPrimitive> primitives;
  for (std::size_t i = 0; i < count; ++i) {
    const V3f lower(random.next_float(), random.next_float(), random.next_float());
    primitives.push_back({lower, 0, lower + V3f(size * random.next_float()), std::uint32_t(i)});
  }
  return primitives;
}

bool holds(const Box3f& outer, const Box3f& inner) {
  return outer.intersects(inner.min) && outer.intersects(inner.max);
}

// Counts how often each primitive is found below `child`, and checks boxes on the way.
void visit(const BinaryBvh& bvh, const BinaryBvh::Child& child, const std::vector<BvhPrimitive>& primitives,
           std::uint32_t depth, std::vector<int>& found, std::uint32_t& deepest) {
  deepest = std::max(deepest, depth);
  for (std::uint32_t i = 0; i < child.count; ++i) {
    const std::uint32_t number = bvh.order[child.first + i];
    ++found[number];
    EXPECT_TRUE(holds(child.box, Box3f(primitives[number].lower, primitives[number].upper)));
  }
  if (child.count > 0) return;
  for (const BinaryBvh::Child& below : bvh.nodes[child.first].children) {
    EXPECT_TRUE(holds(child.box, below.box));
    visit(bvh, below, primitives, depth + 1, found, deepest);
  }
}

void expect_sound(const std::vector<BvhPrimitive>& primitives, const BvhBuildOptions& options) {
  const auto built = build_binary_bvh(primitives, options);
  ASSERT_TRUE(built.ok()) << built.error().to_string();
  std::vector<int> found(primitives.size(), 0);
  std::uint32_t deepest = 0;
  visit(*built, built->root, primitives, 1, found, deepest);
  EXPECT_EQ(found, std::vector<int>(primitives.size(), 1));
  EXPECT_EQ(deepest, built->depth);
  EXPECT_LE(deepest, options.max_depth);
}

TEST(BvhBuilder, HoldsEveryPrimitiveOnce) {
  for (const std::size_t count : {1u, 2u, 5u, 1000u, 50000u}) {
    expect_sound(scattered(count, 0.02f), {});
    expect_sound(scattered(count, 0.02f), {.leaf_size = 1});
  }
}

TEST(BvhBuilder, NoPrimitivesMakeAnEmptyTree) {
  const auto built = build_binary_bvh({});
  ASSERT_TRUE(built.ok());
  EXPECT_TRUE(built->nodes.empty());
  EXPECT_TRUE(built->order.empty());
  EXPECT_TRUE(built->root.box.isEmpty());
}

TEST(BvhBuilder, IsNoDeeperThanAllowed) {
  std::vector<BvhPrimitive> same(20000, BvhPrimitive{V3f(1, 1, 1), 0, V3f(2, 2, 2), 0});
  // Each ten times the size of the one before, over and over.
  std::vector<BvhPrimitive> growing = same;
  for (std::size_t i = 0; i < same.size(); ++i) {
    same[i].number = growing[i].number = std::uint32_t(i);
    const float size = std::pow(10.0f, float(i % 24) - 12) * (1 + float(i) * 1e-6f);
    growing[i].lower = V3f(-0.5f * size, 0, size);
    growing[i].upper = V3f(size, 2 * size, 2 * size);
  }
  for (const std::uint32_t max_depth : {48u, 24u, 16u, 14u}) {
    expect_sound(same, {.max_depth = max_depth});
    expect_sound(growing, {.max_depth = max_depth});
    expect_sound(scattered(20000, 1e-3f), {.max_depth = max_depth});
  }
  // Leaves of four of 20,000 take 2^13.
  const auto refused = build_binary_bvh(same, {.max_depth = 13});
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().code, ErrorCode::resource_exhausted);
}

TEST(BvhBuilder, StopsWhenCancelled) {
  CancelToken cancel;
  cancel.cancel();
  BvhBuildOptions options;
  options.cancel = &cancel;
  const auto built = build_binary_bvh(scattered(50000, 0.02f), options);
  ASSERT_FALSE(built.ok());
  EXPECT_EQ(built.error().code, ErrorCode::cancelled);
}

}  // namespace
}  // namespace helio::test
