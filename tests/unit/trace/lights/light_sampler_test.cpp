// The sampler as the integrator uses it: densities of samples and of hits agree for every kind of light and both ways
// of selecting, irradiances equal closed forms, selection is free when there is nothing to select.
#include "renderer/trace/lights/light_sampler.h"

#include <gtest/gtest.h>

#include "renderer/scene/images/environment.h"
#include "renderer/scene/images/texture.h"
#include "tests/support/chi_square.h"
#include "tests/unit/trace/lights/light_test_scenes.h"

namespace helio {
namespace {

using test::add_quad;
using test::Estimate;
using test::estimate_irradiance;
using test::Random;

// |mean - expected| within 4.5 standard errors, and those small enough to mean something.
void expect_estimate(const Estimate& e, double expected, double relative_error, const std::string& what) {
  EXPECT_NEAR(e.mean, expected, 4.5 * e.standard_error + 2e-4 * expected) << what;
  EXPECT_LE(e.standard_error, relative_error * expected) << what;
}

V3f random_unit(Random& random) {
  const float z = 2 * random.next_float() - 1, phi = kTwoPi * random.next_float(), r = safe_sqrt(1 - z * z);
  return {r * std::cos(phi), r * std::sin(phi), z};
}

V3f random_in_box(Random& random, float extent) {
  const float x = random.next_float(), y = random.next_float();
  return V3f(x, y, random.next_float()) * extent;
}

// A checkerboard of 4 x 4 texels, one of them bright: the emission of a sign.
Image sign_image() {
  Image image;
  image.width = image.height = 4;
  image.channels = 3;
  image.texels.assign(48, 10);
  for (int i = 0; i < 48; i += 9) image.texels[std::size_t(i)] = 200;
  return image;
}

Image sky_image() {
  Image image;
  image.width = 16;
  image.height = 8;
  image.channels = 1;
  image.texels.assign(128, 20);
  image.texels[37] = 255;
  return image;
}

// One light of every kind. Areas: a one-sided quad, a two-sided quad, a textured triangle, a skewed textured quad, a
// sphere, a two-sided sphere around everything, a textured sphere and ellipsoid.
struct EveryKind {
  std::vector<Image> images{sign_image(), sky_image()};
  TextureTable textures{images};
  Environment environment;

  EveryKind() {
    environment.image = 1;
    environment.radiance = Rgb(0.5f);
  }

