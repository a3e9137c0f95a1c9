// Scenes of hard case 4: lights that are far apart in brightness, close to a surface, or very small.
#pragma once

#include <cmath>
#include <cstring>
#include <vector>

#include "tests/support/test_scenes.h"

namespace helio::test {

// Two closed rooms whose walls emit 1e9 (around the origin) and 1e-6 (around x = 10) and reflect a half, both two units
// wide: three segments see 1.75 of that in either, whatever the other is.
inline SceneDescription bright_and_dim_room() {
  SceneDescription scene;
  scene.materials = {lambert(Rgb(0.5f, 0.5f, 0.5f), Rgb(1e9f, 1e9f, 1e9f)),
                     lambert(Rgb(0.5f, 0.5f, 0.5f), Rgb(1e-6f, 1e-6f, 1e-6f))};
  for (Material& material : scene.materials) material.double_sided = false;
  add_mesh(scene, box({-1, -1, -1}, {1, 1, 1}, 0, true));
  add_mesh(scene, box({9, -1, -1}, {11, 1, 1}, 1, true));
  return scene;
}
// `x`: of the room's middle.
inline CameraPose in_room_at(double x) {
  return camera_at({x + 0.2, 0.1, 0.3}, {x + 1, 0.4, 0.2}, 90);
}

// A point light of intensity 1e4 at `height` over a floor, or that far from each of three walls in their corner. The
// reflectance is a half.
inline SceneDescription light_almost_on_surface(double height, bool corner) {
  SceneDescription scene;
  scene.materials = {lambert(Rgb(0.5f, 0.5f, 0.5f))};
  add_mesh(scene, quad({0, 0, 5}, {5, 0, 0}, {0, 0, -5}, 0));
  if (corner) {
    add_mesh(scene, quad({0, 0, 0}, {5, 0, 0}, {0, 5, 0}, 0));
    add_mesh(scene, quad({0, 0, 0}, {0, 5, 0}, {0, 0, 5}, 0));
  }
  PunctualLight light;
  light.position = corner ? V3d(height, height, height) : V3d(1, height, 1);
  light.intensity = Rgb(1e4f, 1e4f, 1e4f);
  scene.lights = {light};
  return scene;
}
// Sees a spot of the floor, one unit from where the light of light_almost_on_surface() stands (roughly, in a corner).
inline CameraPose beside_light(bool corner) {
  const V3d seen = corner ? V3d(0.6, 0, 0.8) : V3d(1.6, 0, 1.8);
  return camera_at(seen + V3d(0, 2, 0), seen, 0.1);
}

// A floor that reflects a half, in the light of one texel of an environment map.
struct OneTexelSun {
  static constexpr int kWidth = 720, kHeight = 360, kRow = 90, kColumn = 200;
  static constexpr double kRadiance = 1e6;

  static SceneDescription scene() {
    Image image;
    image.width = kWidth;
    image.height = kHeight;
    image.channels = 3;
    image.format = TexelFormat::f32;
    std::vector<float> texels(std::size_t(3) * kWidth * kHeight, 0.0f);
    for (int c = 0; c < 3; ++c) texels[(std::size_t(kRow) * kWidth + kColumn) * 3 + std::size_t(c)] = float(kRadiance);
    image.texels.resize(texels.size() * sizeof(float));
    std::memcpy(image.texels.data(), texels.data(), image.texels.size());
    SceneDescription scene;
    scene.images = {image};
    scene.materials = {lambert(Rgb(0.5f, 0.5f, 0.5f))};
    add_mesh(scene, quad({-5, 0, 5}, {10, 0, 0}, {0, 0, -10}, 0));
    scene.environment = Environment{};
    scene.environment->image = 0;
    return scene;
  }
  static CameraPose pose() { return camera_at({0, 2, 0}, {0, 0, 0}, 5); }
};

}  // namespace helio::test
