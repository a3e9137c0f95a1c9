#include "renderer/preview/view_mapping.h"

#include <gtest/gtest.h>

#include <vector>

#include "tests/support/random.h"
#include "tests/support/test_scenes.h"

namespace helio::test {
namespace {

constexpr int kWidth = 1280, kHeight = 720;

CameraPose orthographic(CameraPose pose, double half_height) {
  pose.projection = Projection::orthographic;
  pose.half_height = half_height;
  return pose;
}

ViewMapping::Point map(const ViewMapping& mapping, float x, float y, float depth) {
  ViewMapping::Point to;
  mapping.map_row(x, y, 1, &depth, &to.x, &to.y, &to.depth);
  return to;
}

// Film points of `to` for pixels of `from`, by the mapping and through world space in double.
void expect_mapped(const CameraPose& from, const CameraPose& to, const V3d& origin, double nearest, double farthest) {
  const CameraProjection here(from, kWidth, kHeight, origin), there(to, kWidth, kHeight, origin);
  const ViewMapping mapping(here, there);
  Random random(5);
  int seen = 0;
  for (int i = 0; i < 2000; ++i) {
    const double x = random.next_double() * kWidth, y = random.next_double() * kHeight;
    const double depth = nearest + (farthest - nearest) * random.next_double();
    const FilmPoint expected = there.point(here.position_at(x, y, depth));
    const ViewMapping::Point at = map(mapping, float(x), float(y), float(depth));
    ASSERT_EQ(at.depth > 0, expected.in_front) << x << ' ' << y << ' ' << depth;
    if (!expected.in_front || std::abs(expected.x) > 1e4 || std::abs(expected.y) > 1e4) continue;
    ++seen;
    EXPECT_NEAR(at.x, expected.x, 0.01) << x << ' ' << y << ' ' << depth;
    EXPECT_NEAR(at.y, expected.y, 0.01) << x << ' ' << y << ' ' << depth;
  }
  EXPECT_GT(seen, 500);
}

TEST(ViewMapping, AgreesWithProjectionThroughWorldSpace) {
  const V3d origin(1, 2, 3);
  const CameraPose a = camera_at({0, 1, 5}, {0, 0.5, 0}, 50), b = camera_at({0.5, 1.2, 4.5}, {0.3, 0.4, 0}, 40);
  expect_mapped(a, a, origin, 1, 20);
  expect_mapped(a, b, origin, 1, 20);
  expect_mapped(orthographic(a, 2), orthographic(b, 3), origin, 1, 20);
  expect_mapped(orthographic(a, 2), b, origin, 1, 20);
  expect_mapped(a, orthographic(b, 3), origin, 1, 20);
}

TEST(ViewMapping, HoldsFarFromTheWorldsOriginAndAtWideAngles) {
  const V3d far(1e7, -1e7, 1e7);
  const CameraPose a = camera_at(far + V3d(0, 1, 5), far, 50), b = camera_at(far + V3d(0.1, 1, 5), far, 50);
  expect_mapped(a, b, far, 1, 20);
  CameraPose wide = camera_at({0, 1, 5}, {0, 0.5, 0}, 179), wider = wide;
  wider.position.x += 0.1;
  expect_mapped(wide, wider, V3d(0, 0, 0), 1, 20);
}

TEST(ViewMapping, ARowIsItsPixels) {
  const V3d origin(1, 2, 3);
  CameraPose flat = orthographic(camera_at({0.5, 1.2, 4.5}, {0.3, 0.4, 0}, 40), 3);
  const CameraPose round = camera_at({0, 1, 5}, {0, 0.5, 0}, 50);
  for (const CameraPose& from : {round, flat}) {
    for (const CameraPose& to : {flat, round}) {
      const ViewMapping mapping(CameraProjection(from, kWidth, kHeight, origin),
                                CameraProjection(to, kWidth, kHeight, origin));
      float depth[5] = {1, 2, 3.5f, 7, 40}, x[5], y[5], z[5];
      mapping.map_row(100.5f, 77.5f, 5, depth, x, y, z);
      for (int i = 0; i < 5; ++i) {
        const ViewMapping::Point at = map(mapping, 100.5f + float(i), 77.5f, depth[i]);
        EXPECT_NEAR(x[i], at.x, 2e-3f);
        EXPECT_NEAR(y[i], at.y, 2e-3f);
        EXPECT_NEAR(z[i], at.depth, 1e-4f);
      }
    }
  }
}

TEST(ViewMapping, SaysWhatLiesBehindTheOtherView) {
  const CameraPose a = camera_at({0, 0, 5}, {0, 0, 0}, 50), b = camera_at({0, 0, -5}, {0, 0, -10}, 50);
  const CameraProjection here(a, kWidth, kHeight, V3d(0, 0, 0)), there(b, kWidth, kHeight, V3d(0, 0, 0));
  EXPECT_LE(map(ViewMapping(here, there), 640, 360, 2).depth, 0);
}

}  // namespace
}  // namespace helio::test
