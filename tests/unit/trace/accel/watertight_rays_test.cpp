// Rays without Embree's robust mode: closed meshes stay closed, the probe sees leaks where there are any, and pictures
// are what they were.
#include <gtest/gtest.h>

#include "renderer/trace/sampling/warp.h"
#include "renderer/trace/scene/scene_data.h"
#include "renderer/trace/scene/surface.h"
#include "renderer/trace/scene/watertightness.h"
#include "tests/support/bumpy_ball.h"
#include "tests/support/random.h"
#include "tests/support/test_scenes.h"

namespace helio::test {
namespace {

// Bumpy, around the origin, with its fronts inside.
TriangleMesh cave(int rings, float bump, std::uint64_t seed) {
  return bumpy_ball({0, 0, 0}, 1, rings, bump, true, seed);
}

SceneDescription cave_scene(int rings, float bump, std::uint64_t seed, const Material& material) {
  SceneDescription scene;
  scene.materials = {material};
  add_mesh(scene, cave(rings, bump, seed));
  return scene;
}

// Rays from inside towards points on sides of the mesh, the worst there are. How many see nothing.
int escapes(const Accel& accel, const TriangleMesh& mesh, int count, std::uint64_t seed) {
  constexpr int kBatch = 256;
  Random random(seed);
  int escaped = 0;
  Ray rays[kBatch];
  Hit hits[kBatch];
  std::uint32_t order[kBatch];
  for (int done = 0; done < count; done += kBatch) {
    for (int i = 0; i < kBatch; ++i) {
      order[i] = std::uint32_t(i);
      const std::size_t t = random.next_u32() % mesh.triangle_count();
      const int k = int(random.next_u32() % 3);
      const V3f a = corner(mesh, std::uint32_t(t), k), b = corner(mesh, std::uint32_t(t), (k + 1) % 3);
      const V3f origin = square_to_sphere(random.next_v2f()) * (0.8f * random.next_float());
      rays[i].origin = origin;
      rays[i].direction = normalize(a + (b - a) * random.next_float() - origin);
      rays[i].t_max = std::numeric_limits<float>::infinity();
    }
    accel.intersect(rays, order, kBatch, hits, RayOrder::scattered);
    for (const Hit& hit : hits) escaped += !hit.valid();
  }
  return escaped;
}

std::unique_ptr<Accel> accel_of(const TriangleMesh& mesh, float radius, float edge_dilation) {
  AccelInput input;
  AccelPart part;
  part.positions = mesh.positions.data();
  part.vertex_count = mesh.positions.size();
  part.indices = mesh.indices.data();
  part.triangle_count = mesh.triangle_count();
  input.flat = {part};
  input.edge_dilation_radius = radius;
  input.edge_dilation = edge_dilation;
  auto accel = Accel::build(input);
  EXPECT_TRUE(accel.ok());
  return accel.ok() ? std::move(*accel) : nullptr;
}

TEST(WatertightRays, WideningClosesWhatLeaksWithoutIt) {
  constexpr int kRays = 1 << 20;
  for (const int rings : {8, 120}) {
    const auto scene = build(cave_scene(rings, 0.02f, 3, lambert(Rgb(0.5f, 0.5f, 0.5f))));
    ASSERT_TRUE(scene->features().fast_rays);
    const SceneData& data = scene->impl();
    const TriangleMesh& mesh = *data.flat[0].mesh;
    EXPECT_EQ(escapes(*data.accel, mesh, kRays, 17), 0) << rings;
    // The same rays without edge dilation: the test would see leaks.
    EXPECT_GT(escapes(*accel_of(mesh, data.radius, 0), mesh, kRays, 17), 1000) << rings;
  }
}

TEST(WatertightRays, ProbeMeasuresLeaks) {
  const auto scene = build(cave_scene(120, 0.02f, 3, lambert(Rgb(0.5f, 0.5f, 0.5f))));
  SceneData& data = const_cast<SceneData&>(scene->impl());
  const LeakEstimate closed = estimate_leaks(data, 0);
  EXPECT_GT(closed.aimed, 10000u);
  EXPECT_EQ(closed.leaked, 0u);
  EXPECT_LE(closed.rate_limit, kMaxLeakRate);
  const LeakEstimate again = estimate_leaks(data, 1);  // deterministic, whatever the threads
  EXPECT_EQ(again.aimed, closed.aimed);
  EXPECT_EQ(again.rate_limit, closed.rate_limit);

  const TriangleMesh& mesh = *data.flat[0].mesh;
  data.accel = accel_of(mesh, data.radius, 0);
  const LeakEstimate open = estimate_leaks(data, 0);
  EXPECT_GT(open.leaked, 20u);
  EXPECT_GT(open.rate_limit, kMaxLeakRate);
}

TEST(WatertightRays, ScenesThatCannotDoWithoutKeepRobustMode) {
  const Material grey = lambert(Rgb(0.5f, 0.5f, 0.5f));
  RenderSceneOptions robust;
  robust.rays = RayMode::robust;
  EXPECT_TRUE(build(cave_scene(16, 0, 1, grey))->features().fast_rays);
  EXPECT_FALSE(build(cave_scene(16, 0, 1, grey), robust)->features().fast_rays);
  // Instances.
  SceneDescription twice = cave_scene(16, 0, 1, grey);
  M44d aside;
  aside.setTranslation(V3d(3, 0, 0));
  add_instance(twice, 0, aside);
  EXPECT_FALSE(build(std::move(twice))->features().fast_rays);
  // A mesh that is too fine for the extent of its scene.
  SceneDescription fine = cave_scene(16, 0, 1, grey);
  add_mesh(fine, box({0, 0, 0}, {1e5f, 1e5f, 1e5f}, 0));
  EXPECT_FALSE(build(std::move(fine))->features().fast_rays);
  // Nothing but spheres: there is nothing to measure.
  SceneDescription sphere;
  sphere.materials = {grey};
  add_sphere(sphere, {0, 0, 0}, 1, 0);
  EXPECT_FALSE(build(std::move(sphere))->features().fast_rays);
}

// From far away rays are moved up to the scene first: what they hit, and where, stays the same.
TEST(WatertightRays, FarOriginsSeeTheSame) {
  const auto robust = [] {
    RenderSceneOptions options;
    options.rays = RayMode::robust;
    return build(cave_scene(12, 0, 1, lambert(Rgb(0.5f, 0.5f, 0.5f))), options);
  }();
  const auto fast = build(cave_scene(12, 0, 1, lambert(Rgb(0.5f, 0.5f, 0.5f))));
  ASSERT_TRUE(fast->features().fast_rays);
  Random random(23);
  constexpr int kCount = 4096;
  std::vector<Ray> rays(kCount);
  std::vector<Hit> a(kCount), b(kCount);
  std::vector<std::uint8_t> dark_a(kCount), dark_b(kCount);
  std::vector<std::uint32_t> order(kCount);
  for (const float distance : {3.9f, 4.1f, 100.0f, 1e4f}) {
    for (int i = 0; i < kCount; ++i) {
      order[std::size_t(i)] = std::uint32_t(i);
      Ray& ray = rays[std::size_t(i)];
      ray.origin = square_to_sphere(random.next_v2f()) * distance;
      const V3f target = square_to_sphere(random.next_v2f()) * (1.5f * random.next_float());
      ray.direction = normalize(target - ray.origin) * (i % 7 == 0 ? -1.0f : 1.0f);
      ray.t_max = i % 3 == 0 ? distance * (0.5f + random.next_float()) : std::numeric_limits<float>::infinity();
    }
    robust->impl().accel->intersect(rays.data(), order.data(), kCount, a.data(), RayOrder::scattered);
    fast->impl().accel->intersect(rays.data(), order.data(), kCount, b.data(), RayOrder::scattered);
    robust->impl().accel->occluded(rays.data(), kCount, dark_a.data());
    fast->impl().accel->occluded(rays.data(), kCount, dark_b.data());
    int differ = 0, hits = 0;
    for (std::size_t i = 0; i < kCount; ++i) {
      hits += a[i].valid();
      if (a[i].valid() != b[i].valid() || dark_a[i] != dark_b[i]) {
        ++differ;  // at the rim or the very end of a ray
      } else if (a[i].valid()) {
        EXPECT_NEAR(a[i].t, b[i].t, 3e-4f + 1e-6f * distance) << distance;
      }
      EXPECT_EQ(b[i].valid(), bool(dark_b[i]));
    }
    EXPECT_GT(hits, kCount / 4);
    EXPECT_LE(differ, 3 + int(distance * 1e-3f)) << distance;
  }
}

// A closed cave whose inside emits e and reflects a shows e (1 + a + ... ) from everywhere, whatever its shape; what
// leaks out, or meets the dark back of a widened neighbour, is missing. Coarse and fine, smooth and jagged.
TEST(WatertightRays, EmittingCaveKeepsItsEnergy) {
  struct Case {
    int rings;
    float bump;
  };
  for (const Case& c : {Case{12, 0.2f}, Case{150, 0.01f}, Case{300, 0.01f}}) {
    Material material = lambert(Rgb(0.8f, 0.8f, 0.8f), Rgb(1, 1, 1));
    material.double_sided = false;
    const auto scene = build(cave_scene(c.rings, c.bump, 9, material));
    ASSERT_TRUE(scene->features().fast_rays) << c.rings;
    PathSettings settings;
    settings.max_segments = 6;
    settings.roulette_from = 100;
    const Film film = render(*scene, camera_at({0.1, 0, 0}, {1, 0.2, 0.3}, 120), 40, 40, 8, settings);
    double expected = 0;
    for (int k = 0; k < 6; ++k) expected += std::pow(0.8, k);
    const MeanEstimate e = mean_of(film);
    EXPECT_NEAR(e.mean.x, expected, 3 * e.standard_error.x + 2e-4 * expected) << c.rings << ' ' << c.bump;
  }
}

}  // namespace
}  // namespace helio::test