  LightSampler::Input input(bool use_tree, bool infinite = true) {
    LightSampler::Input in;
    add_quad(in.areas, {0, 0, 3}, {0, 1, 0}, {1, 0, 0}, 5);
    add_quad(in.areas, {3, 0, 0}, {0, 1, 0.2f}, {0.1f, 0, 1}, 2, true);
    AreaEmitter triangle = test::triangle_emitter({-2, 0, 0}, {-2, 1, 0}, {-2, 0, 1}, 7);
    triangle.texture.image = 0;
    triangle.uv[1] = V2f(1, 0);
    triangle.uv[2] = V2f(0, 1);
    in.areas.push_back(triangle);
    const std::size_t first = in.areas.size();
    add_quad(in.areas, {0, -2, 0}, {1, 0, 0.3f}, {0.2f, 0, 1}, 3, true);
    for (std::size_t i = first; i < first + 2; ++i) {
      AreaEmitter& e = in.areas[i];
      e.texture.image = 0;
      const V2f uvs[2][3] = {{V2f(0, 0), V2f(1, 0), V2f(1, 1)}, {V2f(0, 0), V2f(1, 1), V2f(0, 1)}};
      for (int k = 0; k < 3; ++k) e.uv[k] = uvs[i - first][k];
    }
    in.areas.push_back(test::sphere_emitter({1, 3, 1}, 0.5f, 4));
    in.areas.push_back(test::sphere_emitter({0, 0, 0}, 40, 0.01f, true));
    for (AreaEmitter e : {test::sphere_emitter({-1, -1, 4}, 0.6f, 6),
                          test::ellipsoid_emitter({-3, 2, 1}, {0.3f, 0.2f, 0}, {0, 0.1f, 0.4f}, {0.2f, -0.4f, 0}, 9)}) {
      e.texture.image = 0;
      in.areas.push_back(e);
    }
    PunctualLight light;
    light.position = V3d(2, 2, 2);
    in.punctual.push_back(light);
    light.kind = PunctualKind::spot;
    light.direction = normalize(V3d(-1, -1, -1));
    in.punctual.push_back(light);
    light.kind = PunctualKind::projector;
    light.projection.depth = light.direction;
    light.projection.across = normalize(V3d(1, -1, 0)) * 0.5;
    light.projection.down = normalize(V3d(1, 1, -2)) * 0.5;
    light.projection.picture.image = 0;
    in.punctual.push_back(light);
    if (infinite) {
      light.kind = PunctualKind::directional;
      in.punctual.push_back(light);
      in.environment = &environment;
    }
    in.textures = &textures;
    in.scene_bounds = Box3f(V3f(-2), V3f(3));
    in.use_tree = use_tree;
    return in;
  }
};

// Every sample of an area light is found again by intersecting the lights: same radiance, same density.
TEST(LightSampler, HitAndSampleAgreeOnDensityAndRadiance) {
  EveryKind scene;
  for (const bool use_tree : {false, true}) {
    const LightSampler lights(scene.input(use_tree));
    EXPECT_EQ(lights.light_count(), 13u);  // 8 areas, 4 punctual, environment
    Random random(1);
    std::vector<int> found(lights.emitters().size());
    int environment = 0, delta = 0;
    for (int i = 0; i < 100000; ++i) {
      const V3f point = random_in_box(random, 3) - V3f(0.5f);
      const V3f normal = i % 2 == 0 ? V3f(0, 0, 0) : random_unit(random);
      const float u_select = random.next_float();
      const LightSample s = lights.sample(point, normal, u_select, random.next_v2f());
      if (!(s.pdf_w > 0)) continue;
      if (s.delta) {
        ++delta;
        continue;
      }
      if (std::isinf(s.distance)) {
        ASSERT_NEAR(lights.pdf_w_environment(point, normal, s.direction), s.pdf_w, 1e-4f * s.pdf_w);
        ASSERT_EQ(lights.environment_radiance(s.direction), s.radiance);
        ++environment;
        continue;
      }
      const auto hit = test::hit_at(lights.emitters(), point, s.direction, s.distance);
      if (!hit || std::abs(hit->cos_light) < 0.01f) continue;  // rounding at edges, grazing
      const float pdf_w = lights.pdf_w_area(point, normal, s.direction, hit->emitter, hit->distance, hit->cos_light);
      ASSERT_NEAR(std::abs(hit->cos_light), s.cos_light, 2e-3f) << "emitter " << hit->emitter;
      ASSERT_NEAR(pdf_w, s.pdf_w, 1e-4f * s.pdf_w) << "emitter " << hit->emitter << " point " << point;
      const Rgb emitted = lights.emitted(hit->emitter, hit->uv, hit->cos_light);
      for (int c = 0; c < 3; ++c) ASSERT_NEAR(emitted[c], s.radiance[c], 2e-3f * (1 + emitted[c])) << hit->emitter;
      ++found[hit->emitter];
    }
    for (std::size_t e = 0; e < found.size(); ++e) EXPECT_GT(found[e], 100) << "emitter " << e;
    EXPECT_GT(environment, 300);
    EXPECT_GT(delta, 1000);
  }
}

// A batch must not mix its queries up, nor lose those beyond what is asked for at once.
TEST(LightSampler, ManyPointsGetTheSamplesThatEachWouldGet) {
  EveryKind scene;
  for (const bool use_tree : {false, true}) {
    const LightSampler lights(scene.input(use_tree));
    Random random(21);
    std::vector<LightSampler::Query> queries(200);  // more than are asked for at once
    for (LightSampler::Query& query : queries) {
      query.point = random_in_box(random, 3);
      if (random.next_u32() % 4 != 0) query.normal = random_unit(random);
      query.u_select = random.next_float();
      query.u = V2f(random.next_float(), random.next_float());
    }
    std::vector<LightSample> samples(queries.size());
    lights.sample(queries, samples.data());
    std::size_t seen = 0;
    for (std::size_t i = 0; i < queries.size(); ++i) {
      const LightSampler::Query& q = queries[i];
      const LightSample alone = lights.sample(q.point, q.normal, q.u_select, q.u);
      EXPECT_EQ(samples[i].light, alone.light);
      EXPECT_EQ(samples[i].pdf_w, alone.pdf_w);
      EXPECT_EQ(samples[i].direction, alone.direction);
      EXPECT_EQ(samples[i].radiance, alone.radiance);
      EXPECT_EQ(samples[i].distance, alone.distance);
      seen += alone.pdf_w > 0;
    }
    EXPECT_GT(seen, queries.size() / 3);
  }
}

// The densities of all lights add up to the probability of a sample that is no delta: integrated by uniform directions.
TEST(LightSampler, DensitiesIntegrateToTheShareOfSamples) {
  EveryKind scene;
  const V3f point(0.4f, 0.3f, 0.8f), normal = normalize(V3f(0.2f, 0.4f, 1));
  for (const bool use_tree : {false, true}) {
    const LightSampler lights(scene.input(use_tree));
    Random random(2);
    constexpr int kCount = 400000;
    double valid = 0, integral = 0, squares = 0;
    for (int i = 0; i < kCount; ++i) {
      const float u_select = random.next_float();
      const LightSample s = lights.sample(point, normal, u_select, random.next_v2f());
      valid += s.pdf_w > 0 && !s.delta;
      const V3f w = random_unit(random);
      double sum = lights.pdf_w_environment(point, normal, w);
      for (std::uint32_t e = 0; e < lights.emitters().size(); ++e) {
        const auto hit = test::hit_emitter(lights.emitters()[e], point, w);
        if (hit) sum += lights.pdf_w_area(point, normal, w, e, hit->distance, hit->cos_light);
      }
      integral += 4 * kPi * sum;
      squares += sqr(float(4 * kPi * sum));
    }
    valid /= kCount;
    integral /= kCount;
    const double error = std::sqrt((squares / kCount - integral * integral + valid * (1 - valid)) / kCount);
    EXPECT_NEAR(integral, valid, 4.5 * error) << use_tree;
    EXPECT_LT(error, 0.02);
    EXPECT_GT(valid, 0.3);
  }
}

// The whole of it, selection and all, over the sphere of directions: lights that lie around the point, whose densities
// have no edges. Deltas belong elsewhere.
TEST(LightSampler, DirectionsFollowTheDensity) {
  EveryKind scene;
  LightSampler::Input input = scene.input(false);
  input.areas = {test::sphere_emitter({0, 0, 0}, 40, 0.01f, true),
                 test::ellipsoid_emitter({0.1f, 0, 0}, {5, 1, 0}, {-1, 4, 0}, {0, 0.5f, 6}, 0.4f, true),
                 test::sphere_emitter({1, -1, 0.5f}, 3, 0.7f, true)};
  const V3f point(0.4f, 0.3f, 0.8f);
  int tests = 0;
  for (const V3f& normal : {V3f(0, 0, 0), normalize(V3f(0.2f, 0.4f, 1))}) {
    for (const bool use_tree : {false, true}) {
      input.use_tree = use_tree;
      const LightSampler lights(input);
      test::SphereHistogram histogram({0, 1, 0}, 1);
      Random random(std::uint64_t(81 + tests++));
      for (int i = 0; i < test::kChiSquareSamples; ++i) {
        const float u_select = random.next_float();
        const LightSample s = lights.sample(point, normal, u_select, random.next_v2f());
        s.pdf_w > 0 && !s.delta ? histogram.add(s.direction) : histogram.add_elsewhere();
      }
      double mass = 0;
      const test::ChiSquareResult result = histogram.test(
          [&](const V3f& w) {
            double sum = lights.pdf_w_environment(point, normal, w);
            for (std::uint32_t e = 0; e < lights.emitters().size(); ++e) {
              const auto hit = test::hit_emitter(lights.emitters()[e], point, w);
              if (hit) sum += lights.pdf_w_area(point, normal, w, e, hit->distance, hit->cos_light);
            }
            return sum;
          },
          &mass);
      EXPECT_NEAR(mass, histogram.share(), 3e-3) << use_tree;
      EXPECT_GT(mass, 0.3);
      EXPECT_TRUE(result.passes(test::kSignificance, 4)) << use_tree << ' ' << normal << ": " << result.summary();
    }
  }
}

TEST(LightSampler, SingleQuadMatchesLambertsFormulaAndSelectsForFree) {
  LightSampler::Input in;
  const V3f a(0.213f, 0.5488f, 0.227f), e1(0.13f, 0, 0), e2(0, 0, 0.105f);
  add_quad(in.areas, a, e1, e2, 17);  // e1 x e2 looks down
  in.use_tree = true;
  const LightSampler lights(std::move(in));
  EXPECT_EQ(lights.light_count(), 1u);
  EXPECT_FALSE(lights.needs_selection());
  EXPECT_NEAR(lights.emitters()[0].power + lights.emitters()[1].power, kPi * 17 * 0.13 * 0.105, 1e-3);
  for (const V3f& point : {V3f(0.28f, 0, 0.28f), V3f(0.5f, 0.01f, 0.1f), V3f(0.28f, 0.5f, 0.28f)}) {
    const V3f normal(0, 1, 0);
    const double expected = 17 * test::quad_irradiance(a, e1, e2, point, normal);
    expect_estimate(estimate_irradiance(lights, point, normal, 200000, 3), expected, 3e-3, "quad");
  }
  EXPECT_EQ(lights.sample({0.28f, 0.6f, 0.28f}, {0, 0, 0}, 0.5f, {0.5f, 0.5f}).pdf_w, 0);  // above it
}

TEST(LightSampler, PunctualLightsAreExact) {
  LightSampler::Input in;
  PunctualLight light;
  light.position = V3d(0, 2, 0);
  light.intensity = Rgb(8);
  in.punctual = {light};
  const LightSampler lights(std::move(in));
  const Estimate e = estimate_irradiance(lights, {0, 0, 0}, {0, 1, 0}, 10, 4);
  EXPECT_FLOAT_EQ(float(e.mean), 2);  // I / d^2
  EXPECT_EQ(e.deviation, 0);
  EXPECT_TRUE(lights.sample({0, 0, 0}, {0, 1, 0}, 0.5f, {0.5f, 0.5f}).delta);
}

TEST(LightSampler, BothSelectionsGiveTheSumOfTheLights) {
  EveryKind scene;
  const V3f points[] = {V3f(0.5f, 0.5f, 0.5f), V3f(0, 0, 2.6f), V3f(2.5f, 0.5f, 0.4f)};
  for (const V3f& point : points) {
    const V3f normal = normalize(V3f(0.3f, 0.5f, 1));
    // Each light on its own: no selection in the way.
    double expected = 0, variance = 0;
    const LightSampler::Input all = scene.input(false);
    const auto alone = [&](LightSampler::Input one) {
      one.textures = all.textures;
      one.scene_bounds = all.scene_bounds;
      const Estimate e = estimate_irradiance(LightSampler(std::move(one)), point, normal, 40000, 5);
      expected += e.mean;
      variance += sqr(float(e.standard_error));
    };
    for (const AreaEmitter& area : all.areas) {
      LightSampler::Input one;
      one.areas = {area};
      alone(std::move(one));
    }
    for (const PunctualLight& light : all.punctual) {
      LightSampler::Input one;
      one.punctual = {light};
      alone(std::move(one));
    }
    LightSampler::Input sky;
    sky.environment = all.environment;
    alone(std::move(sky));

    for (const bool use_tree : {false, true}) {
      for (const bool pass_normal : {false, true}) {
        const LightSampler lights(scene.input(use_tree));
        const Estimate e = estimate_irradiance(lights, point, normal, 400000, 6, pass_normal);
        EXPECT_NEAR(e.mean, expected, 4.5 * std::sqrt(variance + e.standard_error * e.standard_error))
            << point << " tree " << use_tree << " normal " << pass_normal;
        EXPECT_LT(e.standard_error, 0.01 * expected);
      }
    }
  }
}

// A room whose every wall emits 1: pi everywhere inside, whatever the selection.
TEST(LightSampler, FurnaceOfQuads) {
  for (const bool use_tree : {false, true}) {
    LightSampler::Input in;
    const V3f x(2, 0, 0), y(0, 3, 0), z(0, 0, 4), o(0, 0, 0);
    add_quad(in.areas, o, x, y, 1);
    add_quad(in.areas, o, y, z, 1);
    add_quad(in.areas, o, z, x, 1);
    add_quad(in.areas, z, y, x, 1);
    add_quad(in.areas, x, z, y, 1);
    add_quad(in.areas, y, x, z, 1);
    in.use_tree = use_tree;
    const LightSampler lights(std::move(in));
    EXPECT_EQ(lights.light_count(), 6u);
    Random random(7);
    for (int p = 0; p < 5; ++p) {
      const V3f point(0.1f + 1.8f * random.next_float(), 0.1f + 2.8f * random.next_float(), 2);
      expect_estimate(estimate_irradiance(lights, point, random_unit(random), 200000, 8), kPi, 0.01, "furnace");
    }
  }
}

TEST(LightSampler, ConstantEnvironmentIsAFurnace) {
  Environment environment;
  environment.radiance = Rgb(2);
  LightSampler::Input in;
  in.environment = &environment;
  const LightSampler lights(std::move(in));
  const V3f normal = normalize(V3f(1, -2, 0.5f));
  const Estimate with_normal = estimate_irradiance(lights, {0, 0, 0}, normal, 1000, 9);
  EXPECT_NEAR(with_normal.mean, 2 * kPi, 1e-4);
  EXPECT_LT(with_normal.deviation, 1e-4);  // cosine-distributed: every sample is exact
  expect_estimate(estimate_irradiance(lights, {0, 0, 0}, normal, 400000, 9, false), 2 * kPi, 3e-3, "sphere");
  EXPECT_EQ(lights.environment_radiance({0, 1, 0}), Rgb(2));
  EXPECT_EQ(lights.pdf_w_environment({0, 0, 0}, normal, -normal), 0);

  for (const V3f& n : {normal, V3f(0, 0, 0)}) {
    test::SphereHistogram histogram(normal);
    Random random(10);
    for (int i = 0; i < 1000000; ++i) histogram.add(lights.sample({0, 0, 0}, n, 0, random.next_v2f()).direction);
    const test::ChiSquareResult result = histogram.test([&](const V3f& w) {
      return double(lights.pdf_w_environment({0, 0, 0}, n, w));
    });
    EXPECT_TRUE(result.passes(test::kSignificance, 2)) << result.summary();
  }
}

// A lamp that is a picture: irradiance is that of many small lamps, one for each cell of the picture.
TEST(LightSampler, TexturedEmissionMatchesItsCells) {
  EveryKind scene;
  LightSampler::Input in = scene.input(false, false);
  const V3f a(0, -2, 0), e1(1, 0, 0.3f), e2(0.2f, 0, 1);
  in.areas = {in.areas[5], in.areas[6]};
  in.punctual.clear();
  const TextureSlot slot = in.areas[0].texture;
  const LightSampler lights(std::move(in));
  ASSERT_EQ(lights.light_count(), 1u);
  const V3f point(0.3f, 1, 0.4f), normal = normalize(V3f(0.1f, -1, 0));
  double expected = 0;
  constexpr int kCells = 64;
  for (int y = 0; y < kCells; ++y) {
    for (int x = 0; x < kCells; ++x) {
      const V2f st((float(x) + 0.5f) / kCells, (float(y) + 0.5f) / kCells);
      const V3f corner = a + e1 * (float(x) / kCells) + e2 * (float(y) / kCells);
      expected += 3 * double(scene.textures.lookup(slot, st).x) *
                  test::quad_irradiance(corner, e1 * (1.0f / kCells), e2 * (1.0f / kCells), point, normal);
    }
  }
  const Estimate e = estimate_irradiance(lights, point, normal, 400000, 11);
  EXPECT_NEAR(e.mean, expected, 4.5 * e.standard_error + 2e-3 * expected);
}

TEST(LightSampler, EmissionLeavesOneSideUnlessTwoSided) {
  LightSampler::Input in;
  add_quad(in.areas, {0, 0, 0}, {1, 0, 0}, {0, 1, 0}, 3);
  add_quad(in.areas, {0, 0, 1}, {1, 0, 0}, {0, 1, 0}, 4, true);
  const LightSampler lights(std::move(in));
  EXPECT_EQ(lights.emitted(0, {0, 0}, 0.5f), Rgb(3));
  EXPECT_EQ(lights.emitted(0, {0, 0}, -0.5f), Rgb(0));
  EXPECT_EQ(lights.emitted(2, {0, 0}, -0.5f), Rgb(4));
}

TEST(LightSampler, NothingToSample) {
  const LightSampler none(LightSampler::Input{});
  EXPECT_TRUE(none.empty());
  EXPECT_EQ(none.light_count(), 0u);
  EXPECT_EQ(none.sample({0, 0, 0}, {0, 1, 0}, 0.5f, {0.5f, 0.5f}).pdf_w, 0);
  EXPECT_EQ(none.pdf_w_environment({0, 0, 0}, {0, 1, 0}, {0, 1, 0}), 0);
  EXPECT_EQ(none.environment_radiance({0, 1, 0}), Rgb(0));

  // Black lights and needles are none either, but can still be hit.
  Environment black;
  black.radiance = Rgb(0);
  LightSampler::Input in;
  in.areas = {test::triangle_emitter({0, 0, 0}, {1, 0, 0}, {0, 1, 0}, 0), test::sphere_emitter({0, 0, 0}, 0, 1)};
  in.punctual.resize(1);
  in.punctual[0].intensity = Rgb(0);
  in.environment = &black;
  const LightSampler dark(std::move(in));
  EXPECT_TRUE(dark.empty());
  EXPECT_EQ(dark.pdf_w_area({0, 0, 1}, {0, 0, 0}, {0, 0, -1}, 0, 1, 1), 0);
  EXPECT_EQ(dark.pdf_w_area({0, 0, 1}, {0, 0, 0}, {0, 0, -1}, 1, 1, 1), 0);
  EXPECT_EQ(dark.emitters()[0].power, 0);
}

// Radiance from 1e-6 to 1e9 in one scene: the weak lamp is still sampled, nothing overflows.
TEST(LightSampler, ExtremeRadiances) {
  for (const bool use_tree : {false, true}) {
    LightSampler::Input in;
    add_quad(in.areas, {0, 0, 0}, {1, 0, 0}, {0, 1, 0}, 1e-6f);
    add_quad(in.areas, {500, 0, 0}, {1, 0, 0}, {0, 1, 0}, 1e9f);
    add_quad(in.areas, {0, 500, 0}, {1e-4f, 0, 0}, {0, 1e-4f, 0}, 1);
    in.use_tree = use_tree;
    const LightSampler lights(std::move(in));
    for (const V3f& point : {V3f(0.5f, 0.5f, 1), V3f(0.5f, 0.5f, 1e-6f), V3f(1e7f, 1e7f, 1e6f), V3f(0, 500, 1e-5f)}) {
      for (const float u : {0.0f, 0.25f, 0.5f, 0.75f, kOneMinusEpsilon}) {
        const LightSample s = lights.sample(point, {0, 0, -1}, u, {u, u});
        EXPECT_TRUE(std::isfinite(s.pdf_w) && is_finite(s.direction) && is_finite(s.radiance)) << point;
      }
      for (std::uint32_t e = 0; e < 6; ++e)
        EXPECT_TRUE(std::isfinite(lights.pdf_w_area(point, {0, 0, -1}, {0, 0, -1}, e, 1, 1)));
    }
    EXPECT_GT(lights.pdf_w_area({0.5f, 0.5f, 1}, {0, 0, -1}, {0, 0, -1}, 0, 1, 1), 0);
  }
}

// 10,000 small lamps under a ceiling, unoccluded irradiance on the floor: the tree's estimate has a small variance
// where selection by power has to find the near ones by luck. The closed form is the sum over all lamps.
TEST(LightSampler, TreeHandlesTenThousandLights) {
  constexpr int kLights = 10000;
  const auto make = [&](bool use_tree) {
    Random random(12);
    LightSampler::Input in;
    for (int i = 0; i < kLights; ++i) {
      const V3f corner(10 * random.next_float(), 3, 10 * random.next_float());
      const float radiance = std::exp(4 * random.next_float());
      add_quad(in.areas, corner, {0.02f, 0, 0}, {0, 0, 0.02f}, radiance);
    }
    in.use_tree = use_tree;
    in.scene_bounds = Box3f(V3f(0), V3f(10, 3, 10));
    return in;
  };
  const LightSampler::Input reference = make(false);
  const LightSampler power(make(false)), tree(make(true));
  double gain = 0;
  const V3f points[] = {V3f(5, 0, 5), V3f(0.5f, 2.5f, 0.5f), V3f(7, 2.9f, 3)};
  for (const V3f& point : points) {
    const V3f normal(0, 1, 0);
    double expected = 0;
    for (std::size_t i = 0; i < reference.areas.size(); i += 2) {
      const AreaEmitter& e = reference.areas[i];
      expected += double(e.radiance.x) * test::quad_irradiance(e.p0, {0.02f, 0, 0}, {0, 0, 0.02f}, point, normal);
    }
    const Estimate by_tree = estimate_irradiance(tree, point, normal, 100000, 13);
    const Estimate by_power = estimate_irradiance(power, point, normal, 100000, 13);
    expect_estimate(by_tree, expected, 0.01, "tree");
    EXPECT_NEAR(by_power.mean, expected, 4.5 * by_power.standard_error);
    const double ratio = sqr(float(by_power.deviation / by_tree.deviation));
    gain += std::log(ratio) / std::size(points);
    EXPECT_GT(ratio, 1.5) << point;
    RecordProperty("relative_variance_tree_" + std::to_string(&point - points),
                   std::to_string(sqr(float(by_tree.deviation / expected))));
    RecordProperty("relative_variance_power_" + std::to_string(&point - points),
                   std::to_string(sqr(float(by_power.deviation / expected))));
  }
  EXPECT_GT(std::exp(gain), 5);
  EXPECT_LT(tree.memory_bytes(), std::size_t(kLights) * 1500);
}

}  // namespace
}  // namespace helio
