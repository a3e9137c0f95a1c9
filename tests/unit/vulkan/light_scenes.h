// Scenes of lights of every kind, for the comparison of devices with LightSampler.
#pragma once

#include <cstring>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "renderer/scene/images/environment.h"
#include "renderer/scene/images/texture.h"
#include "renderer/trace/lights/light_sampler.h"
#include "tests/support/random.h"
#include "tests/unit/trace/lights/light_test_scenes.h"

namespace helio::test {

// Lights and what they refer to.
struct LightScene {
  std::string name;
  std::vector<Image> images;
  std::optional<Environment> environment;
  LightSampler::Input input;
};

inline V3f random_unit(Random& random) {
  const float z = 2 * random.next_float() - 1, phi = kTwoPi * random.next_float(), r = safe_sqrt(1 - z * z);
  return {r * std::cos(phi), r * std::sin(phi), z};
}

inline V3f random_point(Random& random, float low, float high) {
  const float x = random.next_float(), y = random.next_float();
  return V3f(low) + V3f(x, y, random.next_float()) * (high - low);
}

// 5 x 4 texels, rgb and an alpha in [0, 1].
inline Image sign_image() {
  Image image;
  image.width = 5;
  image.height = 4;
  image.channels = 4;
  for (int i = 0; i < 80; ++i) image.texels.push_back(std::uint8_t(30 + (i * 37) % 220));
  return image;
}

// A dim sky with a sun that is 100,000 times brighter.
inline Image sun_image(int width, int height) {
  Image image;
  image.width = width;
  image.height = height;
  image.channels = 3;
  image.format = TexelFormat::f32;
  std::vector<float> texels;
  for (int i = 0; i < width * height * 3; ++i) texels.push_back(0.1f + 0.01f * float(i % 7));
  for (int c = 0; c < 3; ++c) texels[std::size_t((height / 3 * width + width / 5) * 3 + c)] = 1e4f;
  image.texels.resize(texels.size() * 4);
  std::memcpy(image.texels.data(), texels.data(), image.texels.size());
  return image;
}

// Maps directions into the world by a rotation about no axis in particular, which scales, too.
inline M44d tilted() {
  M44d m;
  m.rotate(Imath::V3d(0.4, 1.1, -0.3));
  M44d scale;
  scale.scale(Imath::V3d(2));
  return scale * m;
}

inline Environment sun_environment(int image) {
  Environment environment;
  environment.image = image;
  environment.radiance = Rgb(0.5f, 1, 2);
  environment.to_world = tilted();
  return environment;
}

inline void add_textured(std::vector<AreaEmitter>& areas, int image) {
  AreaEmitter triangle = triangle_emitter({-2, 0, 0}, {-2, 1, 0}, {-2, 0, 1}, 7);
  triangle.texture.image = image;
  triangle.texture.encoding = TexelEncoding::srgb;
  triangle.uv[1] = V2f(1, 0);
  triangle.uv[2] = V2f(0, 1);
  areas.push_back(triangle);
  const std::size_t first = areas.size();
  add_quad(areas, {0, -2, 0}, {1, 0, 0.3f}, {0.2f, 0, 1}, 3, true);
  for (std::size_t i = first; i < first + 2; ++i) {
    AreaEmitter& e = areas[i];
    e.texture.image = image;
    e.texture.wrap_u = WrapMode::mirror;
    const V2f uvs[2][3] = {{V2f(0, 0), V2f(2, 0), V2f(2, 1)}, {V2f(0, 0), V2f(2, 1), V2f(0, 1)}};
    for (int k = 0; k < 3; ++k) e.uv[k] = uvs[i - first][k];
  }
  for (AreaEmitter e : {sphere_emitter({-1, -1, 4}, 0.6f, 6),
                        ellipsoid_emitter({-3, 2, 1}, {0.3f, 0.2f, 0}, {0, 0.1f, 0.4f}, {0.2f, -0.4f, 0}, 9)}) {
    e.texture.image = image;
    areas.push_back(e);
  }
}

// The same lights, half transparent by texture and factors, and cut out by a mask.
inline void add_alphas(LightSampler::Input& input, int image) {
  EmitterAlpha blend, mask;
  blend.texture.image = image;
  blend.uv[1] = V2f(1, 0);
  blend.uv[2] = V2f(0, 1);
  blend.factor = {1, 0.5f, 0.8f};
  mask = blend;
  mask.factor = {1, 1, 1};
  mask.mask = true;
  mask.cutoff = 0.45f;
  input.alphas = {blend, mask};
  for (std::size_t i = 0; i < input.areas.size(); ++i) input.areas[i].alpha = std::uint32_t(i % 3);
  for (AreaEmitter& e : input.areas)
    if (e.alpha == 2) e.alpha = kOpaqueEmitter;
}

inline PunctualLight punctual(PunctualKind kind, const V3d& position, const V3d& direction, float strength) {
  PunctualLight light;
  light.kind = kind;
  light.position = position;
  light.direction = normalize(direction);
  light.intensity = Rgb(strength, strength * 0.5f, strength * 2);
  return light;
}

// Spots of both falloffs, a hard-edged one, and points with and without a range.
inline void add_punctual(std::vector<PunctualLight>& lights) {
  lights.push_back(punctual(PunctualKind::point, {2, 2, 2}, {0, 0, -1}, 3));
  lights.push_back(punctual(PunctualKind::point, {-1, 2, 3}, {0, 0, -1}, 3));
  lights.back().range = 4;
  lights.push_back(punctual(PunctualKind::spot, {1, 1, 4}, {-0.2, 0, -1}, 20));
  lights.back().outer_cone_angle = 0.9f;
  lights.back().inner_cone_angle = 0.2f;
  lights.push_back(lights.back());
  lights.back().falloff = SpotFalloff::linear_in_angle;
  lights.push_back(lights.back());
  lights.back().inner_cone_angle = lights.back().outer_cone_angle;
}

// 500 lights about the place: small quads, spheres, points with a range and spots.
inline void add_many(LightSampler::Input& input) {
  Random random(7);
  for (int i = 0; i < 125; ++i) {
    const V3f e1 = random_unit(random) * 0.1f, e2 = cross(e1, random_unit(random)) * 0.5f;
    add_quad(input.areas, random_point(random, -6, 6), e1, e2, 1 + 20 * random.next_float(), i % 5 == 0);
    input.areas.push_back(sphere_emitter(random_point(random, -6, 6), 0.02f + 0.1f * random.next_float(), 3));
    PunctualLight light = punctual(PunctualKind::point, V3d(random_point(random, -6, 6)), {0, 0, 1}, 0.1f);
    if (i % 2 == 0) light.range = 3;
    input.punctual.push_back(light);
    light = punctual(PunctualKind::spot, V3d(random_point(random, -6, 6)), V3d(random_unit(random)), 0.4f);
    light.outer_cone_angle = 1.0f;
    input.punctual.push_back(light);
  }
}

inline LightScene make_scene(const std::string& name, const std::function<void(LightScene&)>& fill) {
  LightScene scene;
  scene.name = name;
  scene.input.scene_bounds = Box3f(V3f(-3), V3f(4));
  fill(scene);
  return scene;
}

// One entry of each kind. `environment` and `textures` of their inputs are set by whoever makes the sampler.
inline std::vector<LightScene> light_scenes() {
  std::vector<LightScene> scenes;
  const auto add = [&](const std::string& name, const std::function<void(LightScene&)>& fill) {
    scenes.push_back(make_scene(name, fill));
  };
  add("none", [](LightScene&) {});
  add("quad", [](LightScene& s) { add_quad(s.input.areas, {0, 0, 3}, {0, 1, 0}, {1, 0, 0}, 5); });
  add("large two-sided quad", [](LightScene& s) {
    add_quad(s.input.areas, {-2, -2, 1}, {4, 0, 0}, {0, 5, 0}, 5, true);
  });
  add("skewed quad", [](LightScene& s) { add_quad(s.input.areas, {-2, -2, 1}, {4, 1, 0}, {0, 5, 0.5f}, 5, true); });
  add("triangles", [](LightScene& s) {
    s.input.areas.push_back(triangle_emitter({0, 0, 2}, {0, 1, 2}, {1, 0, 2}, 5));
    s.input.areas.push_back(triangle_emitter({-3, -3, 0.5f}, {4, -3, 0.5f}, {0, 5, 0.2f}, 2, true));
    s.input.areas.push_back(triangle_emitter({3, 0, 0}, {3, 0.01f, 0}, {3, 0, 0.01f}, 90, true));
  });
  add("spheres", [](LightScene& s) {
    s.input.areas.push_back(sphere_emitter({1, 3, 1}, 0.5f, 4));
    s.input.areas.push_back(sphere_emitter({0, 0, 0}, 40, 0.01f, true));
    s.input.areas.push_back(sphere_emitter({0, 0, 200}, 0.5f, 4000));
  });
  add("ellipsoids", [](LightScene& s) {
    s.input.areas.push_back(ellipsoid_emitter({-3, 2, 1}, {0.3f, 0.2f, 0}, {0, 0.1f, 0.4f}, {0.2f, -0.4f, 0}, 9));
    s.input.areas.push_back(ellipsoid_emitter({0.1f, 0, 0}, {9, 1, 0}, {-1, 8, 0}, {0, 0.5f, 12}, 0.4f, true));
  });
  add("textured", [](LightScene& s) {
    s.images = {sign_image()};
    add_textured(s.input.areas, 0);
  });
  add("textured with alpha", [](LightScene& s) {
    s.images = {sign_image()};
    add_textured(s.input.areas, 0);
    add_quad(s.input.areas, {0, 0, 3}, {0, 1, 0}, {1, 0, 0}, 5);
    add_alphas(s.input, 0);
  });
  add("three by power", [](LightScene& s) {
    add_quad(s.input.areas, {0, 0, 3}, {0, 1, 0}, {1, 0, 0}, 5);
    s.input.punctual.push_back(punctual(PunctualKind::point, {2, 2, 2}, {0, 0, -1}, 3));
    s.input.punctual.push_back(punctual(PunctualKind::directional, {0, 0, 0}, {1, -1, -1}, 3));
  });
  add("punctual", [](LightScene& s) { add_punctual(s.input.punctual); });
  add("projector", [](LightScene& s) {
    s.images = {sign_image()};
    PunctualLight light = punctual(PunctualKind::projector, {2, 2, 6}, {-1, -1, -3}, 30);
    light.projection.depth = light.direction;
    light.projection.across = normalize(V3d(1, -1, 0)) * 0.5;
    light.projection.down = normalize(cross(light.direction, V3d(1, -1, 0))) * 0.5;
    s.input.punctual.push_back(light);
    light.projection.picture.image = 0;
    light.projection.picture.wrap_u = light.projection.picture.wrap_v = WrapMode::clamp;
    s.input.punctual.push_back(light);
  });
  const auto constant = [](LightScene& s) { s.environment.emplace().radiance = Rgb(0.5f, 1, 2); };
  const auto sun = [](LightScene& s) {
    constexpr int kWidth = 37, kHeight = 20;
    s.environment = sun_environment(int(s.images.size()));
    s.images.push_back(sun_image(kWidth, kHeight));
  };
  add("constant environment", constant);
  add("environment map", sun);
  add("environment, directional and areas", [&](LightScene& s) {
    constant(s);
    add_quad(s.input.areas, {0, 0, 3}, {0, 1, 0}, {1, 0, 0}, 5);
    s.input.punctual.push_back(punctual(PunctualKind::directional, {0, 0, 0}, {1, -1, -1}, 3));
  });
  add("tree of 500", [](LightScene& s) {
    add_many(s.input);
    s.input.use_tree = true;
  });
  add("tree of all kinds", [&](LightScene& s) {
    s.images = {sign_image()};
    add_textured(s.input.areas, 0);
    add_alphas(s.input, 0);
    add_many(s.input);
    add_punctual(s.input.punctual);
    s.input.punctual.push_back(punctual(PunctualKind::directional, {0, 0, 0}, {1, -1, -1}, 3));
    sun(s);
    s.input.use_tree = true;
  });
  return scenes;
}

}  // namespace helio::test
