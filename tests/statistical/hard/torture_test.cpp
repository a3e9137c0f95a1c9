// No NaN and no Inf: the torture set, scenes thrown together at random from what is allowed but extreme. A short run of
// it here; HELIO_TORTURE_SAMPLES=1e9 for the long one, whose outcome tests/README.md tells. Half of the scenes are
// rendered with light paths, of which no splat may be invalid either.
#include <gtest/gtest.h>

#include <cstdlib>
#include <string>

#include "renderer/film/light_tiles.h"
#include "renderer/trace/sample_trace.h"
#include "tests/support/light_cache.h"
#include "tests/support/random.h"
#include "tests/support/test_scenes.h"

namespace helio::test {
namespace {

constexpr int kWidth = 2 * kLightTile, kHeight = 16;
constexpr std::uint32_t kSamplesPerHalf = 32;
constexpr double kSamplesPerScene = double(kWidth) * kHeight * kSamplesPerHalf * kHalves;

double samples_wanted() {
  const char* text = std::getenv("HELIO_TORTURE_SAMPLES");
  return text ? std::max(kSamplesPerScene, std::strtod(text, nullptr)) : 20 * kSamplesPerScene;
}

// Numbers in the places where formulas change their course.
class Extremes {
 public:
  explicit Extremes(std::uint64_t seed) : random_(seed) {}

  float uniform(float low = 0, float high = 1) { return low + (high - low) * random_.next_float(); }
  bool chance(float p) { return random_.next_float() < p; }
  int below(int n) { return std::min(n - 1, int(random_.next_float() * float(n))); }

  // In [0, 1], the ends and their neighbourhoods often.
  float unit() {
    static const float kEnds[] = {0, 1e-30f, 1e-6f, 1e-4f, 1e-3f, 0.0316f, 0.0995f, 0.1f, 0.5f, 0.999f, 0.9999999f, 1};
    return chance(0.5f) ? kEnds[below(int(std::size(kEnds)))] : uniform();
  }
  float log_uniform(float low, float high) { return low * std::pow(high / low, uniform()); }
  Rgb color() { return {unit(), unit(), unit()}; }
  V3f direction() {
    for (;;) {
      const V3f v(uniform(-1, 1), uniform(-1, 1), uniform(-1, 1));
      if (length_squared(v) <= 1 && length_squared(v) > 1e-4f) return normalize(v);
    }
  }

