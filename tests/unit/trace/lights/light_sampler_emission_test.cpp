// Rays that leave the lights bring what rays to the lights find; every density is the same whichever way the light
// point was found.
#include <gtest/gtest.h>

#include "renderer/trace/lights/light_sampler.h"
#include "renderer/trace/scene/scene_data.h"
#include "renderer/trace/scene/surface.h"
#include "tests/support/chi_square.h"
#include "tests/support/test_scenes.h"
#include "tests/unit/trace/lights/emission_cases.h"

namespace helio {
namespace {

using test::EmissionCase;
using test::EmissionCases;
using test::Estimate;
using test::Random;

EmissionSample draw(const LightSampler& lights, Random& random) {
  const float u_select = random.next_float();
  const V2f u_position = random.next_v2f();
  return lights.sample_emission(u_select, u_position, random.next_v2f());
}

V3f random_unit(Random& random) {
  const float z = 2 * random.next_float() - 1, phi = kTwoPi * random.next_float(), r = safe_sqrt(1 - z * z);
  return {r * std::cos(phi), r * std::sin(phi), z};
}

// ---- light that arrives --------------------------------------------------------------------------------------------

// A parallelogram that receives light on the side of its normal.
struct Patch {
  V3f corner, e1, e2;
  V3f normal() const { return normalize(cross(e1, e2)); }
  double area() const { return length(cross(V3d(e1), V3d(e2))); }
};

// Floor, two walls that face each other, and a slanted one that looks up at most of the lights.
const std::vector<Patch> kPatches = {{{-1.4f, -1.5f, -1.4f}, {0, 0, 2.8f}, {2.8f, 0, 0}},
                                     {{1.5f, -1, -1}, {0, 0, 2}, {0, 2, 0}},
                                     {{-1.5f, -1, -1}, {0, 2, 0}, {0, 0, 2}},
                                     {{-0.7f, -0.6f, -0.6f}, {0.2f, 0.3f, 1.2f}, {1.3f, -0.2f, 0.1f}}};

// Distance to the patch along a ray that meets its front; infinite where it does not.
double hit_patch(const Patch& patch, const EmissionSample& ray) {
  constexpr double kMiss = std::numeric_limits<double>::infinity();
  const V3d e1(patch.e1), e2(patch.e2), n = cross(e1, e2), d(ray.direction);
  const double facing = dot(n, d);
  if (!(facing < 0)) return kMiss;
  const V3d to_corner = V3d(patch.corner) - V3d(ray.origin);
  const double t = dot(n, to_corner) / facing;
  const V3d in_plane = d * t - to_corner;
  const double s = dot(cross(in_plane, e2), n) / length_squared(n), q = dot(cross(e1, in_plane), n) / length_squared(n);
  return t > 0 && s >= 0 && s < 1 && q >= 0 && q < 1 ? t : kMiss;
}

class Sum {
 public:
  void add(double value) {
    sum_ += value;
    squares_ += value * value;
  }
  Estimate over(int count, double scale = 1) const {
    Estimate e;
    e.mean = scale * sum_ / count;
    e.deviation = scale * std::sqrt(std::max(0.0, squares_ / count - (sum_ / count) * (sum_ / count)));
    e.standard_error = e.deviation / std::sqrt(double(count));
    return e;
  }

