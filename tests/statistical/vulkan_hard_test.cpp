// Hard cases 3 and 4 (statistical/hard) on a Vulkan device: places, sizes and brightnesses at the ends of what 32-bit
// floats hold; and pictures, windows, filters and cameras that are at the end of what may be asked for.
//
// The seed is the processor's, and so are the random numbers: means agree to 0.2 %, most pixels to 1 %. Not the pixels
// in scenes with instances: where a component of a normal is 0, its sign may differ there, and with it the frame in
// which directions are drawn.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <functional>
#include <string>
#include <vector>

#include "tests/statistical/hard/light_range_scenes.h"
#include "tests/statistical/hard/placements.h"
#include "tests/statistical/hard/torture_scenes.h"
#include "tests/support/bumpy_ball.h"
#include "tests/support/small_rooms.h"
#include "tests/support/tier.h"
#include "tests/support/vulkan_level.h"

namespace helio::test {
namespace {

using vulkan::Level;
using vulkan::PathDevice;
using vulkan::SceneOnDevice;

struct Picture {
  SceneDescription description;
  CameraPose pose;
  PathSettings settings;
  PixelFilter filter;
  int width = 32, height = 32;
  std::uint32_t samples = 64;  // a half
  bool same_paths = true;      // as the processor's, but for a few
};

class VulkanHard : public testing::TestWithParam<Level> {
 protected:
  void SetUp() override { device_ = device_of(GetParam()); }

  std::shared_ptr<const SceneOnDevice> upload(std::shared_ptr<const RenderScene> scene) const {
    if (!scene) return nullptr;
    auto placed = device_->upload(std::move(scene));
    if (placed.ok()) return *placed;
    ADD_FAILURE() << placed.error().to_string();
    return nullptr;
  }

  // `halves`: of which the film gets samples.
  Film render_on_device(const SceneOnDevice& placed, const RenderScene& scene, const Picture& picture,
                        const PixelRect& window, int halves, TraceStats& stats) const {
    Film film(picture.width, picture.height);
    const Camera camera(fitted(picture.pose, picture.width, picture.height), picture.width, picture.height,
                        scene.origin(), picture.filter);
    for (int half = 0; half < halves; ++half) {
      const auto done = device_->trace(placed, camera, picture.settings, {half, 0, picture.samples}, window,
                                       CancelToken(), film, stats);
      EXPECT_TRUE(done.ok() && *done) << (done.ok() ? "cancelled" : done.error().to_string());
    }
    return film;
  }

  // Returns the mean of the processor's picture.
  V3d compare(const std::string& name, Picture picture) const {
    const auto scene = build(std::move(picture.description));
    const auto placed = upload(scene);
    return placed ? compare_uploaded(name, *placed, *scene, picture) : V3d(0);
  }

  V3d compare_uploaded(const std::string& name, const SceneOnDevice& placed, const RenderScene& scene,
                       const Picture& picture) const {
    SCOPED_TRACE(name);
    TraceStats ours, theirs;
    const Film cpu = render(scene, fitted(picture.pose, picture.width, picture.height), picture.width, picture.height,
                            picture.samples, picture.settings, &theirs, picture.filter);
    const Film film = render_on_device(placed, scene, picture, cpu.bounds(), kHalves, ours);
    const V3d mean = mean_of(film).mean, expected = mean_of(cpu).mean;
    double off = 0;
    for (int c = 0; c < 3; ++c) {
      EXPECT_EQ(mean[c] > 0, expected[c] > 0);
      if (expected[c] > 0) off = std::max(off, std::abs(mean[c] / expected[c] - 1));
    }
    int differing = 0, not_finite = 0, invalid = 0;
    for (int y = 0; y < picture.height; ++y) {
      for (int x = 0; x < picture.width; ++x) {
        const V3d a = moments_of(film, x, y).mean, b = moments_of(cpu, x, y).mean;
        differing += length(a - b) > 0.01 * length(b);
        not_finite += !(std::isfinite(a.x) && std::isfinite(a.y) && std::isfinite(a.z));
        for (int half = 0; half < kHalves; ++half) invalid += film.invalid(half, x, y) != cpu.invalid(half, x, y);
      }
    }
    std::printf("%s by %s: mean %.5g off by %.2g; %d of %d pixels by more than 1 %%; %llu samples invalid\n",
                name.c_str(), std::string(vulkan::level_name(device_->level())).c_str(), expected.x, off, differing,
                picture.width * picture.height, static_cast<unsigned long long>(ours.invalid()));
    EXPECT_LE(off, 2e-3);
    if (picture.same_paths) {
      EXPECT_LE(differing, picture.width * picture.height / 20);
    }
    EXPECT_EQ(not_finite, 0);
    EXPECT_EQ(invalid, 0);
    EXPECT_EQ(ours.invalid(), theirs.invalid());
    EXPECT_EQ(ours.paths, theirs.paths);
    return expected;
  }

