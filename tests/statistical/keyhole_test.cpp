// Light that a path finds once in ten thousand tries: no target error is reached before it has been looked for long
// enough, in no mode. What merely misses the scene is black, and ends.
#include <gtest/gtest.h>

#include <cmath>

#include "tests/bench/render_modes.h"
#include "tests/support/loop_picture.h"
#include "tests/support/test_scenes.h"

namespace helio::test {
namespace {

using bench::ComparedMode;
using bench::kRenderModes;

FrameEnd render_to(double error, SceneDescription description, std::uint32_t most_samples, const ComparedMode& mode,
                   std::uint64_t seed = 1) {
  CameraDescription camera;
  camera.name = "camera";
  description.cameras = {camera};  // at the origin, along -z
  const auto scene = build(std::move(description));
  RenderEngine engine(2);
  RenderSettings settings;
  settings.width = settings.height = 32;
  settings.seed = seed;
  mode.choose_in(settings);
  Budget budget;
  budget.error = error;
  budget.samples = most_samples;
  return render_through_loop(engine, scene, settings, budget).end;
}

// A grey room around the camera with a hole of 0.02 x 0.02 in the ceiling, outside of which it is bright. A bounce
// finds the hole with a probability of about 1e-5 to 1e-4; next-event estimation towards the environment no more often.
SceneDescription keyhole() {
  SceneDescription scene;
  scene.materials = {lambert(Rgb(0.5f, 0.5f, 0.5f))};
  TriangleMesh room = box({-1, -1, -1}, {1, 1, 1}, 0, true);
  // The ceiling (y = 1) again, as a frame around the hole.
  std::vector<std::uint32_t> walls;
  for (std::size_t t = 0; t < room.triangle_count(); ++t) {
    bool ceiling = true;
    for (std::size_t k = 0; k < 3; ++k) ceiling &= room.positions[room.indices[3 * t + k]].y == 1;
    if (!ceiling) walls.insert(walls.end(), &room.indices[3 * t], &room.indices[3 * t] + 3);
  }
  room.indices = walls;
  add_mesh(scene, std::move(room));
  constexpr float h = 0.01f;
  add_mesh(scene, quad({-1, 1, -1}, {2, 0, 0}, {0, 0, 1 - h}, 0));
  add_mesh(scene, quad({-1, 1, h}, {2, 0, 0}, {0, 0, 1 - h}, 0));
  add_mesh(scene, quad({-1, 1, -h}, {1 - h, 0, 0}, {0, 0, 2 * h}, 0));
  add_mesh(scene, quad({h, 1, -h}, {1 - h, 0, 0}, {0, 0, 2 * h}, 0));
  Environment bright;
  bright.radiance = Rgb(1e4f, 1e4f, 1e4f);
  scene.environment = bright;
  return scene;
}

TEST(Keyhole, IsNeverCalledConvergedUnlessItIs) {
  for (const ComparedMode& mode : kRenderModes) {
    for (std::uint64_t seed = 1; seed <= 5; ++seed) {
      const FrameEnd end = render_to(0.02, keyhole(), 256, mode, seed);
      EXPECT_EQ(end.reason, FrameEndReason::samples)
          << mode.name << ", seed " << seed << ": at " << end.progress.samples_per_pixel;
    }
  }
}

// Nothing at all to see: no light in a closed room. Merging is not among the modes: within its radius it takes light
// around corners and through walls without thickness, which is its bias.
TEST(Keyhole, AClosedDarkRoomDoesNotConverge) {
  SceneDescription scene;
  scene.materials = {lambert(Rgb(0.5f, 0.5f, 0.5f))};
  add_mesh(scene, box({-1, -1, -1}, {1, 1, 1}, 0, true));
  Environment bright;
  bright.radiance = Rgb(1, 1, 1);
  scene.environment = bright;
  for (const ComparedMode& mode : kRenderModes) {
    if (merges(mode.integrator)) continue;
    SCOPED_TRACE(mode.name);
    const FrameEnd end = render_to(0.02, scene, 256, mode);
    EXPECT_EQ(end.reason, FrameEndReason::samples);
    EXPECT_EQ(end.progress.error.unproven, 1);
    EXPECT_TRUE(std::isinf(end.progress.error.hidden_rmse));
  }
}

// A lit card in front of nothing: the black around it is known to be black. Photons of a lamp that shines everywhere
// leave pixels at the card's edges dark for too long to wait for.
TEST(Keyhole, BlackBesideTheSceneEnds) {
  SceneDescription scene;
  scene.materials = {lambert(Rgb(0.5f, 0.5f, 0.5f))};
  add_mesh(scene, quad({-0.1f, -0.1f, -2}, {0.2f, 0, 0}, {0, 0.2f, 0}, 0));
  PunctualLight light;
  light.position = {0, 0, 1};
  light.intensity = Rgb(5, 5, 5);
  scene.lights = {light};
  for (const ComparedMode& mode : kRenderModes) {
    if (mode.integrator == Integrator::photon) continue;
    SCOPED_TRACE(mode.name);
    const FrameEnd end = render_to(0.02, scene, 65536, mode);
    EXPECT_EQ(end.reason, FrameEndReason::error);
    EXPECT_EQ(end.progress.error.unproven, 0);
  }
}

// A part that no light reaches, in a picture whose brightest sample is known, delays the end and does not prevent it.
TEST(Keyhole, ADarkCornerOfALitPictureEndsLater) {
  SceneDescription scene;
  scene.materials = {lambert(Rgb(0.5f, 0.5f, 0.5f))};
  add_mesh(scene, quad({-2, -2, -2}, {2, 0, 0}, {0, 4, 0}, 0));
  add_mesh(scene, quad({0, -2, -2}, {2, 0, 0}, {0, 4, 0}, 0));
  // The right half of the wall faces away from the light behind a screen along the view.
  add_mesh(scene, quad({0, -4, -2}, {0, 8, 0}, {0, 0, 4}, 0));
  PunctualLight light;
  light.position = {-1, 0, -1};
  light.intensity = Rgb(5, 5, 5);
  scene.lights = {light};
  for (const ComparedMode& mode : kRenderModes) {
    SCOPED_TRACE(mode.name);
    const FrameEnd end = render_to(0.05, scene, 65536, mode);
    EXPECT_EQ(end.reason, FrameEndReason::error);
    EXPECT_GT(end.progress.error.unproven, 0.2);
    EXPECT_LE(std::hypot(end.progress.error.rmse, end.progress.error.hidden_rmse), 0.05);
  }
}

}  // namespace
}  // namespace helio::test
