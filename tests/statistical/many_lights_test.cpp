// Pictures of scenes with so many lights that the light tree selects them, against paths that sample no light at all.
#include <gtest/gtest.h>

#include "tests/bench/scenes/lamp_hall.h"
#include "tests/statistical/bsdf_only_tracer.h"
#include "tests/statistical/estimates.h"
#include "tests/support/random.h"
#include "tests/support/test_scenes.h"

namespace helio::test {
namespace {

constexpr int kWidth = 64, kHeight = 36;

// `samples`: a pixel of paths without light samples. They find light by luck, so that their pixels are far from normal
// and tiles alone are tested.
void expect_same_mean(SceneDescription description, std::size_t least_lights, std::uint32_t samples) {
  const CameraPose pose = camera_pose(description.cameras.at(0));
  const auto scene = build(std::move(description));
  ASSERT_TRUE(scene);
  ASSERT_TRUE(scene->features().light_tree);
  ASSERT_GE(scene->features().light_count, least_lights);
  PathSettings path;
  path.max_segments = 4;
  path.seed = 1;
  const Estimate sampled = estimate_of(render(*scene, pose, kWidth, kHeight, 128, path));
  BsdfOnlySettings settings;
  settings.max_segments = path.max_segments;
  settings.samples = samples;
  settings.seed = 2;
  const ZTestResult result = z_test(sampled, trace_bsdf_only(*scene, pose, kWidth, kHeight, settings));
  EXPECT_LE(result.worst_tile, 1) << result.to_string();
}

TEST(ManyLights, HallOfTenThousandLamps) {
  expect_same_mean(bench::lamp_hall(10000), 10000, 1024);
}

// A ceiling of 32 x 32 quads with one texture, whose texels are black but for one in 32. Most quads give no light and
// are none; the others give it from a part of theirs.
TEST(ManyLights, MostlyBlackTexture) {
  constexpr int kTexels = 64, kQuads = 32;
  SceneDescription scene;
  Image image;
  image.width = image.height = kTexels;
  image.channels = 3;
  image.texels.assign(3 * kTexels * kTexels, 0);
  Random random(3);
  for (int lit = 0; lit < kTexels * kTexels / 32; ++lit) {
    const std::size_t texel = random.next_u32() % (kTexels * kTexels);
    for (std::size_t c = 0; c < 3; ++c) image.texels[3 * texel + c] = std::uint8_t(255 - 60 * c);
  }
  scene.images = {image};
  Material sign = lambert(Rgb(0, 0, 0), Rgb(40));
  sign.emission_texture.image = 0;
  scene.materials = {lambert(Rgb(0.5f, 0.6f, 0.7f)), sign};
  TriangleMesh ceiling;
  for (int y = 0; y <= kQuads; ++y) {
    for (int x = 0; x <= kQuads; ++x) {
      const V2f uv(float(x) / kQuads, float(y) / kQuads);
      ceiling.positions.emplace_back(4 * uv.x - 2, 2, 4 * uv.y - 2);
      ceiling.texcoords[0].push_back(uv);
    }
  }
  for (int y = 0; y < kQuads; ++y) {
    for (int x = 0; x < kQuads; ++x) {
      const auto corner = std::uint32_t(y * (kQuads + 1) + x), below = corner + kQuads + 1;
      for (const std::uint32_t i : {corner, corner + 1, below + 1, corner, below + 1, below})
        ceiling.indices.push_back(i);
    }
  }
  ceiling.material = 1;
  add_mesh(scene, std::move(ceiling));
  add_mesh(scene, quad({-2, 0, 2}, {4, 0, 0}, {0, 0, -4}, 0));
  add_mesh(scene, quad({-2, 0, -2}, {4, 0, 0}, {0, 2, 0}, 0));
  add_mesh(scene, box({-0.5f, 0, -0.5f}, {0.3f, 1.6f, 0.2f}, 0));
  CameraDescription camera;
  camera.vertical_fov = 0.6;
  camera.to_world[3][1] = 1;
  camera.to_world[3][2] = 5;
  scene.cameras = {camera};
  expect_same_mean(std::move(scene), 50, 4096);
}

}  // namespace
}  // namespace helio::test
