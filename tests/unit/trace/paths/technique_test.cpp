// Pictures of one bidirectional technique each: what they add up to, and that each by itself is an estimate of the
// same.
#include "renderer/trace/paths/technique.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "tests/support/small_rooms.h"

namespace helio::test {
namespace {

constexpr int kWidth = 24, kHeight = 20;  // more than one block, cut off on two sides

struct View {
  std::shared_ptr<const RenderScene> scene;
  CameraPose pose;
};

View diffuse_room() {
  return {build(lambert_room()), camera_at({0.7, 0.5, 0.9}, {-0.2, -0.2, -0.3}, 80)};
}
// Glass, metal, alpha, instances and a point light, through a lens.
View everything_through_a_lens() {
  View view{build(mixed_scene()), camera_at({0.7, 0.5, 0.9}, {-0.2, -0.2, -0.3}, 80)};
  view.pose.lens_radius = 0.05;
  view.pose.focus_distance = 1.2;
  return view;
}
// A sphere of absorbing glass in the diffuse room.
View absorbing_room() {
  SceneDescription scene = lambert_room();
  Material dark = glass(1.5f);
  dark.attenuation_color = Rgb(0.3f, 0.6f, 0.9f);
  dark.attenuation_distance = 0.4f;
  scene.materials.push_back(dark);
  add_sphere(scene, {0.4f, -0.4f, 0.2f}, 0.4f, 2);
  return {build(std::move(scene)), camera_at({0.7, 0.5, 0.9}, {0, -0.2, -0.2}, 80)};
}
View sky() {
  SceneDescription scene;
  scene.materials = {lambert(Rgb(0.6f, 0.5f, 0.4f))};
  add_mesh(scene, box({-0.5f, -0.5f, -0.5f}, {0.5f, 0.5f, 0.5f}, 0));
  add_mesh(scene, quad({-2, -0.5f, 2}, {4, 0, 0}, {0, 0, -4}, 0));
  scene.environment = Environment{};
  return {build(std::move(scene)), camera_at({1.5, 1, 2.5}, {0, 0, 0}, 45)};
}

struct Rendered {
  std::vector<V3d> pixels;  // means of both halves
  std::uint64_t rays = 0;

  double mean() const {
    double sum = 0;
    for (const V3d& p : pixels) sum += (p.x + p.y + p.z) / 3;
    return sum / double(pixels.size());
  }
};

Rendered render(const View& view, const PathSettings& settings, std::uint32_t samples) {
  FilmState state;
  state.splats = true;
  Film film(kWidth, kHeight, state);
  const Camera camera(view.pose, kWidth, kHeight, view.scene->origin(), PixelFilter{});
  const CancelToken never;
  TraceStats stats;
  for (int half = 0; half < kHalves; ++half) {
    EXPECT_TRUE(trace_window(*view.scene, camera, settings, {half, 0, samples}, film.bounds(), never, film, stats));
  }
  EXPECT_EQ(stats.invalid_samples, 0u);
  EXPECT_EQ(film.splats()->invalid_in(film.bounds()), 0u);
  Rendered rendered;
  rendered.rays = stats.rays;
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      V3d mean(0, 0, 0);
      for (int half = 0; half < kHalves; ++half) {
        const HalfPixel& pixel = film.half(half, x, y);
        const Rgb splats = film.splats()->mean(half, x, y);
        for (int c = 0; c < 3; ++c) mean[c] += (pixel.sum[c] / samples + splats[c]) / kHalves;
      }
      rendered.pixels.push_back(mean);
    }
  }
  return rendered;
}

PathSettings settings_of(int max_segments, std::uint64_t seed = 7) {
  PathSettings settings;
  settings.max_segments = max_segments;
  settings.seed = seed;
  settings.integrator = Integrator::bdpt;
  return settings;
}

std::vector<Technique> techniques_up_to(int max_segments) {
  std::vector<Technique> all;
  for (int segments = 1; segments <= max_segments; ++segments) {
    for (int s = 0; s <= segments; ++s) {
      const Technique technique{s, segments + 1 - s, false};
      if (technique.exists()) all.push_back(technique);
    }
  }
  return all;
}

