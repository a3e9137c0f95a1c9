// Lights on a device against LightSampler: the same choices, directions, radiances and densities for the same variates.
//
// Rule for the tolerances: all but kIllConditioned of the values agree to kTolerance, and all but kOnBorders to
// kLooseTolerance. A point or variate may lie so near a border of a decision (between two lights of a selection, area
// and solid angle sampling, opaque and cut out, cells of an environment) that rounding decides. Digits are lost near
// the corner of a spherical triangle, in the plane of a light and beside a sun. A cosine at a light below kGrazing is a
// difference of larger numbers, and a light nearer than kNearby fills almost half of the directions: the fewer digits.
#include <gtest/gtest.h>

#include <helio_shaders/light_queries_comp.h>

#include <algorithm>
#include <map>

#include "renderer/vulkan/scene/light_tables.h"
#include "renderer/vulkan/scene/texture_tables.h"
#include "renderer/vulkan/shaders/tables/scene.h"
#include "tests/unit/vulkan/light_queries.h"
#include "tests/unit/vulkan/light_scenes.h"
#include "tests/unit/vulkan/scene_queries.h"
#include "tests/unit/vulkan/test_device.h"

namespace helio {
namespace {

using test::LightScene;
using test::Random;
using vulkan::LightAnswer;
using vulkan::LightQuery;

constexpr int kQueries = 20000;
constexpr double kIllConditioned = 3e-3, kOnBorders = 2e-4;
constexpr float kTolerance = 1e-4f, kLooseTolerance = 5e-3f;
constexpr float kGrazing = 0.01f, kNearby = 0.1f;

// A scene of lights on the host and on a device.
class Twins {
 public:
  Twins(const LightScene& scene, const std::shared_ptr<vulkan::Device>& device)
      : scene_(scene), textures_(scene_.images), device_(device), arena_(device) {
    scene_.input.textures = &textures_;
    if (scene_.environment) scene_.input.environment = &*scene_.environment;
    lights_ = std::make_unique<LightSampler>(scene_.input);
    const vulkan::HostLights host = vulkan::make_host_lights(*lights_);
    const vulkan::HostTextures images = vulkan::make_host_textures(scene_.images);
    Result<vulkan::LightTables> lights = host.place(arena_);
    Result<vulkan::TextureTables> textures = images.place(arena_);
    EXPECT_TRUE(lights.ok() && textures.ok());
    vulkan::SceneTables tables{};
    tables.lights = *lights;
    tables.textures = *textures;
    EXPECT_LE(arena_.bytes(), host.bytes() + images.bytes());
    features_ = host.features() | images.features();
    const Result<std::uint64_t> address = arena_.upload(std::as_bytes(std::span(&tables, 1)), 16, "the scene");
    EXPECT_TRUE(address.ok());
    address_ = *address;
  }

  const LightSampler& lights() const { return *lights_; }
  // `tailored`: by a shader without the code that the scene does not need.
  std::vector<LightAnswer> ask(const std::vector<LightQuery>& queries, bool tailored) const {
    const std::uint32_t constants[] = {~0u, ~0u, tailored ? features_ : ~0u};
    Result<std::vector<LightAnswer>> answers =
        test::run_scene_queries<LightAnswer>(device_, light_queries_comp, address_, queries, constants);
    EXPECT_TRUE(answers.ok()) << answers.error().to_string();
    return answers.ok() ? *answers : std::vector<LightAnswer>(queries.size());
  }

