// Pictures that draw on earlier ones of a scene that was edited since, against those that do not.
#include <gtest/gtest.h>

#include <cmath>

#include "moments.h"
#include "tests/support/edited_scenes.h"
#include "tests/support/loop_views.h"
#include "z_test.h"

namespace helio::test {
namespace {

constexpr int kWidth = 80, kHeight = 48;

RenderSettings settings_of(RenderMode mode, std::uint64_t seed) {
  RenderSettings settings;
  settings.width = kWidth;
  settings.height = kHeight;
  settings.mode = mode;
  settings.seed = seed;
  return settings;
}

const std::vector<std::pair<const char*, std::vector<SceneEdit>>>& edits() {
  static const std::vector<std::pair<const char*, std::vector<SceneEdit>>> all = {
      {"move", {moved_by(1, {0, 0, 1.2})}},
      {"shine", {shining(1, Rgb(3, 2, 1))}},
      {"sun", {LightEdit{0u, std::nullopt, 0.5}}},
  };
  return all;
}

// Means over the blocks of 16x16 pixels of many pictures: off by no more than the bias that they were allowed.
TEST(EditReuse, BlocksAreNotBiasedBeyondTheirBound) {
  constexpr int kBlock = 16, kColumns = kWidth / kBlock, kBlocks = kColumns * (kHeight / kBlock);
  constexpr int kSeeds = 32;
  const auto base = build(yard());
  RenderEngine engine(2);
  const auto add = [&](const ViewPicture& picture, std::vector<Moments>& blocks) {
    std::vector<double> sums(kBlocks);
    for (int y = 0; y < kHeight; ++y) {
      for (int x = 0; x < kWidth; ++x)
        sums[std::size_t(y / kBlock * kColumns + x / kBlock)] +=
            double(picture.radiance[1][std::size_t(y * kWidth + x)]);
    }
    for (std::size_t b = 0; b < kBlocks; ++b) blocks[b].add(sums[b] / (kBlock * kBlock));
  };
  for (const auto& [name, edit] : edits()) {
    const auto scene = edited(base, edit);
    std::vector<Moments> reused(kBlocks), fresh(kBlocks), bound2(kBlocks);
    for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) {
      LoopViews plain(engine, scene, settings_of(RenderMode::pt, 1000 + seed));
      add(plain.render(yard_camera(), 32), fresh);
      RenderLoopOptions options;
      options.channels = kResolveVariance | kResolveSamples | kResolveHistory;
      LoopViews views(engine, base, settings_of(RenderMode::reproject, seed), options);
      views.render(yard_camera(), 64);
      views.set_scene(scene);
      const ViewPicture& picture = views.render(yard_camera(), 4);
      add(picture, reused);
      for (int y = 0; y < kHeight; ++y) {
        for (int x = 0; x < kWidth; ++x) {
          const double bound = double(picture.bound[std::size_t(y * kWidth + x)]);
          bound2[std::size_t(y / kBlock * kColumns + x / kBlock)].add(bound * bound);
        }
      }
    }
    double worst = 0, off = 0, off_allowed = 0, whole = 0;
    for (std::size_t b = 0; b < kBlocks; ++b) {
      const double difference = reused[b].mean() - fresh[b].mean();
      const double error = std::sqrt(reused[b].variance_of_mean() + fresh[b].variance_of_mean());
      const double allowed = std::sqrt(bound2[b].mean());
      worst = std::max(worst, std::abs(difference) / (allowed + 3 * error));
      off += difference;
      off_allowed += allowed + 3 * error;
      whole += fresh[b].mean();
    }
    std::printf(
        "%s: worst block at %.2f of its bound and three standard errors; whole picture %+.3f %%, bound %.3f %%\n", name,
        worst, 100 * off / whole, 100 * off_allowed / whole);
    EXPECT_LT(worst, 1.2) << name;  // of 15 blocks one is past three standard errors at one time in twenty-five
    EXPECT_LT(std::abs(off), off_allowed) << name;
  }
}

// At rest, a picture that went through an edit is that of the edited scene.
TEST(EditReuse, AtRestThePictureIsTrue) {
  const auto base = build(yard());
  RenderEngine engine(2);
  for (const auto& [name, edit] : edits()) {
    const auto scene = edited(base, edit);
    LoopViews views(engine, base, settings_of(RenderMode::combined, 1)),
        fresh(engine, scene, settings_of(RenderMode::pt, 77));
    views.render(yard_camera(), 256);
    views.set_scene(scene);
    views.render(yard_camera(), 4);
    const ViewPicture& rested = views.render(yard_camera(), 256);
    const ViewPicture& truth = fresh.render(yard_camera(), 2048);
    Estimate rendering{kWidth, kHeight, {}, {}}, reference{kWidth, kHeight, {}, {}};
    for (std::size_t i = 0; i < rested.samples.size(); ++i) {
      const auto at = [i](const std::vector<float>(&channels)[3]) {
        return V3d(channels[0][i], channels[1][i], channels[2][i]);
      };
      rendering.mean.push_back(at(rested.radiance));
      rendering.variance.push_back(at(rested.variance));
      reference.mean.push_back(at(truth.radiance));
      reference.variance.push_back(at(truth.variance));
    }
    const ZTestResult result = z_test(rendering, reference);
    EXPECT_GE(result.pixels_inside, kLeastShare - 0.0025) << name << result.to_string();
    EXPECT_LE(result.worst_tile, 1.5) << name << result.to_string();
  }
}

}  // namespace
}  // namespace helio::test
