// A sample told vertex by vertex is the sample that was rendered, and what is told explains all of it.
#include "renderer/trace/paths/sample_trace.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "tests/support/light_cache.h"
#include "tests/support/small_rooms.h"

namespace helio::test {
namespace {

const CameraPose kPose = camera_at({0.1, 0, 0.95}, {0, -0.2, -1}, 75);

SampleTrace trace_of(const RenderScene& scene, const CameraPose& pose, int width, int height,
                     const InvalidSample& sample, const PathSettings& settings = {}) {
  SampleTrace trace;
  trace.width = width;
  trace.height = height;
  trace.sample = sample;
  EXPECT_TRUE(trace_sample(scene, Camera(pose, width, height, scene.origin()), settings, CancelToken(), trace));
  return trace;
}

// Adds up what the vertices say in the kernel's order: emission, light vertices merged, the light sample, connections.
Rgb told_radiance(const SampleTrace& trace) {
  Rgb sum(0, 0, 0);
  for (const VertexTrace& v : trace.vertices) {
    EXPECT_EQ(v.radiance, sum) << "before vertex " << v.number;
    if (!is_black(v.emitted)) sum += v.throughput * v.emitted * v.emitted_weight;
    if (v.merged > 0) sum += v.merged_contribution;
    if (v.light.shadow_ray && !v.light.occluded) sum += v.light.contribution;
    for (const ConnectionTrace& connection : v.connections) {
      if (!connection.occluded) sum += connection.contribution;
    }
  }
  return sum;
}

// Connections name vertices of the light path, and are left out beyond max_segments.
void expect_light_path(const SampleTrace& trace, const PathSettings& settings) {
  int number = 0, segments = 0;
  for (const LightVertexTrace& v : trace.light_vertices) {
    ASSERT_EQ(v.number, ++number);
    if (!caches_light_vertices(settings.integrator)) {
      ASSERT_GT(v.segments, segments);
      segments = v.segments;
    }
    ASSERT_LT(v.segments, settings.max_segments);
    ASSERT_FALSE(is_black(v.throughput));
  }
  for (const VertexTrace& v : trace.vertices) {
    for (const ConnectionTrace& connection : v.connections) {
      const auto named = [&](const LightVertexTrace& light) { return light.number == connection.light_vertex; };
      const auto light = std::find_if(trace.light_vertices.begin(), trace.light_vertices.end(), named);
      ASSERT_TRUE(light != trace.light_vertices.end());
      ASSERT_LE(v.number + light->segments + 1, settings.max_segments);
      ASSERT_NEAR(connection.distance, length(V3d(v.position) - V3d(light->position)), 1e-4);
      ASSERT_GT(connection.mis_weight, 0);
      ASSERT_LE(connection.mis_weight, 1);
    }
  }
}

// Every pixel of a film that ends inside its blocks, both halves; the film of one sample is that sample.
void expect_same_bits(const RenderScene& scene, const PathSettings& settings) {
  const int width = 37, height = 21;
  const std::uint32_t index = 5;
  for (int half = 0; half < kHalves; ++half) {
    const bool light_paths = traces_light_paths(settings.integrator);
    FilmState state;
    state.splats = light_paths;
    Film film(width, height, state);
    const std::uint64_t paths = light_paths ? std::uint64_t(width) * height : 0;
    TraceStats stats;
    const Camera camera(kPose, width, height, scene.origin());
    std::shared_ptr<LightVertexCache> pass;
    if (caches_light_vertices(settings.integrator)) {
      const std::shared_ptr<const RenderScene> borrowed(std::shared_ptr<void>(), &scene);
      pass = make_light_cache(borrowed, settings, half, index, paths, nullptr, film, stats);
    }
    ASSERT_TRUE(trace_window(scene, camera, settings, {half, index, 1}, film.bounds(), CancelToken(), film, stats,
                             nullptr, pass.get()));
    for (int y = 0; y < height; ++y) {
      for (int x = half; x < width; x += pass ? 19 : 3) {  // a pass is traced for each
        const SampleTrace trace = trace_of(scene, kPose, width, height, {x, y, half, index, paths}, settings);
        const HalfPixel& pixel = film.half(half, x, y);
        ASSERT_EQ(pixel.count, 1u);
        for (int c = 0; c < 3; ++c) ASSERT_EQ(double(trace.radiance[c]), pixel.sum[c]) << x << ' ' << y << ' ' << half;
        ASSERT_EQ(told_radiance(trace), trace.radiance) << x << ' ' << y;
        expect_light_path(trace, settings);
        ASSERT_FALSE(trace.vertices.empty());
        for (std::size_t i = 0; i < trace.vertices.size(); ++i) {
          ASSERT_EQ(trace.vertices[i].number, int(i) + 1);
          ASSERT_EQ(trace.vertices[i].goes_on, i + 1 < trace.vertices.size());
          ASSERT_NE(why_ended(trace.vertices[i], settings), "ended");
        }
        ASSERT_FALSE(first_not_finite(trace).has_value());
      }
    }
  }
}

TEST(SampleTrace, IsTheRenderedSampleInEveryBit) {
  for (const bool mixed : {false, true}) {
    const auto scene = build(mixed ? mixed_scene() : lambert_room());
    PathSettings settings;
    settings.seed = 99;
    expect_same_bits(*scene, settings);
    settings.general_kernel = true;
    settings.max_segments = 4;
    expect_same_bits(*scene, settings);
  }
}

TEST(SampleTrace, WithItsLightPathToo) {
  for (const bool mixed : {false, true}) {
    const auto scene = build(mixed ? mixed_scene() : lambert_room());
    PathSettings settings;
    settings.seed = 99;
    settings.integrator = Integrator::bdpt;
    expect_same_bits(*scene, settings);
    settings.max_segments = 4;
    expect_same_bits(*scene, settings);
    settings.technique = Technique{2, 2, true};
    expect_same_bits(*scene, settings);
    settings.technique.reset();
    settings.integrator = Integrator::light;
    expect_same_bits(*scene, settings);
  }
}

TEST(SampleTrace, WithThePassThatItDrewOnToo) {
  for (const Integrator integrator : {Integrator::lvc, Integrator::vcm, Integrator::photon}) {
    for (const bool mixed : {false, true}) {
      SCOPED_TRACE(to_string(integrator));
      const auto scene = build(mixed ? mixed_scene() : lambert_room());
      PathSettings settings;
      settings.seed = 99;
      settings.integrator = integrator;
      settings.light_cache.radius = 0.1;
      expect_same_bits(*scene, settings);
    }
  }
}

// What vertices of a light path bring to the camera is what the film gets: over all samples of a picture, each light
// path's share of the pixels that it says.
TEST(SampleTrace, TellsWhatTheCameraSeesOfLightPaths) {
  const auto scene = build(lambert_room());
  const int side = 16;
  const Camera camera(kPose, side, side, scene->origin());
  for (const Integrator integrator : {Integrator::bdpt, Integrator::lvc}) {
    SCOPED_TRACE(to_string(integrator));
    PathSettings settings;
    settings.integrator = integrator;
    FilmState state;
    state.splats = true;
    Film film(side, side, state);
    TraceStats stats;
    const InvalidSample sample{0, 0, 0, 3, std::uint64_t(side * side)};
    std::vector<V3d> told(std::size_t(side * side), V3d(0, 0, 0));
    const auto add = [&](const InvalidSample& which) {
      for (const LightVertexTrace& v : trace_of(*scene, kPose, side, side, which, settings).light_vertices) {
        if (!v.splat || v.splat->occluded) continue;
        told[std::size_t(int(v.splat->film_y) * side + int(v.splat->film_x))] += V3d(v.splat->contribution);
      }
    };
    if (integrator == Integrator::lvc) {
      const auto pass = make_light_cache(scene, settings, 0, 3, sample.light_paths, &camera, film, stats);
      for (std::uint64_t path = 1; path <= sample.light_paths; ++path) {
        InvalidSample which = sample;
        which.light_path = path;
        add(which);
      }
    } else {
      ASSERT_TRUE(trace_window(*scene, camera, settings, {0, 3, 1}, film.bounds(), CancelToken(), film, stats));
      for (int i = 0; i < side * side; ++i) add({i % side, i / side, 0, 3, sample.light_paths});
    }
    double brought = 0;
    for (int i = 0; i < side * side; ++i) {
      const Rgb mean = film.splats()->mean(0, i % side, i / side);
      for (int c = 0; c < 3; ++c) {
        ASSERT_NEAR(told[std::size_t(i)][c] / (side * side), mean[c], 1e-5 * mean[c] + 1e-9) << i;
        brought += mean[c];
      }
    }
    EXPECT_GT(brought, 0);
  }
}

// In a room of diffuse surfaces most samples have connections that bring something, and some that are blocked.
TEST(SampleTrace, TellsWhatConnectionsBring) {
  const auto scene = build(lambert_room());
  PathSettings settings;
  settings.integrator = Integrator::bdpt;
  int brought = 0, blocked = 0;
  for (int x = 0; x < 16; ++x) {
    const SampleTrace trace = trace_of(*scene, kPose, 16, 16, {x, 8, 0, 3, 256}, settings);
    EXPECT_FALSE(trace.light_vertices.empty());
    for (const VertexTrace& v : trace.vertices) {
      for (const ConnectionTrace& connection : v.connections) ++(connection.occluded ? blocked : brought);
    }
  }
  EXPECT_GT(brought, 16);
  EXPECT_GT(blocked, 0);
}

// The number of light paths of the picture is part of the sample: its weights depend on it.
TEST(SampleTrace, DependsOnTheNumberOfLightPaths) {
  const auto scene = build(lambert_room());
  PathSettings settings;
  settings.integrator = Integrator::bdpt;
  const SampleTrace few = trace_of(*scene, kPose, 16, 16, {5, 8, 0, 3, 16}, settings);
  const SampleTrace many = trace_of(*scene, kPose, 16, 16, {5, 8, 0, 3, 4096}, settings);
  EXPECT_NE(few.radiance, many.radiance);
}

TEST(SampleTrace, NamesWhatItMet) {
  SceneDescription scene;
  scene.materials = {lambert(Rgb(0.25f, 0.5f, 0.75f), Rgb(2, 2, 2))};
  add_mesh(scene, quad({-1, -1, 5}, {2, 0, 0}, {0, 2, 0}, 0));
  const auto built = build(std::move(scene));
  const CameraPose pose = camera_at({0, 0, 8}, {0, 0, 5}, 70);
  const SampleTrace hit = trace_of(*built, pose, 8, 8, {4, 4, 0, 0});
  ASSERT_EQ(hit.vertices.size(), 2u);
  const VertexTrace& first = hit.vertices[0];
  EXPECT_TRUE(first.hit);
  EXPECT_NEAR(first.distance, 3, 0.05);
  EXPECT_NEAR(first.position.z + built->origin().z, 5, 1e-5);
  EXPECT_EQ(first.emitted, Rgb(2, 2, 2));
  EXPECT_EQ(first.params.base_color, Rgb(0.25f, 0.5f, 0.75f));
  EXPECT_EQ(first.params.model, LobeModel::lambert);
  EXPECT_EQ(first.next_throughput, first.scatter.weight);
  EXPECT_FALSE(hit.vertices[1].hit);
  EXPECT_EQ(why_ended(hit.vertices[1], {}), "left the scene");
  PathSettings one;
  one.max_segments = 1;
  EXPECT_EQ(why_ended(trace_of(*built, pose, 8, 8, {4, 4, 0, 0}, one).vertices[0], one),
            "has as many segments as max_segments allows");
  EXPECT_FALSE(trace_of(*built, pose, 8, 8, {0, 0, 1, 7}).vertices[0].hit);
}

TEST(SampleTrace, CancelEndsIt) {
  const auto scene = build(lambert_room());
  CancelToken cancelled;
  cancelled.cancel();
  SampleTrace trace;
  trace.width = trace.height = 8;
  EXPECT_FALSE(trace_sample(*scene, Camera(kPose, 8, 8, scene->origin()), {}, cancelled, trace));
}

// ---- where a value first was not finite ----------------------------------------------------------------------------

// A floor under a lamp; only the floor's material or the lamp is out of order.
SampleTrace floor_trace(const Material& floor, const Rgb& intensity, std::uint32_t index = 0) {
  SceneDescription scene;
  scene.materials = {floor};
  add_mesh(scene, quad({-1, 0, 1}, {2, 0, 0}, {0, 0, -2}, 0));
  PunctualLight light;
  light.position = {0, 0.5, 0};
  light.intensity = intensity;
  scene.lights = {light};
  return trace_of(*build(std::move(scene)), camera_at({0, 1, 2}, {0, 0, 0}, 20), 8, 8, {4, 4, 0, index});
}

void expect_first(const SampleTrace& trace, int vertex, const std::string& quantity) {
  SCOPED_TRACE(quantity);
  EXPECT_FALSE(is_finite(trace.radiance)) << trace.radiance;
  const auto first = first_not_finite(trace);
  ASSERT_TRUE(first.has_value());
  EXPECT_EQ(first->vertex, vertex);
  EXPECT_EQ(first->quantity, quantity);
}

TEST(SampleTrace, FindsTheFirstValueThatIsNotFinite) {
  const float nan = std::numeric_limits<float>::quiet_NaN(), inf = std::numeric_limits<float>::infinity();
  expect_first(floor_trace(lambert(Rgb(0.5f, nan, 0.5f)), Rgb(1, 1, 1)), 1, "the material's base color");
  expect_first(floor_trace(lambert(Rgb(inf, 0.5f, 0.5f)), Rgb(1, 1, 1)), 1, "the material's base color");
  // 3.3e38 from the floor itself, and 5e37 or more of what the lamp sends it: each a float, their sum none. Samples
  // that choose the floor as their light are finite.
  int infinite = 0;
  for (std::uint32_t index = 0; index < 32; ++index) {
    const SampleTrace trace =
        floor_trace(lambert(Rgb(0.5f, 0.5f, 0.5f), Rgb(3.3e38f, 3.3e38f, 3.3e38f)), Rgb(8e37f, 8e37f, 8e37f), index);
    if (is_finite(trace.radiance)) {
      EXPECT_FALSE(first_not_finite(trace).has_value());
    } else {
      ++infinite;
      expect_first(trace, 1, "the sum of the contributions");
    }
  }
  EXPECT_GT(infinite, 0);
  EXPECT_LT(infinite, 32);
}

// The first of several, whatever came in which order.
TEST(TraceStats, FirstInvalidDoesNotDependOnTheOrder) {
  const InvalidSample samples[] = {{5, 2, 1, 3}, {9, 1, 0, 3}, {4, 1, 0, 3}, {0, 0, 0, 4}};
  TraceStats forward, backward, halves;
  for (int i = 0; i < 4; ++i) {
    forward.note_invalid(samples[i]);
    backward.note_invalid(samples[3 - i]);
    TraceStats one;
    one.note_invalid(samples[(i + 2) % 4]);
    halves.add(one);
  }
  halves.add(TraceStats());
  for (const TraceStats* stats : {&forward, &backward, &halves}) {
    EXPECT_EQ(stats->invalid_samples, 4u);
    EXPECT_EQ(stats->first_invalid, samples[2]);
  }
}

}  // namespace
}  // namespace helio::test
