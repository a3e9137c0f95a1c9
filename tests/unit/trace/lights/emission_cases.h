// One light of every kind, each alone, for tests of the rays that leave them.
#pragma once

#include <string>
#include <vector>

#include "renderer/scene/images/texture.h"
#include "tests/unit/trace/lights/light_test_scenes.h"

namespace helio::test {

struct EmissionCase {
  std::string name;
  LightSampler::Input input;
};

// The inputs refer to it: it must outlive the samplers made from them. Everything lies within the cube of side 4 around
// the origin, but for the sphere and the ellipsoid around it that are two-sided.
class EmissionCases {
 public:
  EmissionCases();
  EmissionCases(const EmissionCases&) = delete;
  EmissionCases& operator=(const EmissionCases&) = delete;

  const std::vector<EmissionCase>& all() const { return cases_; }
  LightSampler::Input of(const std::string& name) const;
  // All lights that nothing has to block, in one sampler. Constant and mapped environments exclude each other.
  LightSampler::Input together(bool use_tree) const;
  const TextureTable& textures() const { return textures_; }

 private:
  LightSampler::Input& add(const std::string& name);
  void add_area(const std::string& name, std::vector<AreaEmitter> emitters, std::vector<EmitterAlpha> alphas = {});
  void add_punctual(const std::string& name, const PunctualLight& light);
  void add_areas();
  void add_punctual_lights();

