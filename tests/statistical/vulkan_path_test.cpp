// Paths on a Vulkan device against the processor's, on the same scenes: by the device's best level, and by our own BVH
// where it has another.
//
// With the same seed both draw the same random numbers, so that the means of a picture hardly differ by noise; with
// another they are independent, for the z-tests. Both halves of a film take part.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <vector>

#include "renderer/scene/load/scene_loader.h"
#include "tests/statistical/closed_form_scenes.h"
#include "tests/statistical/estimates.h"
#include "tests/support/shared_data.h"
#include "tests/support/test_scenes.h"
#include "tests/support/tier.h"
#include "tests/support/vulkan_level.h"

namespace helio {
namespace {

using vulkan::Level;
using vulkan::PathDevice;

struct Subject {
  const char* name;
  const char* folder;  // under ../shared
  const char* file;
  bool short_tier = false;
};

constexpr const char* kReferences = "scenes/mitsuba-references";

const Subject kSubjects[] = {
    {"box_checker", kReferences, "box-checker.xml"},
    {"ggx_conductors", kReferences, "ggx-conductors.xml"},
    {"beckmann_anisotropic", kReferences, "beckmann-anisotropic.xml"},
    {"glass_and_frosted", kReferences, "glass-and-frosted.xml", true},
    {"plastics_and_pane", kReferences, "plastics-and-pane.xml"},
    {"principled_grid", kReferences, "principled-grid.xml", true},
    {"environment_map", kReferences, "environment-map.xml", true},
    {"delta_lights", kReferences, "delta-lights.xml", true},
    {"textures_normal_blend_mask", kReferences, "textures-normal-blend-mask.xml", true},
    {"instances_shapes_thinlens", kReferences, "instances-shapes-thinlens.xml", true},
    {"alpha_mask", "scenes/gltf-features/blender-io/01_alpha_mask", "01_alpha_mask.gltf"},
    {"texture_wrapping", "scenes/gltf-features/blender-io/13_texture_wrapping", "13_texture_wrapping.gltf"},
    {"transmission", "scenes/gltf-features/blender-io/15_transmission", "15_transmission.gltf"},
    {"lights", "scenes/gltf-features/blender-io/04_lights", "04_lights.gltf", true},
};

struct Picture {
  std::shared_ptr<const RenderScene> scene;
  CameraPose pose;
  PixelFilter filter;
  PathSettings settings;
};

class VulkanAgreement : public testing::Test {
 protected:
  static constexpr int kSide = 32;

  // Of the device.
  static Film render(PathDevice& device, const vulkan::SceneOnDevice& placed, const Picture& picture,
                     std::uint32_t samples, TraceStats& stats) {
    Film film(kSide, kSide);
    const Camera camera(fitted(picture.pose, kSide, kSide), kSide, kSide, picture.scene->origin(), picture.filter);
    const CancelToken never;
    for (int half = 0; half < kHalves; ++half) {
      const auto done =
          device.trace(placed, camera, picture.settings, {half, 0, samples}, film.bounds(), never, film, stats);
      EXPECT_TRUE(done.ok() && *done) << (done.ok() ? "cancelled" : done.error().to_string());
    }
    return film;
  }