struct NamedView {
  const char* name;
  View (*make)();
};
void PrintTo(const NamedView& view, std::ostream* out) {
  *out << view.name;
}

class Techniques : public testing::TestWithParam<NamedView> {};

// The random numbers of a technique's picture are those of the whole.
TEST_P(Techniques, AddUpToThePictureOfAll) {
  const View view = GetParam().make();
  constexpr int kMaxSegments = 5;
  constexpr std::uint32_t kSamples = 4;
  PathSettings settings = settings_of(kMaxSegments);
  const Rendered all = render(view, settings, kSamples);
  ASSERT_GT(all.mean(), 0);
  std::vector<V3d> sum(all.pixels.size(), V3d(0, 0, 0));
  int shown = 0;
  for (const Technique& technique : techniques_up_to(kMaxSegments)) {
    SCOPED_TRACE(testing::Message() << "s " << technique.light_vertices << ", t " << technique.camera_vertices);
    settings.technique = technique;
    const Rendered weighted = render(view, settings, kSamples);
    EXPECT_LT(weighted.rays, all.rays);
    settings.technique->unweighted = true;
    const Rendered unweighted = render(view, settings, kSamples);
    EXPECT_EQ(weighted.rays, unweighted.rays);
    for (std::size_t p = 0; p < sum.size(); ++p) {
      sum[p] += weighted.pixels[p];
      // No weight is more than 1.
      for (int c = 0; c < 3; ++c) EXPECT_LE(weighted.pixels[p][c], unweighted.pixels[p][c] * (1 + 1e-5) + 1e-7) << p;
    }
    shown += weighted.mean() > 0;
    if (technique.segments() > 1 && weighted.mean() > 0) {
      EXPECT_LT(weighted.mean(), 0.999 * unweighted.mean());
    }
  }
  EXPECT_GE(shown, 10) << "most techniques find something";
  for (std::size_t p = 0; p < sum.size(); ++p) {
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(sum[p][c], all.pixels[p][c], 1e-5 * (all.pixels[p][c] + all.mean())) << p;
  }
}

// The integrator `light` is lights seen directly and all that has one camera vertex, unweighted.
TEST_P(Techniques, OfOneCameraVertexAreLightTracing) {
  const View view = GetParam().make();
  constexpr int kMaxSegments = 4;
  PathSettings settings = settings_of(kMaxSegments);
  settings.technique = Technique{0, 2, true};
  std::vector<V3d> sum = render(view, settings, 8).pixels;
  for (int s = 2; s <= kMaxSegments; ++s) {
    settings.technique = Technique{s, 1, true};
    const Rendered one = render(view, settings, 8);
    EXPECT_GT(one.mean(), 0) << s;
    for (std::size_t p = 0; p < sum.size(); ++p) sum[p] += one.pixels[p];
  }
  settings.technique.reset();
  settings.integrator = Integrator::light;
  const Rendered light = render(view, settings, 8);
  for (std::size_t p = 0; p < sum.size(); ++p) {
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(sum[p][c], light.pixels[p][c], 1e-5 * (sum[p][c] + light.mean())) << p;
  }
}

INSTANTIATE_TEST_SUITE_P(All, Techniques,
                         testing::Values(NamedView{"DiffuseRoom", diffuse_room},
                                         NamedView{"EverythingThroughALens", everything_through_a_lens},
                                         NamedView{"AbsorbingRoom", absorbing_room}, NamedView{"Sky", sky}),
                         [](const auto& info) { return std::string(info.param.name); });