  std::shared_ptr<PathDevice> device_;
};

// ---- hard case 3: places and sizes --------------------------------------------------------------------------------

Object room(int lamp) {
  Object object;
  object.meshes = {box({-1, -1, -1}, {1, 1, 1}, 0, true), box({-0.4f, -1, -0.5f}, {0.2f, -0.3f, 0.1f}, 0),
                   bumpy_ball({0.4f, 0.3f, -0.4f}, 0.3f, 24, 0, false, 7)};
  if (lamp >= 0) object.meshes.push_back(quad({-0.3f, 0.99f, -0.3f}, {0.6f, 0, 0}, {0, 0, 0.6f}, lamp));
  return object;
}

// Under a sky of a million, of which nothing may be seen from within.
SceneDescription placed_room(const Placement& placement, bool lamp) {
  SceneDescription scene;
  scene.materials = {lambert(Rgb(0.7f, 0.6f, 0.5f)), lambert(Rgb(0, 0, 0), Rgb(9, 8, 7))};
  scene.environment = Environment{};
  scene.environment->radiance = Rgb(1e6f, 1e6f, 1e6f);
  place(scene, room(lamp ? 1 : -1), placement);
  return scene;
}

Picture picture_of_room(const Placement& placement, bool lamp) {
  Picture picture;
  picture.description = placed_room(placement, lamp);
  picture.pose = camera_at(placement.place({0.2, 0.1, 0.9}), placement.place({-0.1, -0.2, -1}), 70);
  picture.settings.max_segments = 4;
  picture.settings.roulette_from = 100;
  picture.same_paths = !placement.instanced;
  if (placement.instanced) picture.samples = 1024;
  return picture;
}

TEST_P(VulkanHard, ARoomFarFromTheOriginIsLitAsOnTheProcessor) {
  EXPECT_GT(compare(kPlacements[1].name, picture_of_room(kPlacements[1], true)).x, 0);
}

TEST_P(VulkanHard, RoomsOfAnyPlaceAndSizeAreLitAsOnTheProcessor) {
  HELIO_FULL_TIER_ONLY();
  for (const Placement& placement : kPlacements)
    EXPECT_GT(compare(placement.name, picture_of_room(placement, true)).x, 0);
}

// The lamp is part of the first test alone: whatever is not black here came through a wall.
TEST_P(VulkanHard, ClosedRoomsLetNoLightIn) {
  HELIO_FULL_TIER_ONLY();
  for (const Placement& placement : kPlacements) {
    SCOPED_TRACE(placement.name);
    Picture picture = picture_of_room(placement, false);
    picture.width = picture.height = 128;
    picture.samples = 16;
    const auto scene = build(std::move(picture.description));
    const auto placed = upload(scene);
    ASSERT_TRUE(placed);
    TraceStats stats;
    const Film film = render_on_device(*placed, *scene, picture, {0, 0, 128, 128}, kHalves, stats);
    int lit = 0;
    for (int y = 0; y < 128; ++y) {
      for (int x = 0; x < 128; ++x) lit += moments_of(film, x, y).mean != V3d(0, 0, 0);
    }
    EXPECT_EQ(lit, 0);
    EXPECT_EQ(stats.paths, 128u * 128 * 16 * kHalves);
    EXPECT_EQ(stats.invalid(), 0u);
  }
}

// A floor with a second copy of itself in the same plane, and a ball on it, in the light of a sun that sinks.
TEST_P(VulkanHard, SurfacesInGrazingLightDoNotShadeThemselves) {
  HELIO_FULL_TIER_ONLY();
  for (const Placement& placement : kPlacements) {
    for (const double zenith : {40.0, 89.9}) {
      Picture picture;
      picture.description.materials = {lambert(Rgb(0.5f, 0.5f, 0.5f))};
      PunctualLight sun;
      sun.kind = PunctualKind::directional;
      sun.direction = -V3d(std::sin(zenith * M_PI / 180), std::cos(zenith * M_PI / 180), 0);
      sun.intensity = Rgb(10, 10, 10);
      picture.description.lights = {sun};
      Object object;
      const TriangleMesh floor = quad({-1, 0, 1}, {2, 0, 0}, {0, 0, -2}, 0);
      object.meshes = {floor, floor, bumpy_ball({0, 0.31f, 0}, 0.3f, 24, 0, false, 7)};
      place(picture.description, std::move(object), placement);
      picture.pose = camera_at(placement.place({1.2, 0.9, 1.1}), placement.place({0, 0.2, 0}), 50);
      picture.settings.max_segments = 2;
      const std::string name = std::string(placement.name) + ", zenith " + std::to_string(int(zenith));
      EXPECT_GT(compare(name, std::move(picture)).x, 0);
    }
  }
}

// ---- hard case 4: brightness --------------------------------------------------------------------------------------

TEST_P(VulkanHard, RoomsOfABillionAndAMillionth) {
  HELIO_FULL_TIER_ONLY();
  for (const double x : {0.0, 10.0}) {
    Picture picture{bright_and_dim_room(), in_room_at(x), {}, {}};
    picture.settings.max_segments = 3;
    picture.settings.roulette_from = 100;
    const double expected = x == 0 ? 1.75e9 : 1.75e-6;
    EXPECT_NEAR(compare(x == 0 ? "a billion" : "a millionth", std::move(picture)).x, expected, 0.01 * expected);
  }
}

TEST_P(VulkanHard, PointLightAlmostOnASurfaceAndInACorner) {
  HELIO_FULL_TIER_ONLY();
  for (const double height : {1e-2, 1e-3, 1e-4}) {
    for (const bool corner : {false, true}) {
      Picture picture{light_almost_on_surface(height, corner), beside_light(corner), {}, {}};
      picture.settings.max_segments = 2;
      EXPECT_GT(compare((corner ? "corner, " : "floor, ") + std::to_string(height), std::move(picture)).x, 0);
    }
  }
}

TEST_P(VulkanHard, SunInOneTexel) {
  HELIO_FULL_TIER_ONLY();
  Picture picture{OneTexelSun::scene(), OneTexelSun::pose(), {}, {}};
  picture.settings.max_segments = 2;
  EXPECT_GT(compare("sun", std::move(picture)).x, 0);
}

// Panes of 1e-3 units that emit from 1e-3 to 1e6, over a floor: a light tree of fourteen levels.
TEST_P(VulkanHard, TenThousandLights) {
  HELIO_FULL_TIER_ONLY();
  Picture picture;
  SceneDescription& scene = picture.description;
  scene.materials = {lambert(Rgb(0.5f, 0.5f, 0.5f))};
  add_mesh(scene, quad({-5, 0, 5}, {10, 0, 0}, {0, 0, -10}, 0));
  for (int i = 0; i < 10; ++i) {
    const float radiance = std::pow(10.0f, float(i) - 3);
    scene.materials.push_back(lambert(Rgb(0, 0, 0), Rgb(radiance, radiance, 0.5f * radiance)));
  }
  Random random(3);
  std::vector<TriangleMesh> panes(10);
  for (int i = 0; i < 10; ++i) panes[std::size_t(i)].material = 1 + i;
  for (int i = 0; i < 10000; ++i) {
    const V2f at = random.next_v2f();
    const V3f corner(8 * at.x - 4, 1 + random.next_float(), 8 * at.y - 4);
    TriangleMesh& mesh = panes[std::size_t(i % 10)];
    const auto base = std::uint32_t(mesh.positions.size());
    mesh.positions.insert(mesh.positions.end(), {corner, corner + V3f(1e-3f, 0, 0), corner + V3f(0, 0, 1e-3f)});
    mesh.indices.insert(mesh.indices.end(), {base, base + 1, base + 2});
  }
  for (TriangleMesh& mesh : panes) add_mesh(scene, std::move(mesh));
  picture.pose = camera_at({0, 0.8, 4}, {0, 0, 0}, 60);
  picture.settings.max_segments = 3;
  EXPECT_GT(compare("10,000 lights", std::move(picture)).x, 0);
}

TEST_P(VulkanHard, EmissiveTextureThatIsMostlyBlack) {
  HELIO_FULL_TIER_ONLY();
  Picture picture;
  SceneDescription& scene = picture.description;
  scene = lambert_room();
  Image image;
  image.width = image.height = 32;
  image.channels = 3;
  image.texels.assign(3 * 32 * 32, 0);
  for (const std::size_t texel : {5 * 32 + 7, 20 * 32 + 30}) {
    for (std::size_t c = 0; c < 3; ++c) image.texels[3 * texel + c] = 255;
  }
  scene.images = {image};
  scene.materials[1].emission = Rgb(1e4f, 1e4f, 1e4f);
  scene.materials[1].emission_texture.image = 0;
  scene.materials[1].emission_texture.filter = FilterMode::nearest;
  picture.pose = camera_at({0, 0, 0.9}, {0, -0.2, -1}, 70);
  picture.settings.max_segments = 3;
  EXPECT_GT(compare("mostly black", std::move(picture)).x, 0);
}

// The first scenes of the torture set: on the device as on the processor, or refused by name.
TEST_P(VulkanHard, WhatIsAllowedButExtremeIsFiniteOrRefusedByName) {
  HELIO_FULL_TIER_ONLY();
  constexpr std::uint64_t kScenes = 2;  // each compiles its own shaders, which takes software devices a minute
  std::uint64_t refused = 0;
  for (std::uint64_t seed = 1; seed <= kScenes; ++seed) {
    SCOPED_TRACE("torture scene " + std::to_string(seed));
    Extremes x(seed);
    const float scale = x.log_uniform(1e-4f, 1e6f);
    const auto scene = build(torture_scene(x, scale));
    ASSERT_TRUE(scene);
    Picture picture;
    picture.pose = torture_camera(x, scale);
    picture.settings.seed = seed;
    const auto placed = device_->upload(scene);
    if (!placed.ok()) {
      EXPECT_EQ(placed.error().code, ErrorCode::unimplemented) << placed.error().to_string();
      EXPECT_NE(placed.error().message.find("Vulkan devices do not have"), std::string::npos);
      ++refused;
      continue;
    }
    TraceStats ours, theirs;
    render(*scene, picture.pose, picture.width, picture.height, picture.samples, picture.settings, &theirs);
    const Film film = render_on_device(**placed, *scene, picture, {0, 0, 32, 32}, kHalves, ours);
    EXPECT_EQ(ours.invalid(), theirs.invalid());
    EXPECT_EQ(ours.paths, theirs.paths);
    EXPECT_TRUE(std::isfinite(mean_of(film).mean.x));
  }
  std::printf("torture set: %llu of %llu scenes are refused\n", static_cast<unsigned long long>(refused),
              static_cast<unsigned long long>(kScenes));
  EXPECT_LT(refused, kScenes);
}

// ---- pictures at the end of what may be asked for -----------------------------------------------------------------

Picture small_room() {
  Picture picture;
  picture.description = lambert_room();
  picture.pose = camera_at({0, 0, 0.9}, {0, -0.2, -1}, 70);
  return picture;
}

TEST_P(VulkanHard, BlackScenesAreBlack) {
  HELIO_FULL_TIER_ONLY();
  Picture picture = small_room();
  picture.description.materials[1] = lambert(Rgb(0, 0, 0));
  EXPECT_EQ(compare("a room without lights", picture), V3d(0, 0, 0));
  picture.description.environment = Environment{};
  picture.description.environment->radiance = Rgb(0, 0, 0);
  EXPECT_EQ(compare("a black sky", picture), V3d(0, 0, 0));
  picture.description = SceneDescription();
  EXPECT_EQ(compare("nothing", picture), V3d(0, 0, 0));
}

TEST_P(VulkanHard, ASkyWithNothingUnderItIsSeen) {
  HELIO_FULL_TIER_ONLY();
  Picture picture;
  picture.description.environment = Environment{};
  picture.description.environment->radiance = Rgb(0.25f, 0.5f, 1);
  picture.samples = 4;
  EXPECT_EQ(compare("sky", std::move(picture)), V3d(0.25, 0.5, 1));
}

TEST_P(VulkanHard, OneSampleAndFewSegments) {
  HELIO_FULL_TIER_ONLY();
  for (const int segments : {1, 2, 3}) {
    Picture picture = small_room();
    picture.settings.max_segments = segments;
    picture.pose = camera_at({0, 0.1, 0.9}, {0, 0.2, -1}, 110);  // the lamp is in sight
    EXPECT_GT(compare(std::to_string(segments) + " segments", std::move(picture)).x, 0);
  }
  Picture one = small_room();
  one.samples = 1;
  const auto scene = build(std::move(one.description));
  const auto placed = upload(scene);
  ASSERT_TRUE(placed);
  compare_uploaded("one sample", *placed, *scene, one);
  one.width = one.height = 1;
  compare_uploaded("one pixel", *placed, *scene, one);
  TraceStats stats;
  const Film film = render_on_device(*placed, *scene, one, {0, 0, 1, 1}, 1, stats);
  EXPECT_EQ(stats.paths, 1u);
  EXPECT_EQ(film.half(0, 0, 0).count, 1u);
  EXPECT_EQ(film.half(1, 0, 0).count, 0u);
}

// Three pixels wide, and over the edge of a film that is no multiple of anything.
TEST_P(VulkanHard, WindowsAreWhatTheProcessorHasThere) {
  HELIO_FULL_TIER_ONLY();
  Picture picture = small_room();
  picture.width = 37;
  picture.height = 23;
  const auto scene = build(std::move(picture.description));
  const auto placed = upload(scene);
  ASSERT_TRUE(placed);
  const Film cpu = render(*scene, fitted(picture.pose, 37, 23), 37, 23, picture.samples, picture.settings);
  for (const PixelRect& window : {PixelRect{34, 0, 37, 23}, PixelRect{0, 20, 37, 23}, PixelRect{15, 3, 18, 22},
                                  PixelRect{30, 20, 60, 60}, PixelRect{36, 22, 37, 23}}) {
    SCOPED_TRACE("from " + std::to_string(window.x0) + ',' + std::to_string(window.y0));
    picture.settings.region = intersect(window, cpu.bounds());
    TraceStats stats;
    const Film film = render_on_device(*placed, *scene, picture, window, kHalves, stats);
    EXPECT_EQ(stats.paths, std::uint64_t(picture.settings.region.area()) * picture.samples * kHalves);
    V3d ours(0), theirs(0);
    std::uint64_t outside = 0;
    for (int y = 0; y < 23; ++y) {
      for (int x = 0; x < 37; ++x) {
        if (x >= window.x0 && x < window.x1 && y >= window.y0 && y < window.y1) {
          ours += moments_of(film, x, y).mean;
          theirs += moments_of(cpu, x, y).mean;
        } else {
          outside += film.half(0, x, y).count + film.half(1, x, y).count + film.features(x, y).count;
        }
      }
    }
    EXPECT_EQ(outside, 0u);
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(ours[c], theirs[c], 2e-3 * theirs[c]);
  }
}

TEST_P(VulkanHard, CamerasAndFilters) {
  HELIO_FULL_TIER_ONLY();
  Picture picture = small_room();
  const auto scene = build(std::move(picture.description));
  const auto placed = upload(scene);
  ASSERT_TRUE(placed);
  const PixelFilter filters[] = {{}, {PixelFilterKind::tent, 1}, {PixelFilterKind::tent, 3.7},
                                 {PixelFilterKind::gaussian, 0.5}, {PixelFilterKind::gaussian, 16}};
  const std::pair<const char*, Projection> projections[] = {{"perspective", Projection::perspective},
                                                            {"orthographic", Projection::orthographic}};
  for (const auto& [name, projection] : projections) {
    for (const double lens : {0.0, 0.1}) {
      for (const PixelFilter& filter : filters) {
        picture.pose.projection = projection;
        picture.pose.half_height = 0.8;
        picture.pose.lens_radius = lens;
        picture.pose.focus_distance = 1.2;
        picture.filter = filter;
        compare_uploaded(std::string(name) + (lens > 0 ? ", lens" : "") + ", filter " +
                             std::to_string(int(filter.kind)) + " of " + std::to_string(filter.scale),
                         *placed, *scene, picture);
      }
    }
  }
}

INSTANTIATE_TEST_SUITE_P(, VulkanHard, testing::Values(Level::compute, Level::rt),
                         [](const auto& info) { return std::string(vulkan::level_name(info.param)); });

}  // namespace
}  // namespace helio::test
