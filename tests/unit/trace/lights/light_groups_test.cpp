// Which emissive triangles become one light.
#include "renderer/trace/lights/light_groups.h"

#include <gtest/gtest.h>

#include "tests/unit/trace/lights/light_test_scenes.h"

namespace helio {
namespace {

using test::add_quad;
using test::triangle_emitter;

TEST(LightGroups, TwoHalvesOfAParallelogramAreOneLight) {
  const V3f corners[4] = {
      {0.213f, 0.5488f, 0.227f}, {0.343f, 0.5488f, 0.227f}, {0.343f, 0.5488f, 0.332f}, {0.213f, 0.5488f, 0.332f}};
  // Every way to write the second half, and both diagonals.
  const int halves[][6] = {{0, 1, 2, 0, 2, 3}, {0, 1, 2, 2, 3, 0}, {0, 1, 2, 3, 0, 2},
                           {1, 2, 3, 1, 3, 0}, {2, 0, 1, 0, 2, 3}, {1, 2, 3, 0, 1, 3}};
  for (const auto& h : halves) {
    const std::vector<AreaEmitter> emitters = {triangle_emitter(corners[h[0]], corners[h[1]], corners[h[2]], 17),
                                               triangle_emitter(corners[h[3]], corners[h[4]], corners[h[5]], 17)};
    const AreaLights lights = group_area_emitters(emitters);
    ASSERT_EQ(lights.lights.size(), 1u);
    EXPECT_EQ(lights.light_of_emitter, (std::vector<std::uint32_t>{0, 0}));
    EXPECT_EQ(lights.lights[0].shape.kind, ShapeKind::parallelogram);
    EXPECT_NEAR(lights.lights[0].shape.area, 0.13 * 0.105, 1e-6);
    EXPECT_GT(lights.lights[0].shape.near_squared, 0);  // recognised as a rectangle
  }
}

TEST(LightGroups, WhatIsNoParallelogramStaysApart) {
  const auto count = [](const AreaEmitter& a, const AreaEmitter& b) {
    return group_area_emitters({a, b}).lights.size();
  };
  const AreaEmitter a = triangle_emitter({0, 0, 0}, {1, 0, 0}, {1, 1, 0}, 5);
  const AreaEmitter b = triangle_emitter({0, 0, 0}, {1, 1, 0}, {0, 1, 0}, 5);
  EXPECT_EQ(count(a, b), 1u);
  EXPECT_EQ(count(a, triangle_emitter({0, 0, 0}, {1, 1, 0}, {0, 1, 0}, 6)), 2u) << "another radiance";
  EXPECT_EQ(count(a, triangle_emitter({0, 0, 0}, {1, 1, 0}, {0, 1, 0}, 5, true)), 2u) << "two-sided";
  EXPECT_EQ(count(a, triangle_emitter({0, 0, 0}, {0, 1, 0}, {1, 1, 0}, 5)), 2u) << "facing the other way";
  EXPECT_EQ(count(a, triangle_emitter({0, 0, 0}, {1, 1, 0}, {0, 1.1f, 0}, 5)), 2u) << "a trapezium";
  EXPECT_EQ(count(a, triangle_emitter({0, 0, 0}, {1, 1, 0}, {0, 1, 0.1f}, 5)), 2u) << "folded";
  EXPECT_EQ(count(a, triangle_emitter({0, 0, 0}, {1, 0, 0}, {1, 1, 0}, 5)), 2u) << "coincident";
  EXPECT_EQ(count(a, triangle_emitter({0, 0, 1}, {1, 1, 1}, {0, 1, 1}, 5)), 2u) << "parallel planes";
}

TEST(LightGroups, TexturesMustContinueAcrossTheDiagonal) {
  AreaEmitter a = triangle_emitter({0, 0, 0}, {1, 0, 0}, {1, 1, 0}, 5);
  AreaEmitter b = triangle_emitter({0, 0, 0}, {1, 1, 0}, {0, 1, 0}, 5);
  a.texture.image = b.texture.image = 0;
  a.uv[0] = V2f(0, 1);
  a.uv[1] = V2f(0.5f, 1);
  a.uv[2] = V2f(0.5f, 0);
  b.uv[0] = V2f(0, 1);
  b.uv[1] = V2f(0.5f, 0);
  b.uv[2] = V2f(0, 0);
  const AreaLights joined = group_area_emitters({a, b});
  ASSERT_EQ(joined.lights.size(), 1u);
  // Texture coordinates of the light's points are those of the triangles' corners.
  const AreaLight& light = joined.lights[0];
  for (const V2f& st : {V2f(0, 0), V2f(1, 0), V2f(0, 1), V2f(1, 1), V2f(0.25f, 0.5f)}) {
    const V3f p = light.shape.p0 + light.shape.e1 * st.x + light.shape.e2 * st.y;
    const V2f uv = light.uv + light.uv_s * st.x + light.uv_t * st.y;
    EXPECT_NEAR(uv.x, 0.5f * p.x, 1e-6);
    EXPECT_NEAR(uv.y, 1 - p.y, 1e-6);
  }
  b.uv[2] = V2f(0.25f, 0);
  EXPECT_EQ(group_area_emitters({a, b}).lights.size(), 2u);
}

TEST(LightGroups, BlackAndDegenerateEmittersAreNoLights) {
  std::vector<AreaEmitter> emitters = {triangle_emitter({0, 0, 0}, {1, 0, 0}, {1, 1, 0}, 0),
                                       triangle_emitter({0, 0, 0}, {1, 0, 0}, {0, 1, 0}, 1),
                                       triangle_emitter({0, 0, 0}, {1, 0, 0}, {2, 0, 0}, 1),
                                       test::sphere_emitter({0, 0, 0}, 0, 1), test::sphere_emitter({0, 0, 0}, 2, 1)};
  emitters[2].normal = V3f(0, 0, 1);
  const AreaLights lights = group_area_emitters(emitters);
  EXPECT_EQ(lights.light_of_emitter, (std::vector<std::uint32_t>{kNoLight, 0, kNoLight, kNoLight, 1}));
}

// A tessellated panel: pairs wherever they come in file order.
TEST(LightGroups, PairsAreFoundInAGrid) {
  std::vector<AreaEmitter> emitters;
  for (int y = 0; y < 10; ++y) {
    for (int x = 0; x < 10; ++x) add_quad(emitters, V3f(float(x), float(y), 3) * 0.1f, {0.1f, 0, 0}, {0, 0.1f, 0}, 2);
  }
  const AreaLights lights = group_area_emitters(emitters);
  EXPECT_EQ(lights.lights.size(), 100u);
  double area = 0;
  for (const AreaLight& light : lights.lights) area += light.shape.area;
  EXPECT_NEAR(area, 1, 1e-5);
}

}  // namespace
}  // namespace helio
