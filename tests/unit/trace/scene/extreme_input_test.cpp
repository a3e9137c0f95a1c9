// What float, memory or a table cannot hold: refused, left out with a notice, or traced to nothing; never fatal.
#include <gtest/gtest.h>

#include <limits>

#include "renderer/trace/accel/accel.h"
#include "renderer/trace/scene/build_memory.h"
#include "tests/support/test_scenes.h"

namespace helio::test {
namespace {

constexpr float kInf = std::numeric_limits<float>::infinity(), kNan = std::numeric_limits<float>::quiet_NaN();

bool mentions(const std::vector<std::string>& notices, const std::string& part) {
  return std::any_of(notices.begin(), notices.end(),
                     [&](const std::string& notice) { return notice.find(part) != std::string::npos; });
}

std::vector<std::string> notices_of(const RenderScene& scene) {
  return scene.description().report.notices;
}

Environment white() {
  return Environment{};
}

// Two triangles in front of the camera that build_wall's rays start from.
struct Wall {
  TriangleMesh mesh = quad({-1, -1, 0}, {2, 0, 0}, {0, 2, 0}, 0);
  std::unique_ptr<Accel> accel;

  explicit Wall(float instance_scale = 0) {
    mesh.positions.reserve(mesh.positions.size() + 2);
    AccelPart part;
    part.positions = mesh.positions.data();
    part.vertex_count = mesh.positions.size();
    part.indices = mesh.indices.data();
    part.triangle_count = mesh.triangle_count();
    AccelInput input;
    input.flat.push_back(part);
    if (instance_scale > 0) {
      input.objects.push_back({{part}});
      input.instances.push_back({0, {instance_scale, 0, 0, 0, instance_scale, 0, 0, 0, instance_scale, 0, 0, 0}});
    }
    auto built = Accel::build(input);
    EXPECT_TRUE(built.ok());
    accel = std::move(*built);
  }
};

Ray ray_at_wall() {
  Ray ray;
  ray.origin = V3f(0.1f, 0.2f, 3);
  ray.direction = V3f(0, 0, -1);
  ray.t_max = kInf;
  return ray;
}

// Embree as distributions build it ends the process at such rays.
TEST(ExtremeInput, RaysThatFloatCannotCarryHitNothing) {
  for (const float scale : {0.0f, 1.0f, 1e-6f}) {
    const Wall wall(scale);
    for (const float bad : {kNan, kInf, -kInf, 1e19f, -3e38f}) {
      for (int component = 0; component < 6; ++component) {
        for (const RayOrder order : {RayOrder::camera, RayOrder::scattered}) {
          std::vector<Ray> rays(21, ray_at_wall());
          std::vector<Hit> hits(rays.size());
          std::vector<std::uint32_t> all(rays.size());
          for (std::uint32_t i = 0; i < all.size(); ++i) all[i] = i;
          for (const std::size_t spoiled : {std::size_t(0), std::size_t(5), std::size_t(20)}) {
            Ray& ray = rays[spoiled];
            (component < 3 ? ray.origin : ray.direction)[component % 3] = bad;
          }
          wall.accel->intersect(rays.data(), all.data(), rays.size(), hits.data(), order);
          std::vector<std::uint8_t> occluded(rays.size(), 2);
          wall.accel->occluded(rays.data(), rays.size(), occluded.data());
          for (std::size_t i = 0; i < rays.size(); ++i) {
            EXPECT_EQ(hits[i].valid(), i != 0 && i != 5 && i != 20) << i;
            EXPECT_EQ(occluded[i], 1) << i;
          }
        }
      }
    }
  }
}

TEST(ExtremeInput, RaysWithoutALengthHitNothing) {
  const Wall wall;
  Ray rays[2] = {ray_at_wall(), ray_at_wall()};
  rays[0].t_max = kNan;
  rays[1].t_max = 1;
  std::uint8_t occluded[2] = {2, 2};
  wall.accel->occluded(rays, 2, occluded);
  EXPECT_EQ(occluded[0], 1);
  EXPECT_EQ(occluded[1], 0);
}

// In range in the world, but not in the space of an instance this small.
TEST(ExtremeInput, RaysAreInRangeInsideInstancesToo) {
  const Wall wall(1e-12f);
  Ray ray = ray_at_wall();
  ray.origin.z = 1e9f;
  const std::uint32_t first = 0;
  Hit hit;
  wall.accel->intersect(&ray, &first, 1, &hit, RayOrder::scattered);
  EXPECT_FALSE(hit.valid());
  ray.origin.z = 1e3f;
  wall.accel->intersect(&ray, &first, 1, &hit, RayOrder::scattered);
  EXPECT_TRUE(hit.valid());
}

// A camera may stand anywhere in its range, and have any lens.
TEST(ExtremeInput, CamerasAtTheEdgesOfTheirRangesRender) {
  SceneDescription scene;
  scene.materials = {lambert(Rgb(0.5f, 0.5f, 0.5f))};
  add_mesh(scene, box({-1, -1, -1}, {1, 1, 1}, 0));
  Object small;
  small.meshes.push_back(box({-1, -1, -1}, {1, 1, 1}, 0));
  const int object = add_object(scene, std::move(small));
  for (const double x : {-3.0, 3.0}) {
    M44d to_world;
    to_world.setScale(V3d(1e-3));
    to_world[3][0] = x;
    add_instance(scene, object, to_world);
  }
  scene.environment = white();
  const auto built = build(std::move(scene));
  for (const double far : {1e3, 1e10, 1e12}) {
    CameraPose pose = camera_at({far, 0, 0}, {0, 0, 0});
    for (const bool orthographic : {false, true}) {
      pose.projection = orthographic ? Projection::orthographic : Projection::perspective;
      pose.half_height = pose.lens_radius = 1e12;
      pose.focus_distance = 1e-12;
      TraceStats stats;
      EXPECT_TRUE(std::isfinite(mean_of(render(*built, pose, 16, 16, 2, {}, &stats)).mean.x));
    }
  }
}

TEST(ExtremeInput, WhatReachesBeyondTheRangeIsLeftOutWithANotice) {
  SceneDescription scene;
  scene.materials = {lambert(Rgb(0.5f, 0.5f, 0.5f))};
  add_mesh(scene, box({-1, -1, -1}, {1, 1, 1}, 0));
  M44d far, huge;
  far[3][0] = 1e16;
  huge.setScale(V3d(1e30));
  add_mesh(scene, box({-1, -1, -1}, {1, 1, 1}, 0), far);
  add_mesh(scene, box({-1, -1, -1}, {1, 1, 1}, 0), huge);
  add_sphere(scene, {0, 0, 0}, 1e30f, 0);
  // Twice the same object, so that rays are traced in its own space.
  Object wide;
  wide.meshes.push_back(box({-1, -1, -1}, {1, 1, 1}, 0));
  const int object = add_object(scene, std::move(wide));
  M44d speck;
  speck.setScale(V3d(1e-20));
  add_instance(scene, object, speck);
  add_instance(scene, object);
  const auto built = build(std::move(scene));
  EXPECT_EQ(built->description().instances.size(), 2u);
  const auto notices = notices_of(*built);
  ASSERT_EQ(notices.size(), 4u);
  for (const char* name : {"instance 1", "instance 2", "instance 3"})
    EXPECT_TRUE(mentions(notices, std::string(name) + ": it reaches beyond 1e12 units")) << name;
  EXPECT_TRUE(mentions(notices, "instance 4: it is too small for a scene of this extent"));
  EXPECT_LT(length(built->world_bounds().size()), 10);
}

// A square of 2 `scale` a side around the origin under a constant environment of 1, seen from `distance`.
SceneDescription grey_square(double scale, double distance) {
  SceneDescription scene;
  scene.materials = {lambert(Rgb(0.5f, 0.5f, 0.5f))};
  M44d to_world;
  to_world.setScale(V3d(scale));
  add_mesh(scene, quad({-1, -1, 0}, {2, 0, 0}, {0, 2, 0}, 0), to_world);
  scene.environment = white();
  scene.cameras.resize(1);
  scene.cameras[0].to_world[3][2] = distance;
  return scene;
}

// Normals are made from edges whose products leave float's range.
TEST(ExtremeInput, ScenesOfAnySizeAreLitAlike) {
  for (const double scale : {1e-10, 1e-6, 1.0, 1e6, 1e10, 3e11}) {
    const auto built = build(grey_square(scale, 3 * scale));
    const MeanEstimate e = mean_of(render(*built, camera_at({0, 0, 3 * scale}, {0, 0, 0}, 20), 8, 8, 16));
    EXPECT_NEAR(e.mean.x, 0.5, 0.01) << scale;
    EXPECT_TRUE(notices_of(*built).empty()) << notices_of(*built)[0];
  }
}

// The same square 1e10 units across, seen from 5: rays leave it farther off than the camera is away.
TEST(ExtremeInput, AViewThatFloatCannotResolveIsNamed) {
  const auto notices_at = [](double scale, double distance) {
    SceneDescription scene = grey_square(scale, distance);
    scene.cameras[0].name = "near";
    return notices_of(*build(std::move(scene)));
  };
  EXPECT_TRUE(mentions(notices_at(1e10, 5), "camera \"near\" sees surfaces 5"));
  EXPECT_TRUE(mentions(notices_at(1e10, 5), "resolves their surroundings to"));
  EXPECT_TRUE(notices_at(1e10, 1e8).empty());
  EXPECT_TRUE(notices_at(1e3, 5).empty());
  EXPECT_TRUE(notices_at(1, 0.01).empty());
}

// ---- limits --------------------------------------------------------------------------------------------------------

SceneDescription grid(int triangles, bool emissive, int instances) {
  SceneDescription scene;
  scene.materials = {lambert(Rgb(0.5f, 0.5f, 0.5f), emissive ? Rgb(1, 1, 1) : Rgb(0, 0, 0))};
  TriangleMesh mesh;
  for (int i = 0; i < triangles; ++i) {
    const float x = float(i % 1000), y = float(i / 1000);
    for (const V3f& p : {V3f(x, y, 0), V3f(x + 0.9f, y, 0), V3f(x, y + 0.9f, 0)}) {
      mesh.indices.push_back(std::uint32_t(mesh.positions.size()));
      mesh.positions.push_back(p);
    }
  }
  Object object;
  object.meshes.push_back(std::move(mesh));
  add_object(scene, std::move(object));
  for (int i = 0; i < instances; ++i) {
    M44d to_world;
    to_world[3][2] = i;
    add_instance(scene, 0, to_world);
  }
  return scene;
}

std::string refusal(SceneDescription scene, ErrorCode code, const RenderSceneOptions& options = {}) {
  const auto built = RenderScene::build(std::move(scene), options);
  if (built.ok()) return "built";
  EXPECT_EQ(built.error().code, code);
  return built.error().to_string();
}

TEST(ExtremeInput, InstancedEmittersCountBeforeTheyAreMade) {
  SceneDescription scene = grid(1000, true, 5000);
  scene.memory_limit = 300ull << 20;
  const std::string error = refusal(std::move(scene), ErrorCode::resource_exhausted);
  EXPECT_NE(error.find("5000000 emissive triangles"), std::string::npos) << error;
  EXPECT_NE(error.find(std::to_string(300 << 20)), std::string::npos) << error;
  SceneDescription dark = grid(1000, false, 5000);
  dark.memory_limit = 300ull << 20;
  EXPECT_TRUE(RenderScene::build(std::move(dark), {}).ok());
}

TEST(ExtremeInput, TheEstimateHoldsWhatIsBuilt) {
  SceneDescription scene = grid(20000, true, 3);
  const BuildMemory memory = estimate_build_memory(scene);
  EXPECT_EQ(memory.emitter_count, 60000u);
  scene.memory_limit = memory.total() + (64ull << 20);
  const auto built = build(std::move(scene));
  ASSERT_TRUE(built);
  EXPECT_LE(built->stats().memory_bytes, memory.total() + (64ull << 20));
}

TEST(ExtremeInput, TheBvhIsHeldToWhatIsLeft) {
  SceneDescription scene = grid(200000, false, 1);
  scene.memory_limit = estimate_build_memory(scene).total() + (1 << 20);
  const std::string error = refusal(std::move(scene), ErrorCode::resource_exhausted);
  EXPECT_NE(error.find("BVH"), std::string::npos) << error;
  EXPECT_TRUE(RenderScene::build(grid(200000, false, 1), {}).ok());  // and the next is not
}

TEST(ExtremeInput, ABuildCanBeCancelled) {
  CancelToken cancel;
  RenderSceneOptions options;
  options.cancel = &cancel;
  EXPECT_TRUE(RenderScene::build(grid(10, false, 2), options).ok());
  cancel.cancel();
  EXPECT_NE(refusal(grid(10, false, 2), ErrorCode::cancelled, options).find("cancelled"), std::string::npos);
}

TEST(ExtremeInput, MaterialsAreAsManyAsCanBeNumbered) {
  SceneDescription scene = grid(2, false, 1);
  scene.materials.resize(65535, scene.materials[0]);
  SceneDescription more = scene;
  EXPECT_TRUE(RenderScene::build(std::move(scene), {}).ok());
  more.materials.push_back(more.materials[0]);
  const std::string error = refusal(std::move(more), ErrorCode::resource_exhausted);
  EXPECT_NE(error.find("materials: 65536 materials; allowed: at most 65535"), std::string::npos) << error;
}

}  // namespace
}  // namespace helio::test