  std::vector<Image> images_;
  TextureTable textures_;
  Environment constant_, mapped_;
  std::vector<EmissionCase> cases_;
};

// 4 x 4 texels, all different in brightness and alpha.
inline Image uneven_image() {
  Image image;
  image.width = image.height = 4;
  image.channels = 4;
  for (int i = 0; i < 16; ++i) {
    for (const int v : {20 + 37 * i % 200, 20 + 71 * i % 200, 90, 10 + 53 * i % 240}) {
      image.texels.push_back(std::uint8_t(v));
    }
  }
  return image;
}

inline Image uneven_sky() {
  Image image;
  image.width = 16;
  image.height = 8;
  image.channels = 1;
  for (int i = 0; i < 128; ++i) image.texels.push_back(std::uint8_t(i == 37 ? 255 : 5 + 29 * i % 60));
  return image;
}

inline EmissionCases::EmissionCases() : images_{uneven_image(), uneven_sky()}, textures_(images_) {
  add_areas();
  add_punctual_lights();
  constant_.radiance = Rgb(0.3f, 0.2f, 0.1f);
  add("constant environment").environment = &constant_;
  mapped_.radiance = Rgb(0.5f);
  mapped_.image = 1;
  mapped_.to_world.setAxisAngle(V3d(1, 2, 3).normalized(), 0.8);
  add("mapped environment").environment = &mapped_;
}

inline LightSampler::Input& EmissionCases::add(const std::string& name) {
  LightSampler::Input& input = cases_.emplace_back(EmissionCase{name, {}}).input;
  input.textures = &textures_;
  input.scene_bounds = Box3f(V3f(-2), V3f(2));
  return input;
}

inline void EmissionCases::add_area(const std::string& name, std::vector<AreaEmitter> emitters,
                                    std::vector<EmitterAlpha> alphas) {
  LightSampler::Input& input = add(name);
  input.areas = std::move(emitters);
  input.alphas = std::move(alphas);
}

inline void EmissionCases::add_punctual(const std::string& name, const PunctualLight& light) {
  add(name).punctual = {light};
}

inline void EmissionCases::add_areas() {
  std::vector<AreaEmitter> quad;
  add_quad(quad, {-0.5f, 1, -0.5f}, {1, 0, 0}, {0, 0, 1}, 3);  // looks down
  add_area("quad", quad);
  quad.clear();
  add_quad(quad, {0, -0.3f, -0.4f}, {0.1f, 0.8f, 0.1f}, {0, 0.1f, 0.9f}, 2, true);
  add_area("two-sided parallelogram", quad);
  const V3f a(0.2f, 0.9f, 0), b(-0.6f, 1.1f, 0.1f), c(0.1f, 1.2f, -0.9f);
  add_area("triangle", {triangle_emitter(a, b, c, 5)});

  // No two at the same place: hits are told apart by their distance.
  const V3f up(0, 0.1f, 0);
  AreaEmitter textured = triangle_emitter(a + up, b + up, c + up, 8, true);
  textured.texture.image = 0;
  textured.uv = {V2f(0, 0), V2f(1, 0), V2f(0, 1)};
  add_area("textured two-sided triangle", {textured});
  AreaEmitter blended = textured;
  blended.p0 += up;
  blended.alpha = 0;
  EmitterAlpha alpha;
  alpha.texture.image = 0;
  alpha.uv = textured.uv;
  alpha.factor = {1, 0.3f, 0.7f};
  add_area("blended triangle", {blended}, {alpha});
  blended.p0 += up;
  alpha.mask = true;
  alpha.cutoff = 0.3f;
  add_area("masked triangle", {blended}, {alpha});

  add_area("sphere", {sphere_emitter({0.3f, 0.9f, -0.2f}, 0.4f, 4)});
  add_area("two-sided sphere around everything", {sphere_emitter({0, 0, 0}, 4, 0.5f, true)});
  AreaEmitter picture = sphere_emitter({-0.8f, 0.7f, 0.9f}, 0.4f, 9);
  picture.texture.image = 0;
  picture.alpha = 0;
  EmitterAlpha ball;
  ball.texture.image = 0;
  add_area("textured and blended sphere", {picture}, {ball});
  add_area("ellipsoid", {ellipsoid_emitter({0.2f, 0.8f, 0}, {0.5f, 0.2f, 0}, {0, 0.1f, 0.4f}, {0.2f, -0.3f, 0}, 6)});
  AreaEmitter skewed = ellipsoid_emitter({-0.9f, 0.9f, -0.8f}, {0, 0.1f, 0.4f}, {0.5f, 0.2f, 0}, {0.2f, -0.3f, 0}, 11);
  skewed.texture.image = 0;
  add_area("mirrored and textured ellipsoid", {skewed});
  add_area("two-sided ellipsoid around everything",
           {ellipsoid_emitter({0.1f, 0, 0}, {5, 1, 0}, {-1, 4, 0}, {0, 0.5f, 6}, 0.4f, true)});
}

inline void EmissionCases::add_punctual_lights() {
  PunctualLight light;
  light.position = V3d(0.3, 1.1, -0.2);
  light.direction = normalize(V3d(0.5, -1, 0.2));
  light.intensity = Rgb(6, 3, 2);
  add_punctual("point", light);
  light.range = 3;
  add_punctual("point with a range", light);
  light.kind = PunctualKind::spot;
  light.inner_cone_angle = 0.2f;
  light.outer_cone_angle = 0.7f;
  add_punctual("spot with a range", light);
  light.range = std::numeric_limits<float>::infinity();
  add_punctual("spot", light);
  light.falloff = SpotFalloff::linear_in_angle;
  add_punctual("spot, linear", light);
  light.kind = PunctualKind::projector;
  light.projection.depth = light.direction;
  light.projection.across = normalize(V3d(1, 0.5, 0)) * 0.6;
  light.projection.down = normalize(cross(light.direction, light.projection.across)) * 0.9;
  add_punctual("projector", light);
  light.projection.picture.image = 0;
  light.projection.depth = V3d(0.6, -1.4, 0.1);  // not along the axis, not unit
  add_punctual("skewed projector with a picture", light);
  light.kind = PunctualKind::directional;
  light.intensity = Rgb(2, 1, 0.5f);
  add_punctual("directional", light);
}

inline LightSampler::Input EmissionCases::of(const std::string& name) const {
  for (const EmissionCase& c : cases_) {
    if (c.name == name) return c.input;
  }
  return {};
}

inline LightSampler::Input EmissionCases::together(bool use_tree) const {
  LightSampler::Input all;
  for (const EmissionCase& c : cases_) {
    if (c.name.find("around everything") != std::string::npos) continue;
    for (AreaEmitter e : c.input.areas) {
      if (e.alpha != kOpaqueEmitter) e.alpha += std::uint32_t(all.alphas.size());
      all.areas.push_back(e);
    }
    all.alphas.insert(all.alphas.end(), c.input.alphas.begin(), c.input.alphas.end());
    all.punctual.insert(all.punctual.end(), c.input.punctual.begin(), c.input.punctual.end());
    if (c.input.environment) all.environment = c.input.environment;
  }
  all.textures = &textures_;
  all.scene_bounds = Box3f(V3f(-2), V3f(2));
  all.use_tree = use_tree;
  return all;
}

}  // namespace helio::test
