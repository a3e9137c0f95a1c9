// An environment map with a small bright spot, rotated, against the same scene rendered by Mitsuba 3: the map's
// convention, its rotation and its importance sampling, seen from outside.
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>

#include "renderer/scene/images/environment.h"
#include "renderer/scene/images/image_decoder.h"
#include "tests/support/shared_data.h"
#include "tests/support/test_scenes.h"

namespace helio {
namespace {

constexpr int kSize = 128;

Image read_image(const std::filesystem::path& path) {
  Result<Image> image = decode_image(test::read_bytes(path), path.filename().string(), 1 << 26);
  EXPECT_TRUE(image.ok()) << image.error().to_string();
  return std::move(*image);
}

float texel(const Image& image, int x, int y, int channel) {
  float value;
  const std::size_t index = (std::size_t(y) * image.width + x) * image.channels + channel;
  std::memcpy(&value, image.texels.data() + 4 * index, 4);
  return value;
}

// Mitsuba puts the first and last rows of a map on the poles: row = v (height - 1), where ours is v height - 1/2. Its
// function, sampled so finely that our interpolation adds nothing (8 times would show at the horizon, where it has a
// kink).
Image as_mitsuba_sees(const Image& map) {
  constexpr int kFactor = 16;
  Image fine;
  fine.name = map.name;
  fine.width = map.width * kFactor;
  fine.height = map.height * kFactor;
  fine.channels = 3;
  fine.format = TexelFormat::f32;
  std::vector<float> values;
  for (int j = 0; j < fine.height; ++j) {
    for (int i = 0; i < fine.width; ++i) {
      const float x = (i + 0.5f) / kFactor - 0.5f, y = (j + 0.5f) / float(fine.height) * float(map.height - 1);
      const int x0 = int(std::floor(x)), y0 = std::min(int(y), map.height - 2);
      const float fx = x - float(x0), fy = y - float(y0);
      for (int c = 0; c < 3; ++c) {
        const auto at = [&](int dx, int dy) { return texel(map, (x0 + dx + map.width) % map.width, y0 + dy, c); };
        values.push_back((at(0, 0) * (1 - fx) + at(1, 0) * fx) * (1 - fy) + (at(0, 1) * (1 - fx) + at(1, 1) * fx) * fy);
      }
    }
  }
  fine.texels.resize(values.size() * sizeof(float));
  std::memcpy(fine.texels.data(), values.data(), fine.texels.size());
  return fine;
}

// environment-map.xml, written out: a grey floor, a gold sphere of GGX roughness 0.2, a diffuse sphere.
SceneDescription reference_scene(Image map) {
  SceneDescription scene;
  scene.images.push_back(std::move(map));
  scene.materials = {test::lambert(Rgb(0.6f)), test::lambert(Rgb(0.7f)), Material{}};
  Material& gold = scene.materials[2];
  gold.model = MaterialModel::conductor;
  gold.roughness = std::sqrt(0.2f);
  gold.conductor_eta = Rgb(0.143f, 0.375f, 1.442f);
  gold.conductor_k = Rgb(3.983f, 2.386f, 1.603f);
  test::add_mesh(scene, test::quad({-4, -1, 4}, {8, 0, 0}, {0, 0, -8}, 0));
  test::add_sphere(scene, {-0.6f, -0.5f, 0}, 0.5f, 2);
  test::add_sphere(scene, {0.6f, -0.5f, 0}, 0.5f, 1);
  scene.environment = Environment{};
  scene.environment->image = 0;
  scene.environment->to_world.setAxisAngle(V3d(0, 1, 0), M_PI / 6);
  scene.cameras.push_back({});
  return scene;
}

TEST(EnvironmentReference, AgreesWithMitsuba) {
  HELIO_SHARED_OR_SKIP(root, "scenes/mitsuba-references");
  const Image mean = read_image(root / "environment-map.mean.exr");
  const Image variance = read_image(root / "environment-map.variance.exr");
  ASSERT_EQ(mean.width, kSize);
  ASSERT_EQ(mean.format, TexelFormat::f32);
  const auto scene = test::build(reference_scene(as_mitsuba_sees(read_image(root / "env-shared.exr"))));
  ASSERT_TRUE(scene);
  const Film film = test::render(*scene, test::camera_at({0, 0, 4.2}, {0, 0, 0}, 30), kSize, kSize, 32);

  // Tiles of 16 x 16: means and the variances of means add up over pixels. 64 tiles in three correlated channels: five
  // standard deviations leave one false alarm in 3,000 runs, and the seed is fixed.
  constexpr int kTile = 16;
  for (int ty = 0; ty < kSize; ty += kTile) {
    for (int tx = 0; tx < kSize; tx += kTile) {
      for (int c = 0; c < 3; ++c) {
        double difference = 0, error = 0;
        for (int y = ty; y < ty + kTile; ++y) {
          for (int x = tx; x < tx + kTile; ++x) {
            double n = 0, sum = 0, squares = 0;
            for (int h = 0; h < kHalves; ++h) {
              const HalfPixel& half = film.half(h, x, y);
              n += half.count;
              sum += half.sum[c];
              squares += half.sum_squares(c);
            }
            difference += sum / n - texel(mean, x, y, c);
            error += (squares / n - sum * sum / n / n) / (n - 1) + texel(variance, x, y, c);
          }
        }
        EXPECT_LT(std::abs(difference), 5 * std::sqrt(error) + 1e-4 * kTile * kTile)
            << "tile at " << tx << ", " << ty << " channel " << c;
      }
    }
  }
}

}  // namespace
}  // namespace helio