  static void compare(const char* name, Level level, Picture picture) {
    PathDevice& device = *test::device_of(level);
    const auto placed = device.upload(picture.scene);
    ASSERT_TRUE(placed.ok()) << placed.error().to_string();
    const std::uint32_t samples = test::by_tier(128u, 1024u);
    TraceStats ours, theirs, others;
    const Film cpu = test::render(*picture.scene, fitted(picture.pose, kSide, kSide), kSide, kSide, samples,
                                  picture.settings, &ours, picture.filter);
    const Film same = render(device, **placed, picture, samples, theirs);
    picture.settings.seed += 1;
    const Film other = render(device, **placed, picture, samples, others);

    const test::MeanEstimate cpu_mean = test::mean_of(cpu), same_mean = test::mean_of(same),
                             other_mean = test::mean_of(other);
    double off = 0, deviations = 0;
    for (int c = 0; c < 3; ++c) {
      if (cpu_mean.mean[c] > 0) off = std::max(off, std::abs(same_mean.mean[c] / cpu_mean.mean[c] - 1));
      const double error = std::hypot(cpu_mean.standard_error[c], other_mean.standard_error[c]);
      const double rounding = 1e-6 * cpu_mean.mean[c];
      deviations = std::max(deviations, std::abs(other_mean.mean[c] - cpu_mean.mean[c]) / (error + rounding));
    }
    const test::ZTestResult z = test::z_test(test::estimate_of(other), test::estimate_of(cpu));
    std::printf("%s by %s: mean off by %.2g with the same seed, %.2g standard errors with another; rays %.4f; %s\n",
                name, std::string(vulkan::level_name(level)).c_str(), off, deviations,
                double(theirs.rays) / double(ours.rays), z.to_string().c_str());
    EXPECT_LE(off, 2e-3);
    EXPECT_LE(deviations, 3);
    EXPECT_TRUE(z.passed()) << z.to_string();
    EXPECT_NEAR(double(theirs.rays) / double(ours.rays), 1, 5e-3);
    EXPECT_EQ(theirs.invalid(), ours.invalid());
    EXPECT_EQ(theirs.paths, ours.paths);

    // What is seen first is the same in every respect.
    double depth_off = 0;
    int other_primitives = 0;
    for (int y = 0; y < kSide; ++y) {
      for (int x = 0; x < kSide; ++x) {
        const PixelFeatures &a = cpu.features(x, y), &b = same.features(x, y);
        other_primitives += a.primitive != b.primitive;
        if (a.primitive == b.primitive && std::isfinite(a.depth) && a.depth > 0)
          depth_off = std::max(depth_off, std::abs(double(b.depth) / a.depth - 1));
      }
    }
    EXPECT_LE(other_primitives, kSide * kSide / 100);
    EXPECT_LE(depth_off, 1e-4);
  }
};

class VulkanPath : public VulkanAgreement, public testing::WithParamInterface<std::tuple<Level, Subject>> {
  void SetUp() override { test::device_of(std::get<0>(GetParam())); }
};

TEST_P(VulkanPath, EstimatesWhatTheProcessorDoes) {
  const auto& [level, subject] = GetParam();
  if (!subject.short_tier) HELIO_FULL_TIER_ONLY();
  HELIO_SHARED_OR_SKIP(root, subject.folder);
  Result<SceneDescription> description = load_scene(*make_directory_source(root.string()), subject.file, {});
  ASSERT_TRUE(description.ok()) << description.error().to_string();
  Picture picture;
  picture.pose = camera_pose(description->cameras.front());
  picture.filter = description->cameras.front().filter.value_or(PixelFilter{});
  if (description->hints.max_segments > 0) picture.settings.max_segments = description->hints.max_segments;
  if (description->hints.roulette_from > 0) picture.settings.roulette_from = description->hints.roulette_from;
  picture.scene = test::build(std::move(*description));
  ASSERT_TRUE(picture.scene);
  compare(subject.name, level, picture);
}

INSTANTIATE_TEST_SUITE_P(Scenes, VulkanPath,
                         testing::Combine(testing::Values(Level::compute, Level::rt), testing::ValuesIn(kSubjects)),
                         [](const auto& info) {
                           return std::string(std::get<1>(info.param).name) + "_by_" +
                                  std::string(vulkan::level_name(std::get<0>(info.param)));
                         });

class VulkanClosedForm : public VulkanAgreement,
                         public testing::WithParamInterface<std::tuple<Level, test::NamedScene>> {
  void SetUp() override { test::device_of(std::get<0>(GetParam())); }
};

TEST_P(VulkanClosedForm, EstimatesWhatTheProcessorDoes) {
  const auto& [level, named] = GetParam();
  const std::string name = named.name;
  if (name != "GlassSphereInFurnace" && name != "AbsorbingSlab") HELIO_FULL_TIER_ONLY();
  test::ClosedFormScene closed = named.make();
  Picture picture;
  picture.pose = test::pose_of(closed, test::CameraKind::perspective);
  picture.settings.max_segments = closed.max_segments;
  picture.scene = test::build(std::move(closed.description));
  ASSERT_TRUE(picture.scene);
  compare(named.name, level, picture);
}

INSTANTIATE_TEST_SUITE_P(Scenes, VulkanClosedForm,
                         testing::Combine(testing::Values(Level::compute, Level::rt),
                                          testing::ValuesIn(test::closed_form_scenes().begin(),
                                                            test::closed_form_scenes().end())),
                         [](const auto& info) {
                           return std::string(std::get<1>(info.param).name) + "_by_" +
                                  std::string(vulkan::level_name(std::get<0>(info.param)));
                         });

}  // namespace
}  // namespace helio
