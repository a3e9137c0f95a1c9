// What the probe makes of scenes whose answer is known for their whole picture: measured against references, as
// helio_bench has them, at 512 rows.
#include "renderer/trace/selection/pilot_render.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/own_scenes.h"

namespace helio::test {
namespace {

constexpr int kWidth = 768, kHeight = 512;

struct Known {
  const char* scene;
  double ratio;  // of bdpt over path, in (error at 16 samples) x (seconds)
};

class PilotRenderOf : public testing::TestWithParam<Known> {
 protected:
  // All sweeps.
  static std::unique_ptr<PilotRender> probe(const std::shared_ptr<const RenderScene>& scene, std::uint64_t seed) {
    PathSettings settings;
    settings.seed = seed;
    auto work = std::make_unique<PilotRender>(scene, camera_pose(scene->description().cameras.at(0)), kWidth, kHeight,
                                              settings, std::make_shared<CancelToken>());
    for (int sweep = 0; sweep < work->sweeps(); ++sweep) {
      for (std::size_t part = 0; part < work->parts(); ++part) work->run(sweep, part);
      work->finish_sweep(sweep);
    }
    return work;
  }
};

// In error x rays.
double ratio_of(const ProbedView& view) {
  TileEstimate sum;
  for (const auto& tile : view.tiles) {
    if (tile) sum.add(*tile);
  }
  return sum.bdpt.error * sum.bdpt.cost / (sum.path.error * sum.path.cost);
}

TEST_P(PilotRenderOf, KnowsWhatTakesLessTime) {
  const auto scene = load_own_scene(GetParam().scene);
  constexpr int kSeeds = 8;
  double sum = 0, squares = 0;
  int right = 0;
  for (std::uint64_t seed = 0; seed < kSeeds; ++seed) {
    const auto work = probe(scene, seed);
    const double on = work->result().pixels_in({0, 0, kWidth, kHeight});
    right += on == (GetParam().ratio < 1 ? double(kWidth) * kHeight : 0.0) ? 1 : 0;
    const double log = std::log(ratio_of(*work->probed()));
    sum += log;
    squares += log * log;
  }
  // The mirror images of Veach's smallest lamps are found by one sample in many.
  EXPECT_GE(right, kSeeds - 2);
  const double mean = sum / kSeeds, deviation = std::sqrt(squares / kSeeds - mean * mean);
  EXPECT_LT(deviation, 0.5);
  EXPECT_NEAR(mean, std::log(GetParam().ratio), std::log(2));
}

INSTANTIATE_TEST_SUITE_P(Scenes, PilotRenderOf,
                         testing::Values(Known{"cornell-box", 2.0}, Known{"veach-plates", 1.6},
                                         Known{"cornell-covered", 0.16}, Known{"cornell-glossy", 0.39}),
                         [](const auto& info) {
                           std::string name = info.param.scene;
                           std::erase(name, '-');
                           return name;
                         });

}  // namespace
}  // namespace helio::test
