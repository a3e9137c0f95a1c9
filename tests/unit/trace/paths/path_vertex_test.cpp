// Vertices of paths scatter as points do that are made anew for each direction.
#include "renderer/trace/paths/path_vertex.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "renderer/trace/paths/point_store.h"
#include "renderer/trace/scene/render_scene.h"
#include "tests/support/bumpy_ball.h"

namespace helio::test {
namespace {

V3f any_direction(Random& random) {
  const float z = 2 * random.next_float() - 1, phi = kTwoPi * random.next_float(), r = safe_sqrt(1 - z * z);
  return {r * std::cos(phi), r * std::sin(phi), z};
}

// A ball whose vertex normals lean up to 30 degrees away from its centre, so that views along the surface bend them.
// `inside`: its triangles face inwards.
std::shared_ptr<const RenderScene> ball_of(const Material& material, bool inside) {
  TriangleMesh mesh = bumpy_ball({0, 0, 0}, 1, 8, 0.1f, inside, 3);
  Random random(4);
  for (const V3f& p : mesh.positions) mesh.normals.push_back(normalize(normalize(p) * 2.0f + any_direction(random)));
  SceneDescription scene;
  scene.materials = {material};
  add_mesh(scene, mesh);
  return build(scene);
}

BsdfValue made_anew(const SceneData& scene, const PathVertex& vertex, const V3f& to_camera, const V3f& to_light) {
  Surface seen = vertex.surface;
  seen.front = dot(seen.geometric_normal, to_camera) >= 0;
  return ShadingPoint(scene, vertex.hit, seen, to_camera, 0).evaluate(to_camera, to_light);
}

void expect_same(const BsdfValue& value, const BsdfValue& expected, int& bright) {
  for (int c = 0; c < 3; ++c) EXPECT_NEAR(value.f_cos[c], expected.f_cos[c], 2e-6f * expected.f_cos[c]);
  EXPECT_NEAR(value.pdf_w, expected.pdf_w, 2e-6f * expected.pdf_w);
  bright += expected.f_cos.x > 0;
}

struct Counts {
  int bright = 0, black = 0;
};

void expect_made_anew(const Material& material, bool inside, Counts& counts) {
  const auto scene = ball_of(material, inside);
  const SceneData& data = scene->impl();
  Random random(5);
  for (int i = 0; i < 2000; ++i) {
    const V3f from = any_direction(random), towards = normalize(any_direction(random) * 0.9f - from * 3.0f);
    const Ray ray{from * 3.0f, std::numeric_limits<float>::infinity(), towards, 0};
    const std::uint32_t first = 0;
    Hit hit;
    data.accel->intersect(&ray, &first, 1, &hit, RayOrder::scattered);
    if (!hit.valid()) continue;
    const PathVertex vertex(data, ray, hit, nullptr);
    const V3f wo = -towards;
    Late<ShadingPoint> point;
    if (vertex.keeps_its_point()) vertex.look_from(data, wo, point);
    for (int k = 0; k < 10; ++k) {
      const V3f other = any_direction(random);
      const BsdfValue there = made_anew(data, vertex, wo, other), back = made_anew(data, vertex, other, wo);
      for (const ShadingPoint* at_hand : {point.get(), static_cast<const ShadingPoint*>(nullptr)}) {
        const BsdfBothWays both = vertex.scatter_both_ways(data, wo, other, at_hand);
        expect_same(both.there, there, counts.bright);
        expect_same(both.back, back, counts.bright);
        expect_same(vertex.scatter(data, other, wo, at_hand, wo), back, counts.bright);
      }
      if (vertex.may_scatter(wo, other)) continue;
      EXPECT_TRUE(is_black(there.f_cos) && is_black(back.f_cos));
      ++counts.black;
    }
  }
}

// Its front looked at, and its back.
void expect_made_anew(const Material& material) {
  Counts front, back;
  expect_made_anew(material, false, front);
  expect_made_anew(material, true, back);
  EXPECT_GT(front.bright, 10000);
  EXPECT_EQ(back.bright > 10000, !material.one_sided);
  for (const int black : {front.black, back.black}) EXPECT_EQ(black > 1000, material.transmission == 0);
}

TEST(PathVertex, OfLambertScattersByItsNormalAlone) {
  Material material = lambert(Rgb(0.8f, 0.5f, 0.3f));
  expect_made_anew(material);
  material.one_sided = true;
  expect_made_anew(material);
}

TEST(PathVertex, OfOtherMaterialsScattersAsItsPointDoes) {
  Material material;
  material.base_color = Rgb(0.8f, 0.5f, 0.3f);
  material.roughness = 0.5f;
  expect_made_anew(material);
  material.metallic = 0.5f;
  expect_made_anew(material);
  material.layers.clearcoat = 1;
  expect_made_anew(material);
  material.layers.clearcoat = 0;
  material.transmission = 0.7f;
  expect_made_anew(material);
  material.thickness = 1;
  expect_made_anew(material);
}

TEST(PointStore, KeepsWhatItHasRoomFor) {
  PointStore store;
  const auto scene = ball_of(Material(), false);
  const Ray ray{V3f(0, 0, 3), std::numeric_limits<float>::infinity(), V3f(0, 0, -1), 0};
  const std::uint32_t first = 0;
  Hit hit;
  scene->impl().accel->intersect(&ray, &first, 1, &hit, RayOrder::scattered);
  const PathVertex vertex(scene->impl(), ray, hit, nullptr);
  const auto make = [&](std::size_t number) {
    return &vertex.look_from(scene->impl(), V3f(0, 0, 1), store.room(number));
  };
  const ShadingPoint* const early = make(0);
  const ShadingPoint* const last = make(PointStore::kMost - 1);
  make(PointStore::kMost);
  make(PointStore::kMost + 1);
  EXPECT_EQ(store.at(0), early);  // it stays where it is while room is added
  EXPECT_EQ(store.at(PointStore::kMost - 1), last);
  EXPECT_EQ(store.at(PointStore::kMost), nullptr);
  EXPECT_EQ(store.at(PointStore::kMost + 1), nullptr);
  store.room(0);
  EXPECT_EQ(store.at(0), nullptr);
}

}  // namespace
}  // namespace helio::test
