// Hard case 8: films of one pixel, of odd sizes and of one row or column, rendered as the product renders them.
#include <gtest/gtest.h>

#include <cmath>

#include "tests/bench/render_modes.h"
#include "tests/support/loop_picture.h"
#include "tests/support/test_scenes.h"

namespace helio::test {
namespace {

TEST(FilmShapes, AreRenderedWholeInEveryMode) {
  // A room that emits 1 and reflects a half: 1.75 with three segments, from everywhere and in every direction.
  SceneDescription description;
  description.materials = {lambert(Rgb(0.5f, 0.5f, 0.5f), Rgb(1, 1, 1))};
  add_mesh(description, box({-1, -1, -1}, {1, 1, 1}, 0, true));
  const auto scene = build(std::move(description));
  RenderEngine engine(2);
  Budget budget;
  budget.samples = 16;
  for (const bench::ComparedMode& mode : bench::kRenderModes) {
    for (const auto& [width, height] : {std::pair(1, 1), {7, 13}, {16384, 1}, {1, 16384}}) {
      SCOPED_TRACE(mode.name + std::string(", ") + std::to_string(width) + "x" + std::to_string(height));
      RenderSettings settings;
      settings.width = width;
      settings.height = height;
      settings.max_segments = 3;
      settings.roulette_from = 100;
      mode.choose_in(settings);
      const LoopPicture picture =
          render_through_loop(engine, scene, settings, budget, camera_at({0.2, 0.1, 0.3}, {1, 0.4, 0.2}, 0.1));
      ASSERT_EQ(picture.end.reason, FrameEndReason::samples);
      EXPECT_EQ(picture.end.progress.trace.invalid_samples, 0u);
      double sum = 0;
      for (const float value : picture.channels[0]) {
        ASSERT_TRUE(value >= 0.999f && std::isfinite(value));  // 1 is what each pixel shines with itself
        sum += value;
      }
      const double mean = sum / double(picture.channels[0].size());
      // Light paths of a few pixels are few, and few photons come near so thin a strip, or none.
      const bool few = picture.channels[0].size() < 1000, photons = mode.integrator == Integrator::photon;
      const double tolerance = mode.integrator == Integrator::path ? 0.05
                               : photons                           ? (few ? 1 : 0.5)
                               : few                               ? 0.5
                                                                   : 0.05;
      EXPECT_NEAR(mean, 1.75, tolerance);
    }
  }
}

}  // namespace
}  // namespace helio::test
