#include "renderer/trace/paths/vertex_grid.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "tests/support/random.h"

namespace helio::test {
namespace {

// In chunks of so many points.
void build(VertexGrid& grid, const std::vector<V3f>& points, double radius, std::vector<std::uint32_t>& order,
           std::size_t chunk = 1000) {
  std::vector<std::uint32_t> sizes;
  for (std::size_t first = 0; first < points.size(); first += chunk)
    sizes.push_back(std::uint32_t(std::min(chunk, points.size() - first)));
  VertexGridBuilder builder(sizes, radius);
  // Last chunks first: nothing may depend on who is first.
  for (std::size_t c = builder.chunks(); c-- > 0;)
    builder.add(c, std::span(points).subspan(c * chunk, builder.chunk_size(c)));
  builder.finish_adding();
  for (std::size_t c = builder.chunks(); c-- > 0;) builder.distribute(c);
  for (std::size_t b = builder.buckets(); b-- > 0;) builder.sort(b);
  RawArray<std::uint32_t> places;
  builder.finish(grid, places);
  order.assign(places.data(), places.data() + places.size());
}

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
    build(grid, points, radius, order);
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
  build(grid, points, 0.5, order);
  std::vector<std::uint32_t> sorted = order;
  std::sort(sorted.begin(), sorted.end());
  for (std::uint32_t i = 0; i < sorted.size(); ++i) EXPECT_EQ(sorted[i], i);
  for (std::size_t i = 1; i < 100; ++i) EXPECT_EQ(order[i], order[i - 1] + 1);
  EXPECT_EQ(found(grid, order, points[0]).size(), 100u);
}

TEST(VertexGrid, ItsOrderDoesNotDependOnTheChunks) {
  Random random(5);
  std::vector<V3f> points;
  for (int i = 0; i < 20000; ++i)
    points.emplace_back(random.next_float(), random.next_float(), i % 3 == 0 ? 0.5f : random.next_float());
  VertexGrid grid;
  std::vector<std::uint32_t> whole, cut;
  for (const double radius : {0.004, 0.2}) {
    build(grid, points, radius, whole, points.size());
    for (const std::size_t chunk : {1u, 17u, 4096u}) {
      build(grid, points, radius, cut, chunk);
      EXPECT_EQ(cut, whole) << radius << " " << chunk;
    }
  }
}

// At the size of a pass: no bucket has much more than its share of the points.
TEST(VertexGrid, BucketsAreSmall) {
  constexpr std::uint32_t kPoints = 1u << 20, kChunks = 128;
  Random random(7);
  VertexGridBuilder builder(std::vector<std::uint32_t>(kChunks, kPoints / kChunks), 0.003);
  std::vector<V3f> floor(kPoints / kChunks);
  for (std::size_t c = 0; c < builder.chunks(); ++c) {
    for (V3f& p : floor) p = {random.next_float(), random.next_float(), 0.25f};
    builder.add(c, floor);
  }
  builder.finish_adding();
  std::size_t most = 0, all = 0;
  for (std::size_t b = 0; b < builder.buckets(); ++b) {
    most = std::max(most, builder.bucket_size(b));
    all += builder.bucket_size(b);
  }
  EXPECT_EQ(all, kPoints);
  EXPECT_LE(most, kPoints / 32);
}

TEST(VertexGrid, TakesNothingOnePointAndPointsOnBorders) {
  VertexGrid grid;
  std::vector<std::uint32_t> order;
  build(grid, {}, 1, order);
  EXPECT_TRUE(order.empty());
  EXPECT_TRUE(found(grid, order, {0, 0, 0}).empty());
  build(grid, {V3f(0, 0, 0)}, 1e-6, order);
  EXPECT_EQ(found(grid, order, {0, 0, 0}).size(), 1u);
  EXPECT_TRUE(found(grid, order, {1, 0, 0}).empty());
  // On corners of cells (2 radii wide) and at the very radius, both ways.
  build(grid, {V3f(2, 2, 2), V3f(-2, -2, -2)}, 1, order);
  for (const float side : {-1.0f, 1.0f}) {
    EXPECT_EQ(found(grid, order, {2 + side, 2, 2}).size(), 1u);
    EXPECT_EQ(found(grid, order, {-2, -2 + side, -2}).size(), 1u);
  }
  EXPECT_TRUE(found(grid, order, {3.0001f, 2, 2}).empty());
}

}  // namespace
}  // namespace helio::test
