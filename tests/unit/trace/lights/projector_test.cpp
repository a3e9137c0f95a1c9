// Projectors: an even light on a wall across the axis, the picture's place in it, and what selection is told of them.
#include "renderer/trace/lights/projector.h"

#include <gtest/gtest.h>

#include <cmath>

#include "renderer/scene/images/texture.h"
#include "renderer/trace/lights/punctual_light.h"

namespace helio {
namespace {

// At (1, 2, 5), looking along -z with +x to the right: tan of the half angle is 1 across and 1/2 down.
PunctualLight light_of(double tangent = 1) {
  PunctualLight light;
  light.kind = PunctualKind::projector;
  light.position = V3d(1, 2, 5);
  light.intensity = Rgb(8, 4, 2);
  light.projection.across = V3d(0.5 / tangent, 0, 0);
  light.projection.down = V3d(0, -1 / tangent, 0);
  return light;
}

Rgb radiance_at(const PunctualLight& light, const V3f& point, const TextureTable* textures = nullptr) {
  const PunctualArrival arrival = arrive(make_punctual_source(light), point);
  return arrival.radiance * projected(make_projector(light), -arrival.direction, textures);
}

// A wall at z = 3, two units away, faces the light: its irradiance is I / 2^2 wherever the picture falls.
TEST(Projector, LightsAWallEvenly) {
  for (const V2f& at : {V2f(0, 0), V2f(1.9f, 0.9f), V2f(-1.9f, 0.9f), V2f(1.2f, -0.7f)}) {
    const V3f point(1 + at.x, 2 + at.y, 3);
    const float cosine = 2 / std::sqrt(4 + at.x * at.x + at.y * at.y);
    EXPECT_NEAR(radiance_at(light_of(), point).x * cosine, 2, 1e-5) << at;
    EXPECT_NEAR(radiance_at(light_of(), point).z * cosine, 0.5, 1e-5) << at;
  }
  for (const V2f& beside : {V2f(2.1f, 0), V2f(-2.1f, 0), V2f(0, 1.1f), V2f(0, -1.1f)})
    EXPECT_TRUE(is_black(radiance_at(light_of(), {1 + beside.x, 2 + beside.y, 3}))) << beside;
  EXPECT_TRUE(is_black(radiance_at(light_of(), {1, 2, 7})));  // behind
  EXPECT_TRUE(is_black(radiance_at(light_of(), {1, 2, 5})));  // on it
}

Image four_texels(const std::vector<std::uint8_t>& rgb) {
  Image image;
  image.width = image.height = 2;
  image.channels = 3;
  image.texels = rgb;
  return image;
}

TEST(Projector, ShowsThePictureUpright) {
  const std::vector<Image> images{four_texels({255, 0, 0, /**/ 0, 255, 0, /**/ 0, 0, 255, /**/ 255, 255, 255})};
  const TextureTable textures(images);
  PunctualLight light = light_of();
  light.intensity = Rgb(1);
  light.projection.picture.image = 0;
  light.projection.picture.filter = FilterMode::nearest;
  const auto seen = [&](float right, float up) {
    const Rgb c = radiance_at(light, {1 + right, 2 + up, 4}, &textures);
    return Rgb(float(c.x > 0), float(c.y > 0), float(c.z > 0));
  };
  EXPECT_EQ(seen(-0.5f, 0.2f), Rgb(1, 0, 0));  // above, left: the first texel
  EXPECT_EQ(seen(0.5f, 0.2f), Rgb(0, 1, 0));
  EXPECT_EQ(seen(-0.5f, -0.2f), Rgb(0, 0, 1));
  EXPECT_EQ(seen(0.5f, -0.2f), Rgb(1, 1, 1));
}

// By adding up radiant intensity over a cap wider than the picture, by the midpoint rule.
TEST(Projector, PowerIsWhatItGives) {
  const std::vector<Image> images{four_texels({255, 255, 255, /**/ 0, 0, 0, /**/ 0, 0, 0, /**/ 0, 0, 0})};
  const TextureTable textures(images);
  for (const bool textured : {false, true}) {
    for (const double tangent : {0.1, 1.0, 5.0}) {
      PunctualLight light = light_of(tangent);
      light.intensity = Rgb(3);
      light.projection.picture.image = textured ? 0 : -1;
      light.projection.picture.filter = FilterMode::nearest;
      const Projector projector = make_projector(light);
      constexpr int kRings = 800, kSectors = 800;
      const double lowest = std::cos(std::min(1.1 * std::atan(tangent * std::sqrt(1.25)), std::numbers::pi / 2));
      double flux = 0, widest = 0;
      for (int i = 0; i < kRings; ++i) {
        const double z = lowest + (1 - lowest) * (i + 0.5) / kRings, r = std::sqrt(1 - z * z);
        for (int j = 0; j < kSectors; ++j) {
          const double phi = 2 * std::numbers::pi * (j + 0.5) / kSectors;
          const float sent = projected(projector, V3f(V3d(r * std::cos(phi), r * std::sin(phi), -z)), &textures).x;
          flux += sent;
          if (sent > 0) widest = std::max(widest, std::acos(z));
        }
      }
      flux *= 3 * 2 * std::numbers::pi * (1 - lowest) / (double(kRings) * kSectors);
      const ProjectorPower power = projector_power(light, &textures);
      EXPECT_NEAR(power.flux, flux, 0.01 * flux) << tangent;
      EXPECT_NEAR(power.half_angle, std::atan(tangent * std::sqrt(1.25)), 1e-6) << tangent;
      EXPECT_GE(power.half_angle, widest - 1e-6);
      EXPECT_NEAR(power.intensity * 2 * std::numbers::pi * (1 - std::cos(power.half_angle)), power.flux,
                  1e-5 * power.flux);  // the angle is a float
    }
  }
}

TEST(Projector, ASpotBetweenTheLookupsIsNotDark) {
  Image image;
  image.width = image.height = 1024;
  image.channels = 1;
  image.texels.resize(1024 * 1024);
  image.texels[0] = 255;
  const std::vector<Image> images{image};
  const TextureTable textures(images);
  PunctualLight light = light_of();
  light.projection.picture.image = 0;
  light.projection.picture.filter = FilterMode::nearest;
  EXPECT_GT(projector_power(light, &textures).flux, 0);
  std::vector<Image> dark{image};
  dark[0].texels[0] = 0;
  const TextureTable black(dark);
  EXPECT_EQ(projector_power(light, &black).flux, 0);
}

TEST(Projector, ExtremesAreFiniteOrBlack) {
  for (const double tangent : {8.7e-6, 1.0, 1.1e5}) {  // fields of view of 0.001, 90 and 179.999 degrees
    const PunctualLight light = light_of(tangent);
    const ProjectorPower power = projector_power(light, nullptr);
    EXPECT_TRUE(std::isfinite(power.flux) && power.flux > 0 && std::isfinite(power.intensity));
    for (const V3f& offset : {V3f(0, 0, 0), V3f(1e-7f, 0, -1e-12f), V3f(1e7f, 0, -1), V3f(0, 1e15f, -1e15f),
                              V3f(1e9f, -1e9f, -1e5f), V3f(1, 0, -1e-30f), V3f(0, 0, -1e9f)}) {
      EXPECT_TRUE(is_finite(radiance_at(light, V3f(1, 2, 5) + offset))) << offset << " " << tangent;
    }
  }
  PunctualLight flat = light_of();
  flat.projection.down = flat.projection.across;
  EXPECT_EQ(projector_power(flat, nullptr).flux, 0);
}

// Looking askew, as a sheared transform makes it: nothing is sent backwards.
TEST(Projector, NothingLeavesBehindTheAxis) {
  PunctualLight light = light_of(10);
  light.direction = normalize(V3d(5, 0, -1));
  int lit = 0, behind = 0;
  for (int i = -90; i <= 90; ++i) {
    const double angle = i * std::numbers::pi / 180;
    const V3f direction(V3d(std::sin(angle), 0, -std::cos(angle)));
    const Rgb sent = projected(make_projector(light), direction, nullptr);
    EXPECT_GE(sent.x, 0) << i;
    lit += sent.x > 0;
    behind += sent.x == 0 && std::abs(std::tan(angle)) < 10;
  }
  EXPECT_GT(lit, 50);
  EXPECT_GT(behind, 20);
}

}  // namespace
}  // namespace helio
