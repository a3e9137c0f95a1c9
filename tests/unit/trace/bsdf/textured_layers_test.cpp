// Textures of material layers: "texture times factor", by the channel that the extension names. A picture of a card
// with a texture of one colour equals that of a card whose factor is the product, with the same random numbers, and
// differs from that of the factor alone.
#include <gtest/gtest.h>

#include <cstring>
#include <functional>

#include "tests/support/test_scenes.h"

namespace helio::test {
namespace {

// Every channel differs, so that a wrong one shows.
constexpr float kTexel[4] = {0.5f, 0.25f, 0.75f, 0.625f};

Image one_colour() {
  Image image;
  image.width = image.height = 2;
  image.channels = 4;
  image.format = TexelFormat::f32;
  for (int i = 0; i < 4; ++i) {
    const auto* bytes = reinterpret_cast<const std::uint8_t*>(kTexel);
    image.texels.insert(image.texels.end(), bytes, bytes + sizeof(kTexel));
  }
  return image;
}

// A card under a lamp whose mirror image is half in view, a sun from behind and a sky: roughness, direction and what
// passes through all show.
Film picture(const MaterialLayers& layers) {
  SceneDescription scene;
  Material card;
  card.base_color = Rgb(0.7f, 0.6f, 0.5f);
  card.metallic = 0;
  card.roughness = 0.4f;
  card.double_sided = true;
  card.layers = layers;
  scene.materials = {card, lambert(Rgb(0, 0, 0), Rgb(9, 9, 9))};
  scene.images = {one_colour()};
  add_mesh(scene, quad({-2, 0, 2}, {4, 0, 0}, {0, 0, -4}, 0));
  add_mesh(scene, quad({-0.4f, 2, -2}, {0.8f, 0, 0}, {0, 0.8f, 0}, 1));
  PunctualLight sun;
  sun.kind = PunctualKind::directional;
  sun.direction = normalize(V3d(0.3, 1, 0.2));
  sun.intensity = Rgb(2, 2, 2);
  scene.lights = {sun};
  Environment sky;
  sky.radiance = Rgb(0.2f, 0.3f, 0.4f);
  scene.environment = sky;
  return render(*build(std::move(scene)), camera_at({0, 2, 2.5}, {0, 0, 0}, 50), 12, 12, 32);
}

// Largest difference of two pictures, over their mean.
double difference(const Film& a, const Film& b) {
  double largest = 0, sum = 0;
  for (int y = 0; y < a.height(); ++y) {
    for (int x = 0; x < a.width(); ++x) {
      for (int c = 0; c < 3; ++c) {
        const double va = a.half(0, x, y).sum[c], vb = b.half(0, x, y).sum[c];
        largest = std::max(largest, std::abs(va - vb));
        sum += va;
      }
    }
  }
  return largest / (sum / (3.0 * a.width() * a.height()));
}

struct Case {
  const char* name;
  std::function<void(MaterialLayers&)> factor;   // alone
  std::function<void(MaterialLayers&, TextureSlot)> texture;  // beside the factor
  std::function<void(MaterialLayers&)> product;  // in place of both
};

class TexturedLayer : public testing::TestWithParam<Case> {};

TEST_P(TexturedLayer, IsTextureTimesFactor) {
  TextureSlot slot;
  slot.image = 0;
  MaterialLayers plain, textured, expected;
  GetParam().factor(plain);
  GetParam().factor(textured);
  GetParam().texture(textured, slot);
  GetParam().factor(expected);
  GetParam().product(expected);
  const Film found = picture(textured);
  EXPECT_LT(difference(found, picture(expected)), 1e-4);
  EXPECT_GT(difference(found, picture(plain)), 1e-2);
}

const Rgb kColor(1, 0.8f, 0.6f), kColorProduct(1 * kTexel[0], 0.8f * kTexel[1], 0.6f * kTexel[2]);

const Case kCases[] = {
    {"clearcoat_by_red", [](MaterialLayers& m) { m.clearcoat = 0.8f; },
     [](MaterialLayers& m, TextureSlot t) { m.clearcoat_texture = t; },
     [](MaterialLayers& m) { m.clearcoat = 0.8f * kTexel[0]; }},
    {"clearcoat_roughness_by_green",
     [](MaterialLayers& m) {
       m.clearcoat = 1;
       m.clearcoat_roughness = 0.8f;
     },
     [](MaterialLayers& m, TextureSlot t) { m.clearcoat_roughness_texture = t; },
     [](MaterialLayers& m) { m.clearcoat_roughness = 0.8f * kTexel[1]; }},
    {"sheen_color_by_colour",
     [](MaterialLayers& m) {
       m.sheen_color = kColor;
       m.sheen_roughness = 0.5f;
     },
     [](MaterialLayers& m, TextureSlot t) { m.sheen_color_texture = t; },
     [](MaterialLayers& m) { m.sheen_color = kColorProduct; }},
    {"sheen_roughness_by_alpha",
     [](MaterialLayers& m) {
       m.sheen_color = kColor;
       m.sheen_roughness = 0.8f;
     },
     [](MaterialLayers& m, TextureSlot t) { m.sheen_roughness_texture = t; },
     [](MaterialLayers& m) { m.sheen_roughness = 0.8f * kTexel[3]; }},
    // Red and green hold the direction (0, -0.5): a quarter turn. Blue holds the strength.
    {"anisotropy_by_blue_along_red_and_green", [](MaterialLayers& m) { m.anisotropy = 0.9f; },
     [](MaterialLayers& m, TextureSlot t) { m.anisotropy_texture = t; },
     [](MaterialLayers& m) {
       m.anisotropy = 0.9f * kTexel[2];
       m.anisotropy_rotation = -kPi / 2;
     }},
    {"iridescence_by_red",
     [](MaterialLayers& m) {
       m.iridescence = 0.8f;
       m.iridescence_thickness_max = 300;
     },
     [](MaterialLayers& m, TextureSlot t) { m.iridescence_texture = t; },
     [](MaterialLayers& m) { m.iridescence = 0.8f * kTexel[0]; }},
    // Green mixes the two bounds; without a texture the thickness is the larger.
    {"film_thickness_by_green",
     [](MaterialLayers& m) {
       m.iridescence = 1;
       m.iridescence_thickness_min = 200;
       m.iridescence_thickness_max = 600;
     },
     [](MaterialLayers& m, TextureSlot t) { m.iridescence_thickness_texture = t; },
     [](MaterialLayers& m) { m.iridescence_thickness_max = 200 + 400 * kTexel[1]; }},
    {"diffuse_transmission_by_alpha", [](MaterialLayers& m) { m.diffuse_transmission = 0.8f; },
     [](MaterialLayers& m, TextureSlot t) { m.diffuse_transmission_texture = t; },
     [](MaterialLayers& m) { m.diffuse_transmission = 0.8f * kTexel[3]; }},
    {"diffuse_transmission_color_by_colour",
     [](MaterialLayers& m) {
       m.diffuse_transmission = 0.7f;
       m.diffuse_transmission_color = kColor;
     },
     [](MaterialLayers& m, TextureSlot t) { m.diffuse_transmission_color_texture = t; },
     [](MaterialLayers& m) { m.diffuse_transmission_color = kColorProduct; }},
};

INSTANTIATE_TEST_SUITE_P(, TexturedLayer, testing::ValuesIn(kCases), [](const auto& info) { return info.param.name; });

}  // namespace
}  // namespace helio::test
