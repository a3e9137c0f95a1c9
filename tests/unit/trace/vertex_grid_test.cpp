#include "renderer/trace/vertex_grid.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "tests/support/random.h"

namespace helio::test {
namespace {

// Numbers of the points that a search finds; each at most once.
std::set<std::uint32_t> found(const VertexGrid& grid, const std::vector<std::uint32_t>& order, const V3f& at) {
  std::vector<std::uint32_t> number(order.size());
  for (std::uint32_t i = 0; i < order.size(); ++i) number[order[i]] = i;
  std::set<std::uint32_t> numbers;
  grid.for_each_near(at,
                     [&](std::uint32_t place) { EXPECT_TRUE(numbers.insert(number[place]).second) << "found twice"; });
  return numbers;
}

std::set<std::uint32_t> expected(const std::vector<V3f>& points, double radius, const V3f& at) {
  std::set<std::uint32_t> numbers;
  for (std::uint32_t i = 0; i < points.size(); ++i) {
    const V3f d = points[i] - at;
    if (double(dot(d, d)) <= radius * radius) numbers.insert(i);
  }
  return numbers;
}

TEST(VertexGrid, FindsWhatIsWithinTheRadiusAndNothingElse) {
  Random random(3);
  for (const double radius : {1e-3, 0.05, 0.3, 4.0}) {
    std::vector<V3f> points;
    for (int i = 0; i < 2000; ++i)
      points.emplace_back(2 * random.next_float() - 1, 2 * random.next_float() - 1, 0.1f * random.next_float());
    VertexGrid grid;
    std::vector<std::uint32_t> order;
    grid.build(points, radius, order);
    std::size_t all = 0;
    for (int i = 0; i < 300; ++i) {
      const V3f at = i % 3 == 0 ? points[std::size_t(i)]
                                : V3f(2 * random.next_float() - 1, 2 * random.next_float() - 1, random.next_float());
      const auto numbers = found(grid, order, at);
      EXPECT_EQ(numbers, expected(points, radius, at)) << radius;
      all += numbers.size();
    }
    EXPECT_GE(all, 100u);
  }
}

TEST(VertexGrid, OrdersEveryPointOnceAndKeepsThoseOfACellInOrder) {
  std::vector<V3f> points(100, V3f(0.25f, -7, 3));
  for (int i = 0; i < 50; ++i) points.emplace_back(float(i), 0, 0);
  VertexGrid grid;
  std::vector<std::uint32_t> order;
  grid.build(points, 0.5, order);
  std::vector<std::uint32_t> sorted = order;
  std::sort(sorted.begin(), sorted.end());
  for (std::uint32_t i = 0; i < sorted.size(); ++i) EXPECT_EQ(sorted[i], i);
  for (std::size_t i = 1; i < 100; ++i) EXPECT_EQ(order[i], order[i - 1] + 1);
  EXPECT_EQ(found(grid, order, points[0]).size(), 100u);
}

TEST(VertexGrid, TakesNothingOnePointAndPointsOnBorders) {
  VertexGrid grid;
  std::vector<std::uint32_t> order;
  grid.build({}, 1, order);
  EXPECT_TRUE(order.empty());
  EXPECT_TRUE(found(grid, order, {0, 0, 0}).empty());
  grid.build({V3f(0, 0, 0)}, 1e-6, order);
  EXPECT_EQ(found(grid, order, {0, 0, 0}).size(), 1u);
  EXPECT_TRUE(found(grid, order, {1, 0, 0}).empty());
  // On corners of cells (2 radii wide) and at the very radius, both ways.
  grid.build({V3f(2, 2, 2), V3f(-2, -2, -2)}, 1, order);
  for (const float side : {-1.0f, 1.0f}) {
    EXPECT_EQ(found(grid, order, {2 + side, 2, 2}).size(), 1u);
    EXPECT_EQ(found(grid, order, {-2, -2 + side, -2}).size(), 1u);
  }
  EXPECT_TRUE(found(grid, order, {3.0001f, 2, 2}).empty());
}

}  // namespace
}  // namespace helio::test