// Means of pictures by one technique alone, each over 48 seeds, and that they agree.
void expect_alike(const View& view, const std::vector<Technique>& techniques, double largest_error = 0.02) {
  constexpr int kSeeds = 48;
  std::vector<double> means, errors;
  for (const Technique& technique : techniques) {
    double sum = 0, squares = 0;
    for (int seed = 1; seed <= kSeeds; ++seed) {
      PathSettings settings = settings_of(technique.segments(), std::uint64_t(seed));
      settings.technique = technique;
      const double mean = render(view, settings, 8).mean();
      sum += mean;
      squares += mean * mean;
    }
    means.push_back(sum / kSeeds);
    errors.push_back(std::sqrt((squares / kSeeds - means.back() * means.back()) / (kSeeds - 1)));
    std::printf("  s %d, t %d: %.5f +- %.5f\n", technique.light_vertices, technique.camera_vertices, means.back(),
                errors.back());
    EXPECT_LT(errors.back(), largest_error * means.back()) << "too noisy to tell";
  }
  for (std::size_t a = 0; a < means.size(); ++a) {
    for (std::size_t b = 0; b < a; ++b) {
      EXPECT_LE(std::abs(means[a] - means[b]), 3 * std::hypot(errors[a], errors[b]))
          << "s " << techniques[a].light_vertices << " and " << techniques[b].light_vertices;
    }
  }
}

std::vector<Technique> all_alone(int segments) {
  std::vector<Technique> all;
  for (int s = 0; s <= segments; ++s) all.push_back({s, segments + 1 - s, true});
  return all;
}

// Each technique by itself makes all paths of a diffuse room with an area light.
TEST(TechniquesAlone, AgreeWhereAllCanMakeThePaths) {
  for (const int segments : {2, 3}) expect_alike(diffuse_room(), all_alone(segments));
}

// A floor that is lit by way of a panel above it alone, all of whose vertex normals lean towards the lamp: what the
// factor of shading normals is of a light path there, a quarter or so, does not average out.
View under_a_leaning_panel(const Material& panel) {
  SceneDescription scene;
  scene.materials = {lambert(Rgb(0.7f, 0.6f, 0.5f)), lambert(Rgb(0, 0, 0), Rgb(9, 8, 7)), panel};
  scene.materials[1].double_sided = false;
  add_mesh(scene, quad({-1, -1, 1}, {1.8f, 0, 0}, {0, 0, -2}, 0));
  add_mesh(scene, quad({1, -0.9f, 0.4f}, {0.8f, 0, 0}, {0, 0, -0.8f}, 1));
  TriangleMesh mesh = quad({-1, 1, -1}, {2, 0, 0}, {0, 0, 2}, 2);
  mesh.normals.assign(4, normalize(V3f(0.3f, -1, 0)));
  add_mesh(scene, mesh);
  return {build(std::move(scene)), camera_at({-0.1, 0.5, 0}, {-0.1, -1, 0.01}, 45)};
}

TEST(TechniquesAlone, AgreeWhereNormalsLean) {
  expect_alike(under_a_leaning_panel(lambert(Rgb(0.8f, 0.8f, 0.8f))), all_alone(3), 0.03);
}

// Mirrors are joined to nothing: light comes by way of this one from both ends alone.
TEST(TechniquesAlone, AgreeWhereAMirrorsNormalsLean) {
  Material mirror;
  mirror.metallic = 1;
  mirror.roughness = 0;
  mirror.base_color = Rgb(0.9f, 0.9f, 0.9f);
  expect_alike(under_a_leaning_panel(mirror), {{0, 4, true}, {3, 1, true}});
}

TEST(TechniqueValues, OnesThatDoNotExist) {
  EXPECT_TRUE((Technique{0, 2}.exists()));
  EXPECT_TRUE((Technique{2, 1}.exists()));
  EXPECT_TRUE((Technique{1, 2}.exists()));
  EXPECT_FALSE((Technique{1, 1}.exists()));
  EXPECT_FALSE((Technique{0, 1}.exists()));
  EXPECT_FALSE((Technique{2, 0}.exists()));
  EXPECT_FALSE((Technique{-1, 3}.exists()));
  EXPECT_EQ((Technique{3, 2}.segments()), 4);
}

}  // namespace
}  // namespace helio::test