 private:
  double sum_ = 0, squares_ = 0;
};

// Mean irradiance of every patch, by the rays that reach it: what they weigh over the patch's area.
std::vector<Estimate> irradiance_from_emission(const LightSampler& lights, int count, std::uint64_t seed) {
  Random random(seed);
  std::vector<Sum> sums(kPatches.size());
  for (int i = 0; i < count; ++i) {
    const EmissionSample ray = draw(lights, random);
    if (!(ray.pdf_emission > 0)) continue;
    for (std::size_t p = 0; p < kPatches.size(); ++p) {
      const double distance = hit_patch(kPatches[p], ray);
      if (!std::isfinite(distance)) continue;
      sums[p].add(double(luminance(ray.weight)) * lights.range_window(ray.light, float(distance)));
    }
  }
  std::vector<Estimate> estimates;
  for (std::size_t p = 0; p < kPatches.size(); ++p) estimates.push_back(sums[p].over(count, 1 / kPatches[p].area()));
  return estimates;
}

// The same by next-event estimation at points of the patch.
Estimate irradiance_from_samples(const LightSampler& lights, const Patch& patch, int count, std::uint64_t seed) {
  Random random(seed);
  Sum sum;
  const V3f normal = patch.normal();
  for (int i = 0; i < count; ++i) {
    const V2f at = random.next_v2f();
    const float u_select = random.next_float();
    const LightSample s =
        lights.sample(patch.corner + patch.e1 * at.x + patch.e2 * at.y, normal, u_select, random.next_v2f());
    if (s.pdf_w > 0) sum.add(std::max(0.0, double(dot(normal, s.direction))) * luminance(s.radiance) / s.pdf_w);
  }
  return sum.over(count);
}

void expect_same_irradiance(const LightSampler& lights, int count, double relative_error, const std::string& name) {
  const std::vector<Estimate> emitted = irradiance_from_emission(lights, count, 21);
  std::vector<Estimate> sampled;
  double brightest = 0;
  for (const Patch& patch : kPatches) {
    sampled.push_back(irradiance_from_samples(lights, patch, count / 2, 22));
    brightest = std::max(brightest, sampled.back().mean);
  }
  EXPECT_GT(brightest, 0) << name;
  for (std::size_t p = 0; p < kPatches.size(); ++p) {
    const double error = std::hypot(emitted[p].standard_error, sampled[p].standard_error);
    EXPECT_NEAR(emitted[p].mean, sampled[p].mean, 3 * error) << name << ", patch " << p;
    if (sampled[p].mean < 0.2 * brightest) continue;  // few rays
    EXPECT_LT(error, relative_error * sampled[p].mean) << name << ", patch " << p;
  }
}

TEST(LightEmission, BringsTheIrradianceThatLightSamplesFind) {
  const EmissionCases cases;
  for (const EmissionCase& c : cases.all()) {
    const LightSampler lights(c.input);
    ASSERT_EQ(lights.light_count(), 1u) << c.name;
    const bool wide = c.name.find("around everything") != std::string::npos;  // few rays meet a patch
    expect_same_irradiance(lights, wide ? 2000000 : 400000, 0.02, c.name);
  }
}

TEST(LightEmission, BringsTheIrradianceOfAllLightsTogether) {
  const EmissionCases cases;
  for (const bool use_tree : {false, true}) {
    const LightSampler lights(cases.together(use_tree));
    EXPECT_EQ(lights.light_count(), cases.all().size() - 3);
    expect_same_irradiance(lights, 2000000, 0.03, use_tree ? "tree" : "power");
  }
}

// ---- densities -----------------------------------------------------------------------------------------------------

// Share of the light that an emitter's alpha lets it send, from the tests' own coordinates: uv is (s, t).
double coverage_at(const LightSampler::Input& input, const AreaEmitter& e, const V2f& st) {
  if (e.alpha == kOpaqueEmitter) return 1;
  const EmitterAlpha& a = input.alphas[e.alpha];
  double alpha = a.factor[0];
  if (e.shape == AreaEmitter::Shape::triangle) {
    alpha += (double(a.factor[1]) - a.factor[0]) * st.x + (double(a.factor[2]) - a.factor[0]) * st.y;
  }
  alpha *= input.textures->lookup(a.texture, st).w;
  return a.mask ? (alpha >= a.cutoff ? 1 : 0) : alpha;
}

// The emitter that is met at this distance, where there is no second one: lights may pass through each other.
std::optional<test::EmitterHit> only_hit(const std::vector<AreaEmitter>& emitters, const V3f& point,
                                         const V3f& direction, float distance) {
  std::optional<test::EmitterHit> only;
  for (std::uint32_t i = 0; i < emitters.size(); ++i) {
    std::optional<test::EmitterHit> hit = test::hit_emitter(emitters[i], point, direction);
    if (!hit || std::abs(hit->distance - distance) > 2e-4f * distance) continue;
    if (only) return std::nullopt;
    hit->emitter = i;
    only = hit;
  }
  return only;
}

// From a point on the ray, the light is looked back at.
struct LookBack {
  V3f point, normal;
  float distance = 0;
};

LookBack look_back(const EmissionSample& ray, Random& random) {
  LookBack back;
  back.distance = std::exp(3.5f * random.next_float() - 2);
  back.point = ray.origin + ray.direction * back.distance;
  back.normal = random.next_float() < 0.5f ? V3f(0, 0, 0) : random_unit(random);
  return back;
}

struct Compared {
  int areas = 0, delta = 0, environment = 0;
};

void compare_area(const LightSampler& lights, const LightSampler::Input& input, const EmissionSample& ray,
                  const LookBack& back, const std::string& name, Compared& compared) {
  const auto hit = only_hit(lights.emitters(), back.point, -ray.direction, back.distance);
  if (!hit || ray.cos_light < 0.03f) return;  // rounding at edges, grazing
  const AreaEmitter& e = lights.emitters()[hit->emitter];
  ASSERT_TRUE(ray.finite && !ray.delta);
  ASSERT_NEAR(std::abs(hit->cos_light), ray.cos_light, 1e-4f) << name;
  ASSERT_NEAR(lights.pdf_emission_area(hit->emitter, hit->cos_light), ray.pdf_emission, 3e-3 * ray.pdf_emission)
      << name;
  const Rgb emitted = lights.emitted(hit->emitter, hit->uv, hit->cos_light) * float(coverage_at(input, e, hit->uv));
  const Rgb sent = ray.weight * float(ray.pdf_emission / ray.cos_light);
  const bool masked = e.alpha != kOpaqueEmitter && input.alphas[e.alpha].mask;
  for (int k = 0; k < 3 && !masked; ++k) ASSERT_NEAR(sent[k], emitted[k], 5e-3f * (1 + emitted[k])) << name;
  const double direct = lights.pdf_w_direct(ray, back.point, back.normal);
  const double found =
      lights.pdf_w_area(back.point, back.normal, -ray.direction, hit->emitter, hit->distance, hit->cos_light);
  ASSERT_NEAR(direct, found, 5e-3 * found) << name << " from " << back.point;
  ++compared.areas;
}

// sample() until it returns the light of the ray: there is one direction to a delta light only.
void compare_delta(const LightSampler& lights, const EmissionSample& ray, const LookBack& back, Random& random,
                   const std::string& name, Compared& compared) {
  LightSample s;
  for (int i = 0; i < 2000 && !(s.light == ray.light && s.pdf_w > 0); ++i) {
    const float u_select = random.next_float();
    s = lights.sample(back.point, back.normal, u_select, random.next_v2f());
  }
  const double direct = lights.pdf_w_direct(ray, back.point, back.normal);
  if (!(s.pdf_w > 0 && s.light == ray.light)) {
    // Beyond its range; at the rim of a cone or a picture, where rounding decides; or hardly ever chosen.
    ASSERT_LT(direct, 0.01) << name;
    return;
  }
  ASSERT_TRUE(s.delta);
  ASSERT_LT(length(s.direction + ray.direction), 1e-4f) << name;
  ASSERT_NEAR(lights.pdf_emission(s), ray.pdf_emission, 1e-3 * ray.pdf_emission) << name;
  ASSERT_NEAR(direct, s.pdf_w, 1e-4 * s.pdf_w) << name;
  const float squared = ray.finite ? sqr(back.distance) : 1.0f;
  const float window = lights.range_window(ray.light, back.distance);
  // What is left without the density, selection included: the intensity.
  const Rgb expected = ray.weight * float(ray.pdf_emission) * (window / squared);
  for (int k = 0; k < 3; ++k) ASSERT_NEAR(s.radiance[k], expected[k], 1e-2f * expected[k] + 1e-3f / squared) << name;
  ++compared.delta;
}

void compare_environment(const LightSampler& lights, const EmissionSample& ray, const LookBack& back,
                         const std::string& name, Compared& compared) {
  const V3f outwards = -ray.direction;
  ASSERT_FALSE(ray.finite);
  ASSERT_NEAR(lights.pdf_emission_environment(outwards), ray.pdf_emission, 1e-4 * ray.pdf_emission) << name;
  const Rgb radiance = lights.environment_radiance(outwards);
  for (int k = 0; k < 3; ++k) ASSERT_NEAR(ray.weight[k] * ray.pdf_emission, radiance[k], 1e-4f * radiance[k]) << name;
  const double found = lights.pdf_w_environment(back.point, back.normal, outwards);
  ASSERT_NEAR(lights.pdf_w_direct(ray, back.point, back.normal), found, 1e-4 * found) << name;
  ++compared.environment;
}

Compared compare(const LightSampler::Input& input, int count, const std::string& name) {
  const LightSampler lights(input);
  Random random(31);
  Compared compared;
  for (int i = 0; i < count && !::testing::Test::HasFatalFailure(); ++i) {
    const EmissionSample ray = draw(lights, random);
    EXPECT_TRUE(ray.pdf_emission > 0 && ray.light < lights.light_count()) << name;
    const LookBack back = look_back(ray, random);
    if (ray.delta) {
      compare_delta(lights, ray, back, random, name, compared);
    } else if (ray.finite) {
      compare_area(lights, input, ray, back, name, compared);
    } else {
      compare_environment(lights, ray, back, name, compared);
    }
  }
  return compared;
}

TEST(LightEmission, DensitiesAreThoseOfTheOtherTechniques) {
  const EmissionCases cases;
  for (const EmissionCase& c : cases.all()) {
    constexpr int kCount = 3000;
    const Compared compared = compare(c.input, kCount, c.name);
    ASSERT_FALSE(HasFatalFailure()) << c.name;
    EXPECT_GT(compared.areas + compared.delta + compared.environment, kCount * 8 / 10) << c.name;
  }
  for (const bool use_tree : {false, true}) {
    const Compared compared = compare(cases.together(use_tree), 20000, use_tree ? "tree" : "power");
    ASSERT_FALSE(HasFatalFailure());
    EXPECT_GT(compared.areas, 2000);
    EXPECT_GT(compared.delta, 2000);
    EXPECT_GT(compared.environment, 150);
  }
}

// The light points that next-event estimation finds.
TEST(LightEmission, LightSamplesKnowTheDensityOfEmission) {
  const EmissionCases cases;
  for (const bool use_tree : {false, true}) {
    const LightSampler::Input input = cases.together(use_tree);
    const LightSampler lights(input);
    Random random(41);
    int areas = 0, environment = 0;
    for (int i = 0; i < 50000; ++i) {
      const V3f point = (random.next_float() + 0.3f) * random_unit(random);
      const float u_select = random.next_float();
      const LightSample s = lights.sample(point, V3f(0, 0, 0), u_select, random.next_v2f());
      if (!(s.pdf_w > 0)) {
        ASSERT_EQ(lights.pdf_emission(s), 0);
        continue;
      }
      const double density = lights.pdf_emission(s);
      if (std::isinf(s.distance) && !s.delta) {
        ASSERT_NEAR(density, lights.pdf_emission_environment(s.direction), 1e-6 * density);
        ++environment;
      }
      if (s.delta || std::isinf(s.distance)) continue;
      const auto hit = only_hit(lights.emitters(), point, s.direction, s.distance);
      if (!hit || std::abs(hit->cos_light) < 0.03f) continue;
      ASSERT_NEAR(lights.pdf_emission_area(hit->emitter, hit->cos_light), density, 3e-3 * density) << hit->emitter;
      ++areas;
    }
    EXPECT_GT(areas, 5000);
    EXPECT_GT(environment, 500);
  }
}

// Three lamps of power 1, 2 and 5: nine tenths of the choice by power, one evenly.
TEST(LightEmission, SelectsByPowerEvenWhereThereIsATree) {
  for (const bool use_tree : {false, true}) {
    LightSampler::Input input;
    for (const float radiance : {1.0f, 2.0f, 5.0f})
      test::add_quad(input.areas, {radiance, 0, 0}, {0.5f, 0, 0}, {0, 0.5f, 0}, radiance);
    input.use_tree = use_tree;
    const LightSampler lights(std::move(input));
    const int kCount = test::kChiSquareSamples;
    std::vector<double> observed(3), expected;
    for (const double power : {1.0, 2.0, 5.0}) expected.push_back(kCount * (0.9 * power / 8 + 0.1 / 3));
    Random random(51);
    for (int i = 0; i < kCount; ++i) {
      const EmissionSample ray = draw(lights, random);
      ASSERT_LT(ray.light, 3u);
      ++observed[ray.light];
      const double selection = expected[ray.light] / kCount;
      ASSERT_NEAR(ray.pdf_emission, selection / 0.25 * ray.cos_light / std::numbers::pi, 1e-4 * ray.pdf_emission);
    }
    const test::ChiSquareResult result = test::chi_square_test(observed, expected);
    EXPECT_TRUE(result.passes(test::kSignificance, 2)) << result.summary();
  }
}

// ---- directions and places -----------------------------------------------------------------------------------------

// Where the direction's density does not depend on the place, and is that of a hit over that of the place.
TEST(LightEmission, DirectionsFollowTheirDensity) {
  const EmissionCases cases;
  const double disk = std::numbers::pi * 3 * 4 * 1.0001 * 1.0001;  // half of the cube's diagonal, squared, is 12
  struct Case {
    std::string name;
    V3f axis;
    double scale;
    test::SphereDensity density;
  };
  std::vector<Case> tests;
  const LightSampler quad(cases.of("quad")), both(cases.of("two-sided parallelogram"));
  const double quad_area = 1, both_area = length(cross(V3d(0.1f, 0.8f, 0.1f), V3d(0, 0.1f, 0.9f)));
  const V3f down(0, -1, 0), front = both.emitters()[0].normal;
  tests.push_back(
      {"quad", down, 1, [&](const V3f& w) { return quad_area * quad.pdf_emission_area(0, dot(normalize(w), down)); }});
  // The place on either side, so both sides' areas.
  tests.push_back({"two-sided parallelogram", front, 1,
                   [&](const V3f& w) { return both_area * both.pdf_emission_area(0, dot(normalize(w), front)); }});
  const LightSampler constant(cases.of("constant environment")), mapped(cases.of("mapped environment"));
  tests.push_back({"constant environment", {0, 1, 0}, 1, [&](const V3f& w) {
                     return disk * constant.pdf_emission_environment(-normalize(w));
                   }});
  tests.push_back({"mapped environment", {0, 1, 0}, 1, [&](const V3f& w) {
                     return disk * mapped.pdf_emission_environment(-normalize(w));
                   }});
  // Delta lights: the density of a sample that next-event estimation found there.
  for (const char* name : {"point", "spot", "spot, linear", "projector", "skewed projector with a picture"}) {
    const auto lights = std::make_shared<LightSampler>(cases.of(name));
    const V3f position(cases.of(name).punctual[0].position), axis(cases.of(name).punctual[0].direction);
    tests.push_back({name, axis, 0.6, [lights, position](const V3f& w) {
                       return lights->pdf_emission(lights->sample(position + normalize(w), V3f(0, 0, 0), 0, V2f(0, 0)));
                     }});
  }
  std::uint64_t seed = 61;
  for (const Case& c : tests) {
    const LightSampler lights(cases.of(c.name));
    test::SphereHistogram histogram(c.axis, c.scale);
    Random random(seed++);
    for (int i = 0; i < test::kChiSquareSamples; ++i) histogram.add(draw(lights, random).direction);
    double mass = 0;
    const test::ChiSquareResult result = histogram.test(c.density, &mass);
    EXPECT_NEAR(mass, 1, 2e-3) << c.name;
    EXPECT_TRUE(result.passes(test::kSignificance, int(tests.size()))) << c.name << ": " << result.summary();
  }
}

// Rays from infinity start on a disk that the scene hides behind, evenly: rings of equal area, and sectors.
TEST(LightEmission, DisksCoverTheSceneEvenly) {
  const EmissionCases cases;
  for (const char* name : {"directional", "constant environment", "mapped environment"}) {
    LightSampler::Input input = cases.of(name);
    const V3f center(1, 2, 3);
    input.scene_bounds = Box3f(center - V3f(2, 1, 3), center + V3f(2, 1, 3));
    const LightSampler lights(std::move(input));
    const double radius = std::sqrt(14.0);
    constexpr int kRings = 10, kSectors = 20;
    const int kCount = test::kChiSquareSamples;
    std::vector<double> observed(kRings * kSectors), expected(observed.size(), double(kCount) / (kRings * kSectors));
    Random random(71);
    for (int i = 0; i < kCount; ++i) {
      const EmissionSample ray = draw(lights, random);
      const V3f local = Frame(ray.direction).to_local(ray.origin - center);
      ASSERT_LT(local.z, -radius) << name;  // the sphere around the scene is ahead
      ASSERT_GT(local.z, -1.001 * radius) << name;
      const double share = (double(local.x) * local.x + double(local.y) * local.y) / (14 * 1.0001 * 1.0001);
      ASSERT_LT(share, 1 + 1e-5) << name;
      const int ring = std::min(int(share * kRings), kRings - 1);
      const double turn = std::atan2(local.y, local.x) / (2 * std::numbers::pi) + 0.5;
      ++observed[std::size_t(ring * kSectors + std::min(int(turn * kSectors), kSectors - 1))];
    }
    const test::ChiSquareResult result = test::chi_square_test(observed, expected);
    EXPECT_TRUE(result.passes(test::kSignificance, 3)) << name << ": " << result.summary();
  }
}

// Wherever the scene is met, a ray from infinity may have come: the disk holds the corners of the bounds in every
// direction.
TEST(LightEmission, DisksHoldTheCornersOfTheScene) {
  const EmissionCases cases;
  const LightSampler lights(cases.of("directional"));
  const V3f direction(cases.of("directional").punctual[0].direction);
  Random random(72);
  double widest = 0;
  for (int i = 0; i < 100000; ++i) {
    const V3f origin = draw(lights, random).origin;
    widest = std::max(widest, double(length(cross(origin, direction))));
  }
  EXPECT_NEAR(widest, std::sqrt(12.0), 1e-3 * widest);
  EXPECT_GT(lights.sample_emission(0, {0, 0.5f}, {0, 0}).origin.length(), std::sqrt(24.0));  // its rim lies outside
}

// ---- surfaces of a scene -------------------------------------------------------------------------------------------

// Emitters placed twice stay instances: mirrored, sheared, their fronts as a ray finds them.
TEST(LightEmission, InstancesAreHitWhereRaysLeaveThem) {
  SceneDescription scene;
  Material lamp = test::lambert(Rgb(0), Rgb(3, 2, 1));
  lamp.double_sided = false;
  scene.materials = {lamp, test::lambert(Rgb(0), Rgb(1, 2, 3))};
  Object object;
  object.meshes = {test::quad({0, 0, 0}, {1, 0, 0}, {0, 0.2f, 1}, 0), test::quad({3, 0, 0}, {0, 1, 0}, {0, 0, 1}, 1)};
  object.spheres.push_back({V3f(0, 4, 0), 0.6f, 0});
  const int placed = test::add_object(scene, std::move(object));
  M44d mirrored, sheared;
  mirrored[0][0] = -1.5;
  mirrored[3][0] = -8;
  sheared[0][1] = 0.7;
  sheared[1][1] = 0.4;
  sheared[2][2] = -2;
  sheared[3][2] = 20;
  test::add_instance(scene, placed, mirrored);
  test::add_instance(scene, placed, sheared);
  const auto built = test::build(std::move(scene));
  ASSERT_TRUE(built);
  const SceneData& data = built->impl();
  ASSERT_EQ(data.instances.size(), 2u);
  const LightSampler& lights = *data.lights;
  ASSERT_EQ(lights.light_count(), 6u);
  Random random(81);
  std::vector<int> found(lights.light_count());
  constexpr int kRays = 6000;
  for (int i = 0; i < kRays; ++i) {
    const EmissionSample light = draw(lights, random);
    if (light.cos_light < 0.05f) continue;
    Ray ray;
    ray.origin = light.origin + light.direction * 0.5f;
    ray.direction = -light.direction;
    ray.t_max = std::numeric_limits<float>::infinity();
    Hit hit;
    const std::uint32_t order = 0;
    data.accel->intersect(&ray, &order, 1, &hit, RayOrder::scattered);
    if (!hit.valid() || std::abs(hit.t - 0.5f) > 1e-4f) continue;  // past an edge, by rounding
    const Surface surface = make_surface<true>(data, ray, hit);
    const std::uint32_t emitter = data.emitter(hit, data.part(hit));
    ASSERT_NE(emitter, kNoHit);
    const float cos_light = -dot(surface.geometric_normal, ray.direction);
    ASSERT_GT(dot(surface.geometric_normal, light.normal) * (surface.front ? 1.0f : -1.0f), 0.999f) << light.light;
    ASSERT_NEAR(std::abs(cos_light), light.cos_light, 2e-3f);
    ASSERT_NEAR(lights.pdf_emission_area(emitter, cos_light), light.pdf_emission, 0.04 * light.pdf_emission);
    const Rgb emitted = lights.emitted(emitter, {0, 0}, cos_light);
    const Rgb sent = light.weight * float(light.pdf_emission / light.cos_light);
    for (int k = 0; k < 3; ++k) ASSERT_NEAR(sent[k], emitted[k], 1e-4f * emitted[k]) << light.light;
    ++found[light.light];
  }
  int all = 0;
  for (const int n : found) {
    EXPECT_GT(n, 100);
    all += n;
  }
  EXPECT_GT(all, kRays * 9 / 10);
}

// ---- extremes ------------------------------------------------------------------------------------------------------

TEST(LightEmission, NothingLeavesWhereThereIsNoLight) {
  const LightSampler none(LightSampler::Input{});
  EXPECT_EQ(none.sample_emission(0.5f, {0.5f, 0.5f}, {0.5f, 0.5f}).pdf_emission, 0);
  EXPECT_EQ(none.pdf_emission_environment({0, 1, 0}), 0);
  EXPECT_EQ(none.pdf_emission(LightSample{}), 0);
  EXPECT_EQ(none.pdf_w_direct(EmissionSample{}, {0, 0, 0}, {0, 1, 0}), 0);

  LightSampler::Input in;
  in.areas = {test::triangle_emitter({0, 0, 0}, {1, 0, 0}, {0, 1, 0}, 0), test::sphere_emitter({0, 0, 0}, 0, 1),
              test::triangle_emitter({0, 0, 0}, {1, 0, 0}, {2, 0, 0}, 1)};
  const LightSampler dark(std::move(in));  // black, without extent, a needle
  EXPECT_EQ(dark.sample_emission(0.5f, {0.5f, 0.5f}, {0.5f, 0.5f}).pdf_emission, 0);
  for (std::uint32_t e = 0; e < 3; ++e) EXPECT_EQ(dark.pdf_emission_area(e, 1), 0) << e;
}

TEST(LightEmission, OneSidedLightsEmitOnTheirFront) {
  const EmissionCases cases;
  const LightSampler front(cases.of("quad")), both(cases.of("two-sided parallelogram"));
  EXPECT_GT(front.pdf_emission_area(0, 0.5f), 0);
  EXPECT_EQ(front.pdf_emission_area(0, -0.5f), 0);
  EXPECT_EQ(both.pdf_emission_area(0, 0.5f), both.pdf_emission_area(0, -0.5f));
  for (const LightSampler* lights : {&front, &both}) {
    EXPECT_EQ(lights->pdf_emission_area(0, 0), 0);
    EXPECT_EQ(lights->pdf_emission_area(0, std::nanf("")), 0);
    EXPECT_TRUE(std::isfinite(lights->pdf_emission_area(0, 1e-40f)));
  }
  // The ray leaves the other side than the point is on.
  const EmissionSample down = front.sample_emission(0, {0.5f, 0.5f}, {0.5f, 0.5f});
  EXPECT_LT(down.direction.y, 0);
  EXPECT_GT(front.pdf_w_direct(down, {0, -1, 0}, {0, 0, 0}), 0);
  EXPECT_EQ(front.pdf_w_direct(down, {0, 2, 0}, {0, 0, 0}), 0);
  EXPECT_EQ(front.pdf_w_direct(down, down.origin, {0, 0, 0}), 0);
}

TEST(LightEmission, RangeThinsTheLight) {
  const EmissionCases cases;
  const LightSampler endless(cases.of("point")), short_lived(cases.of("point with a range")), quad(cases.of("quad"));
  EXPECT_EQ(endless.range_window(0, 1e9f), 1);
  EXPECT_EQ(quad.range_window(0, 1e9f), 1);
  EXPECT_FLOAT_EQ(short_lived.range_window(0, 1.5f), 15.0f / 16);  // 1 - (1.5 / 3)^4
  EXPECT_EQ(short_lived.range_window(0, 3), 0);
  EXPECT_EQ(short_lived.range_window(0, 50), 0);
}

TEST(LightEmission, ExtremesStayFinite) {
  const EmissionCases cases;
  const float last = kOneMinusEpsilon;
  const V2f corners[] = {V2f(0, 0), V2f(last, last), V2f(0, last), V2f(last, 0), V2f(0.5f, 0.5f), V2f(0.5f, 0)};
  std::vector<LightSampler::Input> inputs = {cases.together(false), cases.together(true)};
  for (const EmissionCase& c : cases.all()) inputs.push_back(c.input);
  for (const char* name : {"directional", "constant environment", "mapped environment"}) {
    // One point; as far away as a coordinate may be, and as large.
    for (const Box3f& bounds :
         {Box3f(V3f(0), V3f(0)), Box3f(V3f(1e9f), V3f(1e9f)), Box3f(V3f(-1e9f), V3f(1e9f)), Box3f()}) {
      inputs.push_back(cases.of(name));
      inputs.back().scene_bounds = bounds;
    }
  }
  // A millimetre and a kilometre in a scene whose unit is either, radiances to match; a spot of a thousandth of a
  // degree.
  LightSampler::Input lamps;
  test::add_quad(lamps.areas, {0, 0, 0}, {1e-6f, 0, 0}, {0, 1e-6f, 0}, 1e9f);
  test::add_quad(lamps.areas, {1e9f, 0, 0}, {1e6f, 0, 0}, {0, 1e6f, 0}, 1e-9f, true);
  inputs.push_back(lamps);
  LightSampler::Input needle = cases.of("spot, linear");
  needle.punctual[0].inner_cone_angle = 0;
  needle.punctual[0].outer_cone_angle = 1.7e-5f;
  inputs.push_back(needle);
  for (const LightSampler::Input& input : inputs) {
    const LightSampler lights(input);
    for (const float u_select : {0.0f, 0.3f, 0.7f, last}) {
      for (const V2f& u_position : corners) {
        for (const V2f& u_direction : corners) {
          const EmissionSample ray = lights.sample_emission(u_select, u_position, u_direction);
          ASSERT_TRUE(std::isfinite(ray.pdf_emission) && ray.pdf_emission >= 0);
          if (ray.pdf_emission == 0) continue;
          ASSERT_TRUE(is_finite(ray.origin) && is_finite(ray.weight) && is_finite(ray.normal));
          ASSERT_NEAR(length(ray.direction), 1, 1e-4f);
          for (const V3f& point : {V3f(0, 0, 0), V3f(1e9f, -1e9f, 1), ray.origin, ray.origin + ray.direction}) {
            const double direct = lights.pdf_w_direct(ray, point, ray.normal);
            ASSERT_TRUE(std::isfinite(direct) && direct >= 0) << point;
          }
        }
      }
    }
  }
}

}  // namespace
}  // namespace helio
