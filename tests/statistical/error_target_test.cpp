// "Stop at a standard error of x": in 95 % of the runs the error that the picture has when it stops is between 0.8 x
// and 1.1 x, and it has not taken much more samples than that error needs.
//
// Where it cannot hold: few pixels may make the error. Of Veach's plates at 96x96 ten pixels have 78 % of the variance
// v over 20 seeds; the sum scatters as that of K = (sum v)^2 / sum v^2 = 8 equal ones would. With 32 samples a pixel
// and no rule to stop at all the true error of a run varies by 26 % of its mean, and no target has more than 12 of 20
// runs in its band. The reported error says nothing about which those are (correlation -0.03): no rule that reads it
// can choose better. K grows as the side of the picture does: 16 at 192x192, where 32 samples, known beforehand, would
// have 18 of 20 runs in a band. With the rule, at a target of 0.03, 9 are (0.58 to 1.58): of so few pixels the reported
// error varies as much as the true one. Likewise where a mode leaves the noise to few pixels: of the Cornell box with
// light paths everywhere the edges of the lamp (10 of 20 at 0.015), as with counts that are to make another error small
// than the target is (11 of 20; the setting `measure`).
//
// Where the picture is at the target when the last of a power of two of Sobol's points arrive, that one point may take
// it from above 1 to below 0.8 (3 of 20 runs of the Cornell box at 0.015). Runs of all scenes count together, targets
// on both sides of such a fall among them.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>

#include "tests/bench/render_modes.h"
#include "tests/support/loop_picture.h"
#include "tests/support/own_scenes.h"
#include "tests/support/tier.h"

namespace helio::test {
namespace {

const int kSeeds = by_tier(8, 20), kSide = by_tier(96, 192);

struct Case {
  const char* scene;
  double target;  // radiance units
  bench::ComparedMode mode = bench::kRenderModes[0];
  bool in_short_tier = false;
};

constexpr const bench::ComparedMode &kAdaptive = bench::kRenderModes[1], &kBoth = bench::kRenderModes[5];

constexpr Case kCases[] = {{"cornell-box", 0.02},
                           {"cornell-box", 0.015, bench::kRenderModes[0], true},
                           {"cornell-box", 0.012},
                           {"cornell-glossy", 0.03},
                           {"cornell-spheres", 0.06, bench::kRenderModes[0], true},
                           {"cornell-spheres", 0.04},
                           {"cornell-box", 0.015, kAdaptive},
                           {"cornell-box", 0.01, kAdaptive},
                           {"cornell-glossy", 0.03, kAdaptive, true},
                           {"cornell-covered", 0.008, kBoth, true}};

struct Outcome {
  int good = 0;
  double work = 0, needed = 0;  // samples
};

void run(const Case& c, RenderEngine& engine, Outcome& outcome) {
  const auto scene = load_own_scene(c.scene);
  ASSERT_TRUE(scene);
  const double target = c.target;
  std::vector<std::vector<float>> pictures;  // all channels
  std::vector<double> samples;
  for (int s = 0; s < kSeeds; ++s) {
    RenderSettings settings;
    settings.width = settings.height = kSide;
    settings.seed = 500 + std::uint64_t(s);
    c.mode.choose_in(settings);
    settings.adaptive.measure = ErrorMeasure::rmse;  // what the target is
    Budget budget;
    budget.error = target;
    budget.samples = 65536;
    const LoopPicture picture = render_through_loop(engine, scene, settings, budget);
    const FrameEnd& end = picture.end;
    ASSERT_EQ(end.reason, FrameEndReason::error)
        << end.progress.samples_per_pixel << " samples, error " << end.progress.error.rmse;
    samples.push_back(end.progress.samples_per_pixel);
    pictures.emplace_back();
    for (const auto& channel : picture.channels)
      pictures.back().insert(pictures.back().end(), channel.begin(), channel.end());
  }
  // The truth is the mean of the other runs, whose own error is taken off.
  std::vector<double> sum(pictures[0].size(), 0.0);
  for (const auto& picture : pictures) {
    for (std::size_t i = 0; i < sum.size(); ++i) sum[i] += picture[i];
  }
  int good = 0;
  double lowest = 1e9, highest = 0, work = 0, needed = 0;
  for (int s = 0; s < kSeeds; ++s) {
    double squared = 0;
    for (std::size_t i = 0; i < sum.size(); ++i) {
      const double d = pictures[std::size_t(s)][i] - (sum[i] - pictures[std::size_t(s)][i]) / (kSeeds - 1);
      squared += d * d;
    }
    const double ratio = std::sqrt(squared / double(sum.size()) * (kSeeds - 1) / kSeeds) / target;
    good += ratio >= 0.8 && ratio <= 1.1;
    lowest = std::min(lowest, ratio);
    highest = std::max(highest, ratio);
    work += samples[std::size_t(s)];
    needed += samples[std::size_t(s)] * ratio * ratio;  // error falls at least as the root of the samples
  }
  std::printf(
      "%s, %s at %.3f: true error over target %.3f to %.3f, %d of %d within [0.8, 1.1]; %.0f samples, %.2f x what is "
      "needed\n",
      c.scene, c.mode.name, target, lowest, highest, good, kSeeds, work / kSeeds, work / needed);
  EXPECT_GE(good, 0.75 * kSeeds) << c.scene << " " << c.mode.name << " " << target;
  EXPECT_LE(work, 1.5 * needed) << c.scene << " " << c.mode.name << " " << target;
  outcome.good += good;
  outcome.work += work;
  outcome.needed += needed;
}

TEST(ErrorTarget, IsMetAndNotOvershot) {
  RenderEngine engine(2);
  Outcome outcome;
  int runs = 0;
  for (const Case& c : kCases) {
    if (!c.in_short_tier && !full_tier()) continue;
    run(c, engine, outcome);
    runs += kSeeds;
  }
  // A quarter of the pixels make a quarter of what a run's error is known by: a run in eight may leave the band.
  EXPECT_GE(outcome.good, by_tier(0.85, 0.95) * runs);
  EXPECT_LE(outcome.work, 1.25 * outcome.needed);
}

}  // namespace
}  // namespace helio::test
