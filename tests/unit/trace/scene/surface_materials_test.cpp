// Materials at a hit, seen through what the film keeps of it: bump maps, blends, opacity, directions on spheres.
#include <gtest/gtest.h>

#include <cstring>

#include "tests/support/test_scenes.h"

namespace helio::test {
namespace {

// Bilinear between texels, repeated at the edges.
int add_image(SceneDescription& scene, int width, int height, const std::vector<V4f>& texels) {
  Image image;
  image.name = "image";
  image.width = width;
  image.height = height;
  image.channels = 4;
  image.format = TexelFormat::f32;
  image.texels.resize(texels.size() * sizeof(V4f));
  std::memcpy(image.texels.data(), texels.data(), image.texels.size());
  scene.images.push_back(std::move(image));
  return int(scene.images.size()) - 1;
}

// A 2 x 2 square in z = 0, u along x and v along y, seen from z = 3.
SceneDescription square_of(const Material& material) {
  SceneDescription scene;
  scene.materials.push_back(material);
  add_mesh(scene, quad(V3f(-1, -1, 0), V3f(2, 0, 0), V3f(0, 2, 0), 0));
  scene.environment = Environment{};
  return scene;
}

PixelFeatures features_of(SceneDescription scene, const V3d& from = V3d(0, 0, 3)) {
  const auto built = build(std::move(scene));
  if (!built) return {};
  // A narrow view of the middle: no perspective to speak of.
  const Film film = render(*built, camera_at(from, V3d(0, 0, 0), 0.2), 1, 1, 1);
  return film.features(0, 0);
}

// A ramp of 1 over 8 texels, u over 2 units: h = 4 u between texels 3 and 5 of 8 with steps of 0.5, so dh/dx = 0.5 x 8
// / 2 = 2 times the scale. n ~ (-2 s, 0, 1).
TEST(BumpMap, TiltsTheNormalAgainstTheSlope) {
  for (const float scale : {0.1f, -0.25f}) {
    for (const bool along_v : {false, true}) {
      Material m = lambert(Rgb(0.5f));
      SceneDescription scene;
      std::vector<V4f> texels;
      for (int i = 0; i < 8; ++i) texels.push_back(V4f(0.5f * i, 0.5f * i, 0.5f * i, 1));
      m.bump_texture.image = 0;
      m.bump_scale = scale;
      scene = square_of(m);
      add_image(scene, along_v ? 1 : 8, along_v ? 8 : 1, texels);
      const PixelFeatures f = features_of(std::move(scene));
      const double slope = 2 * scale, length = std::sqrt(1 + slope * slope);
      EXPECT_NEAR(f.normal[along_v ? 1 : 0], -slope / length, 5e-3) << scale;
      EXPECT_NEAR(f.normal[along_v ? 0 : 1], 0, 1e-4);
      EXPECT_NEAR(f.normal[2], 1 / length, 5e-3);
    }
  }
}

// u' = v and v' a constant: what rises along the picture rises along v.
TEST(BumpMap, SlopesTurnWithThePicture) {
  Material m = lambert(Rgb(0.5f));
  m.bump_texture.image = 0;
  m.bump_texture.uv_transform = {0, 1, 0, 0, 0, 0.5f};
  m.bump_scale = 0.1f;
  std::vector<V4f> texels;
  for (int i = 0; i < 8; ++i) texels.push_back(V4f(0.5f * i, 0.5f * i, 0.5f * i, 1));
  SceneDescription scene = square_of(m);
  add_image(scene, 8, 1, texels);
  const PixelFeatures f = features_of(std::move(scene));
  EXPECT_NEAR(f.normal[0], 0, 1e-4);
  EXPECT_NEAR(f.normal[1], -0.2 / std::sqrt(1.04), 5e-3);
}

// The texel's red is along u, its green along v. From behind, the normal is mirrored in the surface where that is asked
// for, and turned around otherwise.
TEST(NormalMap, IsInTheFrameOfTheTexture) {
  for (const bool mirrored : {false, true}) {
    Material m = lambert(Rgb(0.5f));
    m.normal_texture.image = 0;
    m.map_rule = MapRule::own_frame;
    m.map_mirrored = mirrored;
    const auto seen_from = [&](double z) {
      SceneDescription scene = square_of(m);
      add_image(scene, 1, 1, {V4f(0.8f, 0.62f, 0.884f, 1)});  // 0.6, 0.24, 0.768
      return features_of(std::move(scene), V3d(0, 0, z));
    };
    const PixelFeatures from_front = seen_from(3), from_behind = seen_from(-3);
    const auto &front = from_front.normal, &back = from_behind.normal;
    constexpr double kLength = 1.0037;
    EXPECT_NEAR(front[0], 0.6 / kLength, 2e-3);
    EXPECT_NEAR(front[1], 0.24 / kLength, 2e-3);
    EXPECT_NEAR(front[2], 0.768 / kLength, 2e-3);
    EXPECT_NEAR(back[0], mirrored ? front[0] : -front[0], 2e-3) << mirrored;
    EXPECT_NEAR(back[1], mirrored ? front[1] : -front[1], 2e-3) << mirrored;
    EXPECT_NEAR(back[2], -front[2], 2e-3) << mirrored;
  }
}

TEST(BumpMap, FlatHeightsChangeNothing) {
  Material m = lambert(Rgb(0.5f));
  m.bump_texture.image = 0;
  m.bump_scale = 1e9f;
  SceneDescription scene = square_of(m);
  add_image(scene, 2, 2, std::vector<V4f>(4, V4f(0.25f, 0.25f, 0.25f, 1)));
  EXPECT_NEAR(features_of(std::move(scene)).normal[2], 1, 1e-6);
}

SceneDescription blend_square(const BlendMaterial& blend) {
  Material m;
  m.model = MaterialModel::blend;
  m.blend = blend;
  m.blend.first = 1;
  m.blend.second = 2;
  SceneDescription scene = square_of(m);
  scene.materials.push_back(lambert(Rgb(0.2f, 0.4f, 0.8f)));
  scene.materials.push_back(lambert(Rgb(0.6f, 0.8f, 0)));
  return scene;
}

TEST(BlendAtAHit, AlbedoIsTheWeightedMean) {
  BlendMaterial blend;
  blend.weight = 0.25f;
  const PixelFeatures f = features_of(blend_square(blend));
  EXPECT_NEAR(f.albedo[0], 0.3, 1e-6);
  EXPECT_NEAR(f.albedo[1], 0.5, 1e-6);
  EXPECT_NEAR(f.albedo[2], 0.6, 1e-6);
}

TEST(BlendAtAHit, WeightMayBeATexture) {
  BlendMaterial blend;
  blend.weight = 1;
  blend.weight_texture.image = 0;
  SceneDescription scene = blend_square(blend);
  add_image(scene, 1, 1, {V4f(0.75f, 0.75f, 0.75f, 1)});
  EXPECT_NEAR(features_of(std::move(scene)).albedo[0], 0.5, 1e-5);
}

TEST(BlendAtAHit, SidesHaveTheirOwnMaterial) {
  BlendMaterial blend;
  blend.by_side = true;
  EXPECT_NEAR(features_of(blend_square(blend)).albedo[0], 0.2, 1e-6);
  EXPECT_NEAR(features_of(blend_square(blend), V3d(0, 0, -3)).albedo[0], 0.6, 1e-6);
}

// A part that is black from behind is so within a blend: half of the light of the other is left.
TEST(BlendAtAHit, OneSidedPartsAreBlackFromBehind) {
  BlendMaterial blend;
  SceneDescription scene = blend_square(blend);
  scene.materials[1].one_sided = true;
  EXPECT_NEAR(features_of(std::move(scene), V3d(0, 0, -3)).albedo[0], 0.3, 1e-6);
}

// The opacity's alpha counts, that of the colours does not.
TEST(Opacity, IsATextureOfItsOwn) {
  for (const float opacity : {0.0f, 1.0f}) {
    Material m = lambert(Rgb(1));
    m.alpha_mode = AlphaMode::blend;
    m.base_color_texture.image = 0;
    m.opacity_texture.image = 1;
    SceneDescription scene = square_of(m);
    add_image(scene, 1, 1, {V4f(0.5f, 0.5f, 0.5f, 0.5f)});
    add_image(scene, 1, 1, {V4f(1, 1, 1, opacity)});
    EXPECT_NEAR(features_of(std::move(scene)).albedo[0], 0.5 * opacity, 1e-6);
  }
}

}  // namespace
}  // namespace helio::test
