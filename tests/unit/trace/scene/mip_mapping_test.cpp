// Mip-mapped textures: the level follows the path's footprint, and pictures keep their brightness.
#include <gtest/gtest.h>

#include "tests/support/test_scenes.h"

namespace helio::test {
namespace {

// Squares of `side` texels, black and white in turn.
Image checkerboard(int size, int side) {
  Image image;
  image.width = image.height = size;
  image.channels = 1;
  for (int y = 0; y < size; ++y) {
    for (int x = 0; x < size; ++x) image.texels.push_back((x / side + y / side) % 2 == 0 ? 255 : 0);
  }
  return image;
}

Material textured() {
  Material m = lambert(Rgb(1, 1, 1));
  m.base_color_texture.image = 0;
  return m;
}

RenderSceneOptions mip() {
  RenderSceneOptions options;
  options.texture_filter = TextureFilter::mip;
  return options;
}

// 512 texels over 8 units, seen by pixels of 1 / 4 unit from straight above: 16 texels a pixel, level 4. Squares of one
// texel are grey there, squares of 64 keep their colours; without mip-mapping single samples are black or white. The
// floor is placed once and then twice, half as large with twice the scale, so that it is an instance.
TEST(MipMapping, LevelIsThatOfThePixel) {
  for (const bool instanced : {false, true}) {
    for (const int side : {1, 64}) {
      for (const bool filtered : {false, true}) {
        SceneDescription scene;
        scene.materials = {textured()};
        scene.images = {checkerboard(512, side)};
        const float half = instanced ? 2.0f : 4.0f;
        Object floor;
        floor.meshes.push_back(quad({-half, 0, half}, {2 * half, 0, 0}, {0, 0, -2 * half}, 0));
        const int index = add_object(scene, floor);
        M44d m;
        if (instanced) m[0][0] = m[1][1] = m[2][2] = 2;
        add_instance(scene, index, m);
        m[3][1] = -50;
        if (instanced) add_instance(scene, index, m);
        CameraPose pose = camera_at({0, 5, 0}, {0, 0, 0});
        pose.projection = Projection::orthographic;
        pose.half_height = 4;
        const Film film = render(*build(scene, filtered ? mip() : RenderSceneOptions()), pose, 32, 32, 1);
        int extremes = 0;
        float low = 1, high = 0;
        for (int y = 0; y < 32; ++y) {
          for (int x = 0; x < 32; ++x) {
            const float albedo = film.features(x, y).albedo[0];
            low = std::min(low, albedo);
            high = std::max(high, albedo);
            extremes += albedo < 0.05f || albedo > 0.95f;
          }
        }
        if (side == 1) {
          EXPECT_NEAR(high - low, filtered ? 0 : 0.9, filtered ? 1e-3 : 0.1);
          if (filtered) {
            EXPECT_NEAR(high, 0.5f, 1e-3f);
          }
        } else {
          EXPECT_GE(extremes, filtered ? 200 : 900);  // squares are four pixels wide: the inner ones are pure
        }
      }
    }
  }
}

// A room of fine texture in which light bounces: what mip-mapping does to the brightness stays below 1 %, and where the
// room is seen through a mirror as well.
TEST(MipMapping, KeepsTheBrightnessOfARoom) {
  for (const bool mirror : {false, true}) {
    V3d means[2];
    for (const bool filtered : {false, true}) {
      SceneDescription scene;
      scene.materials = {textured(), lambert(Rgb(0, 0, 0), Rgb(8, 8, 8)), Material()};
      scene.materials[2].base_color = Rgb(0.9f, 0.9f, 0.9f);
      scene.materials[2].metallic = 1;
      scene.materials[2].roughness = 0.2f;
      scene.images = {checkerboard(256, 1)};
      add_mesh(scene, quad({-2, 0, 2}, {4, 0, 0}, {0, 0, -4}, 0));
      add_mesh(scene, quad({-2, 0, -2}, {4, 0, 0}, {0, 3, 0}, mirror ? 2 : 0));
      add_mesh(scene, quad({-2, 3, -2}, {4, 0, 0}, {0, 0, 4}, 0));
      add_mesh(scene, quad({-0.5f, 2.9f, -0.5f}, {1, 0, 0}, {0, 0, 1}, 1));
      const Film film = render(*build(scene, filtered ? mip() : RenderSceneOptions()),
                               camera_at({0, 1.5, 4}, {0, 1, 0}, 40), 32, 32, 128);
      means[filtered] = mean_of(film).mean;
    }
    EXPECT_NEAR(means[1].x, means[0].x, 0.01 * means[0].x) << (mirror ? "with" : "without") << " a mirror";
    EXPECT_NE(means[1].x, means[0].x);
  }
}

}  // namespace
}  // namespace helio::test
