// Shading normals are bent for reflection no farther than needed, and only where it is.
#include <gtest/gtest.h>

#include "renderer/trace/scene/surface.h"
#include "tests/support/random.h"

namespace helio {
namespace {

V3f above(test::Random& random) {
  const float z = std::max(random.next_float(), 1e-3f), phi = kTwoPi * random.next_float(), r = safe_sqrt(1 - z * z);
  return {r * std::cos(phi), r * std::sin(phi), z};
}

TEST(ShadingNormal, MirrorImagesRiseAboveTheSurface) {
  const V3f geometric(0, 0, 1);
  test::Random random(1);
  int bent = 0;
  for (int i = 0; i < 100000; ++i) {
    const V3f normal = above(random), wo = above(random);
    const V3f n = bend_for_reflection(normal, geometric, wo);
    const auto mirrored_z = [&](const V3f& m) { return 2 * dot(m, wo) * m.z - wo.z; };
    const float least = std::min(0.9f * wo.z, 0.01f);
    ASSERT_NEAR(length(n), 1, 1e-5f);
    ASSERT_GT(dot(n, wo), 0) << normal << wo;
    if (mirrored_z(normal) >= least) {
      ASSERT_EQ(n, normal);
      continue;
    }
    ++bent;
    // Exactly to the least height, in the plane of both normals, between them.
    ASSERT_NEAR(mirrored_z(n), least, 2e-5f) << normal << wo;
    ASSERT_NEAR(dot(cross(normal, geometric), n), 0, 1e-5f);
    ASSERT_GE(n.z, normal.z - 1e-5f);
  }
  EXPECT_GT(bent, 20000);
}

TEST(ShadingNormal, ViewsAlongTheSurfaceFallBackToIt) {
  const V3f geometric(0, 0, 1), normal(0.6f, 0, 0.8f);
  EXPECT_EQ(bend_for_reflection(normal, geometric, {-1, 0, 0}), geometric);
  EXPECT_EQ(bend_for_reflection(geometric, geometric, {1, 0, 0}), geometric);
}

}  // namespace
}  // namespace helio
