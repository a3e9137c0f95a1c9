#include "renderer/trace/accel/edge_dilation.h"

#include <gtest/gtest.h>

#include "tests/support/random.h"

namespace helio::test {
namespace {

V3f random_point(Random& random) {
  const float x = random.next_float(), y = random.next_float(), z = random.next_float();
  return {2 * x - 1, 2 * y - 1, 2 * z - 1};
}

// How far `p` lies outside of side k of the triangle, in its plane.
double outside(const V3f (&t)[3], int k, const V3f& p) {
  const V3d a(t[k]), side = V3d(t[(k + 1) % 3]) - a;
  const V3d normal = cross(V3d(t[1]) - V3d(t[0]), V3d(t[2]) - V3d(t[0]));
  return dot(normalize(cross(side, normal)), V3d(p) - a);
}

TEST(EdgeDilation, MovesEverySideOutwardsByTheMargin) {
  Random random(11);
  constexpr double kMargin = 1e-3;
  int thin = 0;
  for (int i = 0; i < 20000; ++i) {
    V3f narrow[3] = {random_point(random), random_point(random), random_point(random)};
    if (i % 2 == 0) narrow[2] = narrow[0] + (narrow[1] - narrow[0]) * 0.5f + (narrow[2] - narrow[0]) * 0.01f;
    V3f wide[3] = {narrow[0], narrow[1], narrow[2]};
    widen_triangle(wide, kMargin);
    if (wide[0] == narrow[0]) {
      ++thin;  // the middle of the longest side is within half a margin of everything
      continue;
    }
    for (int k = 0; k < 3; ++k) {
      const double error = 1e-6 / std::max(1e-3, std::abs(outside(narrow, k, narrow[(k + 2) % 3])));
      EXPECT_NEAR(outside(narrow, k, wide[k]), kMargin, error);
      EXPECT_NEAR(outside(narrow, k, wide[(k + 1) % 3]), kMargin, error);
    }
  }
  EXPECT_LT(thin, 200);
}

TEST(EdgeDilation, LeavesTrianglesWithoutAreaAlone) {
  const V3f cases[][3] = {{{1, 2, 3}, {1, 2, 3}, {1, 2, 3}},
                          {{0, 0, 0}, {1, 1, 1}, {2, 2, 2}},
                          {{0, 0, 0}, {1, 0, 0}, {0.5f, 1e-7f, 0}},
                          {{0, 0, 0}, {1e-38f, 0, 0}, {0, 1e-38f, 0}},
                          {{1e18f, 0, 0}, {1e18f, 0, 0}, {0, 1e18f, 0}}};
  for (const auto& flat : cases) {
    V3f t[3] = {flat[0], flat[1], flat[2]};
    widen_triangle(t, 1e-5);
    for (int k = 0; k < 3; ++k) EXPECT_EQ(t[k], flat[k]);
  }
}

TEST(EdgeDilation, ShareIsWhatTheTrianglesGainInArea) {
  TriangleMesh mesh;
  mesh.positions = {{0, 0, 0}, {3, 0, 0}, {0, 4, 0}, {7, 7, 7}};
  mesh.indices = {0, 1, 2, 3, 3, 3};
  // Inradius 1: widened by 0.1 it grows by 1.1 squared.
  EXPECT_NEAR(edge_dilation_share(mesh, 0.1), 0.21, 1e-6);
  mesh.indices = {3, 3, 3};
  EXPECT_EQ(edge_dilation_share(mesh, 0.1), 0);
  mesh.indices = {};
  EXPECT_EQ(edge_dilation_share(mesh, 0.1), 0);
}

TEST(EdgeDilation, PutsTheLongestSideLastAndKeepsTheWinding) {
  Random random(5);
  TriangleMesh mesh;
  for (int i = 0; i < 3000; ++i) {
    mesh.positions.push_back(random_point(random));
    mesh.indices.push_back(std::uint32_t(i));
  }
  const TriangleMesh before = mesh;
  put_longest_side_last(mesh);
  for (std::size_t t = 0; t < mesh.triangle_count(); ++t) {
    const std::uint32_t* i = &mesh.indices[3 * t];
    const V3f p[3] = {mesh.positions[i[0]], mesh.positions[i[1]], mesh.positions[i[2]]};
    EXPECT_GE(length(p[2] - p[1]), std::max(length(p[1] - p[0]), length(p[0] - p[2])) * 0.999999f);
    const std::uint32_t* j = &before.indices[3 * t];
    const bool turned = (i[0] == j[0] && i[1] == j[1] && i[2] == j[2]) ||
                        (i[0] == j[1] && i[1] == j[2] && i[2] == j[0]) ||
                        (i[0] == j[2] && i[1] == j[0] && i[2] == j[1]);
    EXPECT_TRUE(turned) << t;
  }
}

}  // namespace
}  // namespace helio::test