 private:
  LightScene scene_;
  TextureTable textures_;
  std::shared_ptr<vulkan::Device> device_;
  vulkan::Arena arena_;
  std::unique_ptr<LightSampler> lights_;
  std::uint64_t address_ = 0;
  std::uint32_t features_ = 0;
};

std::vector<LightQuery> random_queries(std::uint64_t seed) {
  Random random(seed);
  std::vector<LightQuery> queries;
  for (int i = 0; i < kQueries; ++i) {
    LightQuery q{};
    q.point = test::random_point(random, -2, 4);
    q.normal = i % 2 == 0 ? V3f(0, 0, 0) : test::random_unit(random);
    q.u_select = random.next_float();
    q.u = random.next_v2f();
    q.direction = test::random_unit(random);
    q.emitter = kNoLight;
    q.uv = V2f(0, 0);
    queries.push_back(q);
  }
  return queries;
}

bool near(float a, float b, float relative, float absolute = 0) {
  return a == b || std::abs(a - b) <= relative * std::abs(b) + absolute;
}
bool near(const V3f& a, const V3f& b, float relative, float absolute = 0) {
  return near(a.x, b.x, relative, absolute) && near(a.y, b.y, relative, absolute) && near(a.z, b.z, relative, absolute);
}

// Empty, or the first thing that differs.
std::string difference(const LightAnswer& a, const LightSample& s, float tolerance) {
  if (a.light != s.light) return "light";
  if ((a.pdf_w > 0) != (s.pdf_w > 0)) return "no sample";
  if (!(s.pdf_w > 0)) return "";
  const float slack = tolerance * std::max({1.0f, kGrazing / std::max(s.cos_light, 1e-6f), kNearby / s.distance});
  if ((a.delta != 0) != s.delta) return "delta";
  if (!near(a.pdf_w, s.pdf_w, slack)) return "density";
  if (!near(a.direction, s.direction, 0, slack)) return "direction";
  if (!near(a.distance, s.distance, slack)) return "distance";
  if (!near(a.radiance, s.radiance, tolerance)) return "radiance";
  // A cosine at a sphere is the root of a difference: near 0 half of the digits are left.
  if (!near(sqr(a.cos_light), sqr(s.cos_light), tolerance, tolerance)) return "cosine";
  return "";
}

// How many of the queries disagree, and the first that does.
class Disagreements {
 public:
  void add(const std::string& what, std::size_t query) {
    if (what.empty()) return;
    if (count_++ == 0) first_ = what + " of query " + std::to_string(query);
    ++kinds_[what];
  }
  void expect_few(double share, std::size_t queries, const std::string& scene) const {
    std::string kinds;
    for (const auto& [what, count] : kinds_) kinds += " " + what + " " + std::to_string(count);
    EXPECT_LE(double(count_), std::max(1.0, share * double(queries))) << scene << ", first " << first_ << ";" << kinds;
  }