 private:
  Random random_;
};

Material extreme_material(Extremes& x) {
  Material m;
  m.base_color = x.color();
  m.metallic = x.unit();
  m.roughness = x.unit();
  m.specular = x.unit();
  m.specular_color = x.color();
  m.ior = x.chance(0.3f) ? 1.0f : x.uniform(1, 3);
  m.double_sided = x.chance(0.5f);
  if (x.chance(0.4f)) {
    m.transmission = x.unit();
    m.thickness = x.chance(0.5f) ? 1.0f : 0.0f;
  }
  if (x.chance(0.3f)) m.emission = x.color() * x.log_uniform(1e-6f, 1e9f);
  if (x.chance(0.2f)) {
    m.alpha_mode = AlphaMode::blend;
    m.base_alpha = x.unit();
  }
  if (x.chance(0.3f)) {
    MaterialLayers& l = m.layers;
    l.clearcoat = x.unit();
    l.clearcoat_roughness = x.unit();
    l.sheen_color = x.color();
    l.sheen_roughness = x.unit();
    l.anisotropy = x.unit();
    l.iridescence = x.unit();
    l.iridescence_ior = x.uniform(1, 3);
    l.diffuse_transmission = x.unit();
    l.diffuse_transmission_color = x.color();
  }
  return m;
}

// Triangles from needles to squares; some with vertex normals that point anywhere.
TriangleMesh extreme_mesh(Extremes& x, int material, float size) {
  TriangleMesh mesh;
  const int count = 1 + x.below(20);
  for (int i = 0; i < count; ++i) {
    const V3f corner = x.direction() * size * x.uniform();
    const V3f u = x.direction() * size * x.log_uniform(1e-6f, 1), v = x.direction() * size * x.log_uniform(1e-6f, 1);
    const auto first = std::uint32_t(mesh.positions.size());
    mesh.positions.insert(mesh.positions.end(), {corner, corner + u, corner + (x.chance(0.1f) ? u : v)});
    mesh.indices.insert(mesh.indices.end(), {first, first + 1, first + 2});
  }
  if (x.chance(0.3f)) {
    for (std::size_t i = 0; i < mesh.positions.size(); ++i) mesh.normals.push_back(x.direction());
  }
  mesh.material = material;
  return mesh;
}

// A room or none, a handful of objects, lights near and far, at a scale from 1e-4 to 1e6.
SceneDescription extreme_scene(Extremes& x, float scale) {
  SceneDescription scene;
  const int materials = 3 + x.below(6);
  for (int i = 0; i < materials; ++i) scene.materials.push_back(extreme_material(x));
  const auto any = [&] { return x.below(materials); };
  if (x.chance(0.6f)) add_mesh(scene, box(V3f(-1) * scale, V3f(1) * scale, any(), true));
  const int objects = 1 + x.below(6);
  for (int i = 0; i < objects; ++i) {
    if (x.chance(0.3f)) {
      add_sphere(scene, x.direction() * scale * x.uniform(), scale * x.log_uniform(1e-4f, 0.7f), any());
      continue;
    }
    Object object;
    object.meshes.push_back(extreme_mesh(x, any(), scale));
    const int index = add_object(scene, std::move(object));
    for (int copies = 1 + x.below(3); copies > 0; --copies) {
      M44d place;
      for (int axis = 0; axis < 3; ++axis) {
        place[axis][axis] = (x.chance(0.2f) ? -1 : 1) * double(x.log_uniform(0.01f, 2));
        place[3][axis] = double(scale) * x.uniform(-0.5f, 0.5f);
      }
      add_instance(scene, index, place);
    }
  }
  for (int lights = x.below(4); lights > 0; --lights) {
    PunctualLight light;
    light.position = V3d(x.direction()) * double(scale * x.uniform());
    light.intensity = x.color() * x.log_uniform(1e-6f, 1e6f) * sqr(scale);
    scene.lights.push_back(light);
  }
  if (x.chance(0.5f)) {
    scene.environment = Environment{};
    scene.environment->radiance = x.color() * x.log_uniform(1e-6f, 1e6f);
  }
  return scene;
}

CameraPose extreme_camera(Extremes& x, float scale) {
  const V3d eye = V3d(x.direction()) * double(scale) * double(x.chance(0.7f) ? x.uniform() : x.log_uniform(1, 1000));
  CameraPose pose = camera_at(eye, V3d(x.direction()) * double(scale) * 0.3, x.chance(0.2f) ? 178 : x.uniform(0.2f, 90));
  if (x.chance(0.3f)) {
    pose.lens_radius = double(scale) * x.log_uniform(1e-4f, 1);
    pose.focus_distance = double(scale) * x.log_uniform(1e-2f, 10);
  }
  return pose;
}

std::string where(const RenderScene& scene, const CameraPose& pose, const PathSettings& settings,
                  const InvalidSample& sample) {
  SampleTrace trace;
  trace.width = kWidth;
  trace.height = kHeight;
  trace.sample = sample;
  trace_sample(scene, Camera(pose, kWidth, kHeight, scene.origin()), settings, CancelToken(), trace);
  const auto first = first_not_finite(trace);
  return first ? "vertex " + std::to_string(first->vertex) + ": " + first->quantity : "finite when traced again";
}

// Half of the scenes as the path tracer has them, the others with light paths.
Integrator integrator_of(std::uint64_t seed) {
  static constexpr Integrator kLightPaths[] = {Integrator::bdpt, Integrator::light, Integrator::path_bdpt,
                                               Integrator::lvc,  Integrator::vcm,   Integrator::photon};
  return seed % 2 == 0 ? Integrator::path : kLightPaths[seed / 2 % std::size(kLightPaths)];
}

// With pt+bdpt the left one of two tiles has light paths.
Film film_for(Integrator integrator) {
  FilmState state;
  state.splats = traces_light_paths(integrator);
  Film film(kWidth, kHeight, state);
  if (integrator == Integrator::path_bdpt) {
    auto tiles = std::make_shared<LightTiles>(kWidth, kHeight, false);
    tiles->set(0, true);
    film.set_light_tiles(std::move(tiles));
  }
  return film;
}

void trace_all(const std::shared_ptr<const RenderScene>& scene, const CameraPose& pose, const PathSettings& settings,
               Film& film, TraceStats& stats) {
  const Camera camera(pose, kWidth, kHeight, scene->origin());
  const CancelToken never;
  const auto trace = [&](const SampleRange& range, const LightVertexCache* lights) {
    for (int x = 0; x < kWidth; x += kLightTile) {
      const PixelRect tile{x, 0, x + kLightTile, kHeight};
      EXPECT_TRUE(trace_window(*scene, camera, settings, range, tile, never, film, stats, nullptr, lights));
    }
  };
  for (int half = 0; half < kHalves; ++half) {
    if (!caches_light_vertices(settings.integrator)) {
      trace({half, 0, kSamplesPerHalf}, nullptr);
      continue;
    }
    for (std::uint32_t sample = 0; sample < kSamplesPerHalf; ++sample) {
      const auto lights = make_light_cache(scene, settings, half, sample, kWidth * kHeight, &camera, film, stats);
      trace({half, sample, 1}, lights.get());
    }
  }
}

bool is_lit(const Film& film) {
  if (mean_of(film).mean.x > 0) return true;
  for (int pixel = 0; film.splats() && pixel < kWidth * kHeight; ++pixel) {
    for (int half = 0; half < kHalves; ++half) {
      if (film.splats()->mean(half, pixel % kWidth, pixel / kWidth).x > 0) return true;
    }
  }
  return false;
}

TEST(Torture, NoSampleIsInvalid) {
  const double wanted = samples_wanted();
  double samples = 0;
  std::uint64_t invalid = 0, invalid_splats = 0, lit = 0, light_paths = 0;
  for (std::uint64_t seed = 1; samples < wanted; ++seed) {
    Extremes x(seed);
    const float scale = x.log_uniform(1e-4f, 1e6f);
    const auto scene = build(extreme_scene(x, scale));
    ASSERT_TRUE(scene) << seed;
    const CameraPose pose = extreme_camera(x, scale);
    PathSettings settings;
    settings.seed = seed;
    settings.max_segments = x.chance(0.1f) ? 200 : 10;
    settings.roulette_from = x.chance(0.1f) ? 200 : 3;
    settings.integrator = integrator_of(seed);
    TraceStats stats;
    Film film = film_for(settings.integrator);
    trace_all(scene, pose, settings, film, stats);
    samples += kSamplesPerScene;
    invalid += stats.invalid_samples;
    invalid_splats += stats.invalid_splats;
    light_paths += stats.light_paths;
    lit += is_lit(film);
    EXPECT_EQ(stats.invalid_samples, 0u) << "scene " << seed << ", " << to_string(settings.integrator) << ", pixel "
                                         << stats.first_invalid.x << "," << stats.first_invalid.y << ", half "
                                         << stats.first_invalid.half << ", sample " << stats.first_invalid.index << "; "
                                         << where(*scene, pose, settings, stats.first_invalid);
    EXPECT_EQ(stats.invalid_splats, 0u) << "scene " << seed << ", " << to_string(settings.integrator);
    if (HasFailure() && seed > 200) break;
  }
  std::printf(
      "%.3g samples and %.3g light paths in scenes of which %llu are lit, %llu samples and %llu splats invalid\n",
      samples, double(light_paths), static_cast<unsigned long long>(lit), static_cast<unsigned long long>(invalid),
      static_cast<unsigned long long>(invalid_splats));
  EXPECT_GT(double(lit), 0.5 * samples / kSamplesPerScene) << "scenes without light test nothing";
}

}  // namespace
}  // namespace helio::test