 private:
  std::size_t count_ = 0;
  std::string first_;
  std::map<std::string, int> kinds_;
};

class VulkanLights : public test::DeviceTest {};

TEST_F(VulkanLights, SamplesAreThoseOfTheHost) {
  for (const LightScene& scene : test::light_scenes()) {
    const Twins twins(scene, device());
    const std::vector<LightQuery> queries = random_queries(1);
    const std::vector<LightAnswer> answers = twins.ask(queries, true);
    Disagreements samples, loosely, environment;
    std::size_t valid = 0;
    for (std::size_t i = 0; i < queries.size(); ++i) {
      const LightQuery& q = queries[i];
      const LightSample s = twins.lights().sample(q.point, q.normal, q.u_select, q.u);
      samples.add(difference(answers[i], s, kTolerance), i);
      loosely.add(difference(answers[i], s, kLooseTolerance), i);
      valid += s.pdf_w > 0;
      const float pdf_w = twins.lights().pdf_w_environment(q.point, q.normal, q.direction);
      if (!near(answers[i].pdf_w_environment, pdf_w, kTolerance)) environment.add("density", i);
      const Rgb radiance = twins.lights().environment_radiance(q.direction);
      if (!near(answers[i].environment, radiance, kTolerance)) environment.add("radiance", i);
    }
    samples.expect_few(kIllConditioned, queries.size(), scene.name);
    loosely.expect_few(kOnBorders, queries.size(), scene.name + ": loosely");
    environment.expect_few(kOnBorders, queries.size(), scene.name + ": environment");
    EXPECT_EQ(valid > queries.size() / 20, !twins.lights().empty()) << scene.name;
  }
}

// What a device sampled, found again by a ray: the device's density is that of its sample and that of the host.
TEST_F(VulkanLights, DensitiesOfHitsAreThoseOfTheSamples) {
  for (const LightScene& scene : test::light_scenes()) {
    const Twins twins(scene, device());
    std::vector<LightQuery> queries = random_queries(2);
    const std::vector<LightAnswer> drawn = twins.ask(queries, false);
    std::size_t hits = 0, misses = 0;
    for (std::size_t i = 0; i < queries.size(); ++i) {
      LightQuery& q = queries[i];
      if (!(drawn[i].pdf_w > 0) || drawn[i].delta) continue;
      q.direction = drawn[i].direction;
      if (std::isinf(drawn[i].distance)) {
        ++misses;
        continue;
      }
      const auto hit = test::hit_at(twins.lights().emitters(), q.point, q.direction, drawn[i].distance);
      if (!hit || std::abs(hit->cos_light) < kGrazing) continue;  // rounding at edges
      ++hits;
      q.emitter = hit->emitter;
      q.distance = hit->distance;
      q.cos_light = hit->cos_light;
      q.uv = hit->uv;
    }
    const std::vector<LightAnswer> answers = twins.ask(queries, false);
    Disagreements areas, environment;
    for (std::size_t i = 0; i < queries.size(); ++i) {
      const LightQuery& q = queries[i];
      if (q.emitter != kNoLight) {
        const float pdf_w =
            twins.lights().pdf_w_area(q.point, q.normal, q.direction, q.emitter, q.distance, q.cos_light);
        if (!near(answers[i].pdf_w_area, pdf_w, kTolerance)) areas.add("density", i);
        if (!near(answers[i].pdf_w_area, drawn[i].pdf_w, 2 * kTolerance)) areas.add("density of the sample", i);
        const Rgb emitted = twins.lights().emitted(q.emitter, q.uv, q.cos_light);
        if (!near(answers[i].emitted, emitted, kTolerance)) areas.add("emission", i);
      } else if (drawn[i].pdf_w > 0 && std::isinf(drawn[i].distance) && !drawn[i].delta) {
        if (!near(answers[i].pdf_w_environment, drawn[i].pdf_w, 2e-6f)) environment.add("density of the sample", i);
        const float pdf_w = twins.lights().pdf_w_environment(q.point, q.normal, q.direction);
        if (!near(answers[i].pdf_w_environment, pdf_w, kTolerance)) environment.add("density", i);
        if (!near(answers[i].environment, drawn[i].radiance, 2e-6f)) environment.add("radiance", i);
      }
    }
    areas.expect_few(kOnBorders, queries.size(), scene.name + ": areas");
    environment.expect_few(kOnBorders, queries.size(), scene.name + ": environment");
    const bool has_areas = !twins.lights().parts().areas.empty();
    EXPECT_EQ(hits > 500, has_areas) << scene.name << " " << hits;
    EXPECT_EQ(misses > 500, twins.lights().parts().environment_light) << scene.name << " " << misses;
  }
}

// A map of 1024 x 512 texels, whose cells are 0.003 rad wide: a direction must not end up in its neighbour's cell,
// whose density may be a hundred thousand times smaller.
TEST_F(VulkanLights, DirectionsOfAnEnvironmentStayInTheirCells) {
  LightScene scene;
  scene.images = {test::sun_image(1024, 512)};
  scene.environment = test::sun_environment(0);
  const Twins twins(scene, device());
  std::vector<LightQuery> queries = random_queries(3);
  const std::vector<LightAnswer> drawn = twins.ask(queries, false);
  std::size_t in_sun = 0, moved = 0;
  for (std::size_t i = 0; i < queries.size(); ++i) {
    const LightSample s = twins.lights().sample(queries[i].point, queries[i].normal, 0, queries[i].u);
    ASSERT_LT(length(drawn[i].direction - s.direction), 2e-6f);
    const float pdf_w = twins.lights().pdf_w_environment(queries[i].point, queries[i].normal, drawn[i].direction);
    moved += !near(drawn[i].pdf_w, pdf_w, kTolerance);
    in_sun += s.radiance.x > 1000;
  }
  EXPECT_LE(moved, queries.size() / 1000);
  EXPECT_GT(in_sun, queries.size() / 20);
}

}  // namespace
}  // namespace helio
