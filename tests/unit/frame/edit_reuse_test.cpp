// Modes that reuse pictures, through scenes that are edited.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <map>

#include "renderer/trace/gbuffer/primary_hits.h"
#include "tests/support/edited_scenes.h"
#include "tests/support/loop_views.h"
#include "tests/support/small_rooms.h"

namespace helio::test {
namespace {

constexpr int kWidth = 126, kHeight = 72;
constexpr std::uint32_t kRest = 128;

using Scene = std::shared_ptr<const RenderScene>;

RenderSettings settings_of(RenderMode mode) {
  return loop_settings(kWidth, kHeight, mode);
}

// What the centres of the pixels meet: instance and material; ~0 and -1: nothing.
struct Shown {
  std::vector<std::uint32_t> instances;
  std::vector<int> materials;
};
Shown shown(const Scene& scene, const CameraPose& pose) {
  Shown result;
  const Camera camera(pose, kWidth, kHeight, scene->origin());
  PrimaryHits centres(*scene, camera, pose.forward);
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      centres.trace({x, y, x + 1, y + 1});
      result.instances.push_back(centres.at(x, y).instance);
      result.materials.push_back(centres.material(x, y));
    }
  }
  return result;
}

double mean_over(const std::vector<float>& values, const std::vector<bool>& where) {
  double sum = 0, n = 0;
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (!where[i]) continue;
    sum += double(values[i]);
    ++n;
  }
  EXPECT_GT(n, 0.005 * double(values.size()));  // else the mean says little
  return sum / std::max(n, 1.0);
}

std::vector<bool> pixels(const std::function<bool(std::size_t)>& which) {
  std::vector<bool> result(std::size_t(kWidth * kHeight));
  for (std::size_t i = 0; i < result.size(); ++i) result[i] = which(i);
  return result;
}

class EditReuse : public testing::TestWithParam<RenderMode> {
 protected:
  std::unique_ptr<LoopViews> rested(const Scene& scene, const CameraPose& pose = yard_camera()) {
    auto views = std::make_unique<LoopViews>(engine, scene, settings_of(GetParam()));
    views->render(pose, kRest);
    return views;
  }
  // From scratch; once for all tests.
  const ViewPicture& truth(const Scene& scene) {
    static std::map<Scene, ViewPicture> pictures;
    if (const auto known = pictures.find(scene); known != pictures.end()) return known->second;
    RenderSettings settings = settings_of(RenderMode::pt);
    settings.seed = 77;
    return pictures[scene] = LoopViews(engine, scene, settings).render(yard_camera(), 512);
  }
  static Scene scene_with(const std::string& name, const std::vector<SceneEdit>& edits) {
    static std::map<std::string, Scene> scenes;
    Scene& scene = scenes[name];
    if (!scene) scene = name == "base" ? build(yard()) : edited(scenes.at("base"), edits);
    return scene;
  }

  RenderEngine engine{2};
  const Scene base = scene_with("base", {});
  const Scene moved = scene_with("move", {moved_by(1, {0, 0, 1.2})});
};

TEST_P(EditReuse, WhatIsFarFromTheEditStaysAndWhatItDarkensGoes) {
  const ViewPicture &before = truth(base), &after = truth(moved);
  const auto change = [&](std::size_t i) {
    return std::abs(double(after.radiance[1][i]) - double(before.radiance[1][i])) / double(before.radiance[1][i]);
  };
  const Shown here = shown(moved, yard_camera()), there = shown(base, yard_camera());
  const auto on_floor = [&](std::size_t i) { return here.instances[i] == 0 && there.instances[i] == 0; };
  const auto far = pixels([&](std::size_t i) { return int(i) % kWidth > kWidth * 2 / 3 && change(i) < 0.02; });
  const auto shadow = pixels([&](std::size_t i) { return on_floor(i) && change(i) > 0.4; });
  const auto box = pixels([&](std::size_t i) { return here.instances[i] == 1; });

  const auto rest = rested(base);
  LoopViews& views = *rest;
  views.set_scene(moved);
  const ViewPicture picture = views.render(yard_camera(), 2);
  EXPECT_GT(picture.end.progress.reuse_share, 0.8);
  EXPECT_GT(mean_over(picture.samples, far), 0.5 * kRest);
  // Modes that allocate give noisy pixels more fresh samples: 7 % to 30 % of kRest, by seed. All of the old: 75 %.
  EXPECT_LT(mean_over(picture.samples, shadow), (allocates(GetParam()) ? 0.45 : 0.15) * kRest);
  EXPECT_LT(mean_over(picture.samples, box), allocates(GetParam()) ? 0.25 * kRest : 2.001);  // fresh ones alone

  // Not wrong any more where the shadow was and where it is, once a few samples are there.
  const ViewPicture& later = views.render(yard_camera(), 16);
  double squared = 0, reported = 0, stale = 0, left = 0;
  for (std::size_t i = 0; i < shadow.size(); ++i) {
    if (!shadow[i]) continue;
    const double off = double(later.radiance[1][i]) - double(after.radiance[1][i]);
    const double old = double(before.radiance[1][i]) - double(after.radiance[1][i]);
    squared += off * off;
    reported += double(later.variance[1][i]);
    left += off * old;
    stale += old * old;
  }
  std::printf("far %.1f samples, in the shadow %.1f; %.3f of what was there is left\n", mean_over(picture.samples, far),
              mean_over(picture.samples, shadow), left / stale);
  EXPECT_LT(std::abs(left), 0.08 * stale);
  EXPECT_LT(std::sqrt(squared), 3 * std::sqrt(reported));
}

TEST_P(EditReuse, TheWholePictureKeepsItsReportedError) {
  const std::vector<std::pair<const char*, std::vector<SceneEdit>>> edits = {
      {"move", {moved_by(1, {0, 0, 1.2})}},           {"out of view", {moved_by(2, {40, 0, 0})}},
      {"paint", {painted(0, Rgb(0.2f, 0.5f, 0.3f))}}, {"shine", {shining(1, Rgb(3, 2, 1))}},
      {"sun", {LightEdit{0u, std::nullopt, 0.5}}},    {"sky", {EnvironmentEdit{Rgb(0.5f, 0.3f, 0.3f), 1}}}};
  for (const auto& [name, edit] : edits) {
    SCOPED_TRACE(name);
    const Scene scene = scene_with(name, edit);
    const ViewPicture& after = truth(scene);
    const auto rest = rested(base);
    LoopViews& views = *rest;
    views.set_scene(scene);
    for (const std::uint32_t samples : {2u, 8u, 64u}) {
      const ViewPicture& picture = views.render(yard_camera(), samples);
      double squared = 0, reported = 0, inside = 0;
      for (int c = 0; c < 3; ++c) {
        for (std::size_t i = 0; i < picture.samples.size(); ++i) {
          const double off = double(picture.radiance[c][i]) - double(after.radiance[c][i]);
          const double variance = double(picture.variance[c][i]) + double(after.variance[c][i]);
          squared += off * off;
          reported += variance;
          inside += off * off <= 9 * variance + 1e-12;
        }
      }
      std::printf("%s, %u samples: reuse %.2f, reported over true error %.2f, %.2f %% within 3\n", name, samples,
                  picture.end.progress.reuse_share, std::sqrt(reported / squared),
                  inside / (0.03 * double(picture.samples.size())));
      EXPECT_GT(std::sqrt(reported / squared), 0.6);
      EXPECT_GT(inside, 0.97 * 3 * double(picture.samples.size()));
    }
  }
}

TEST_P(EditReuse, WhatWasRepaintedStartsOver) {
  // An object of two materials, of which one is repainted, and one of that material alone.
  SceneDescription description = yard();
  Object two;
  two.meshes = {quad({-1, 0.5f, 1}, {1, 0, 0}, {0, 1.5f, 0}, 1), quad({0, 0.5f, 1}, {1, 0, 0}, {0, 1.5f, 0}, 2)};
  add_instance(description, add_object(description, two));
  const Scene before = build(description), after = edited(before, {painted(1, Rgb(0.1f, 0.8f, 0.2f))});
  const Shown there = shown(before, yard_camera());
  const auto rest = rested(before);
  LoopViews& views = *rest;
  views.set_scene(after);
  const ViewPicture& picture = views.render(yard_camera(), 2);
  double kept = 0, most = 0;
  for (std::size_t i = 0; i < there.instances.size(); ++i) {
    if (there.materials[i] == 1) most = std::max(most, double(picture.samples[i]));
    if (there.instances[i] == 3 && there.materials[i] == 2) kept = std::max(kept, double(picture.samples[i]));
  }
  if (!allocates(GetParam())) {
    EXPECT_EQ(most, 2);
  }
  EXPECT_GT(kept, 4);  // next to what was repainted little is trusted, but it is kept
}

TEST_P(EditReuse, NothingChangedKeepsTheBits) {
  const auto rest = rested(base);
  LoopViews& views = *rest;
  views.render(turned_and_shifted(yard_camera(), 2, 0), 16);
  const ViewPicture picture = views.render(yard_camera(), 16);
  for (const Scene& same : {edited(base, {}), edited(base, {moved_by(1, {0, 0, 0})}), base}) {
    views.set_scene(same);
    EXPECT_TRUE(same_pixels(views.render(yard_camera(), 16), picture));
  }
  // The sources are as good as ever, too.
  views.set_scene(edited(base, {}));
  EXPECT_GT(views.render(turned_and_shifted(yard_camera(), 0.5, 0), 2).end.progress.reuse_share, 0.9);
}

TEST_P(EditReuse, LightsScaledAlikeKeepEverything) {
  const auto rest = rested(base);
  LoopViews& views = *rest;
  const ViewPicture before = views.render(yard_camera(), kRest);
  views.set_scene(edited(base, {LightEdit{0u, std::nullopt, 2}, EnvironmentEdit{std::nullopt, 2}}));
  Budget at_once;
  at_once.time_s = 1e-9;  // nothing but what is carried over
  const ViewPicture& after = views.render(yard_camera(), at_once);
  // As many as without an edit: nothing was measured.
  const auto unedited = rested(base);
  unedited->render(turned_and_shifted(yard_camera(), 2, 0), 1);
  EXPECT_EQ(after.end.progress.verification_rays, unedited->render(yard_camera(), 1).end.progress.verification_rays);
  // Of the error of a pixel: what packing its halves' means loses (packed_values.h).
  double off = 0;
  for (int c = 0; c < 3; ++c) {
    for (std::size_t i = 0; i < after.samples.size(); ++i) {
      const double error = std::sqrt(double(before.variance[c][i])) + 1e-3 * double(before.radiance[c][i]);
      off = std::max(off, std::abs(double(after.radiance[c][i]) / 2 - double(before.radiance[c][i])) / error);
      EXPECT_NEAR(after.samples[i], before.samples[i], 1e-3 * double(before.samples[i]));
    }
  }
  EXPECT_LT(off, 0.02);
}

TEST_P(EditReuse, MeasuringCostsAFewPercentOfAFrame) {
  const auto rest = rested(base);
  LoopViews& views = *rest;
  views.set_scene(moved);
  const ViewPicture& picture = views.render(yard_camera(), 2);
  const auto& progress = picture.end.progress;
  const double frame = double(progress.trace.rays) / (double(progress.trace.paths) / (kWidth * kHeight));
  const auto unedited = rested(base);
  unedited->render(turned_and_shifted(yard_camera(), 2, 0), 1);
  const double measuring =
      double(progress.verification_rays) - double(unedited->render(yard_camera(), 1).end.progress.verification_rays);
  EXPECT_GT(measuring, 0);
  EXPECT_LT(measuring, 0.15 * frame);
}

TEST_P(EditReuse, EditsInARowAddUpAndComeBack) {
  const auto rest = rested(base);
  LoopViews& views = *rest;
  for (int step = 1; step <= 6; ++step) {
    views.set_scene(edited(base, {moved_by(1, {0, 0, 0.2 * step})}));
    views.render(yard_camera(), 1);
  }
  views.set_scene(base);
  const ViewPicture& back = views.render(yard_camera(), 2);
  const auto right = pixels([&](std::size_t i) { return int(i) % kWidth > kWidth * 3 / 4; });
  EXPECT_GT(mean_over(back.samples, right), 0.1 * kRest);
  const ViewPicture& after = truth(base);
  double squared = 0, reported = 0;
  for (std::size_t i = 0; i < after.samples.size(); ++i) {
    squared += std::pow(double(back.radiance[1][i]) - double(after.radiance[1][i]), 2);
    reported += double(back.variance[1][i]) + double(after.variance[1][i]);
  }
  EXPECT_GT(std::sqrt(reported / squared), 0.6);
}

TEST_P(EditReuse, AnEditWithAMoveOfTheCameraKeepsWhatBothLeave) {
  const auto rest = rested(base, turned_and_shifted(yard_camera(), 3, 0));
  LoopViews& views = *rest;
  views.set_scene(moved);
  EXPECT_GT(views.render(yard_camera(), 2).end.progress.reuse_share, 0.7);
}

TEST_P(EditReuse, AnotherLoadBeginsAnew) {
  const auto rest = rested(base);
  LoopViews& views = *rest;
  views.set_scene(build(yard()));
  EXPECT_EQ(views.render(yard_camera(), 2).end.progress.reuse_share, 0);
  views.set_scene(build(lambert_room()));
  EXPECT_EQ(views.render(camera_at({0.1, 0.1, 0.9}, {0, -0.2, -1}, 60), 2).end.progress.reuse_share, 0);
}

TEST_P(EditReuse, BitsDependNeitherOnThreadsNorOnTiles) {
  std::vector<ViewPicture> pictures;
  for (const auto& [threads, tile] : {std::pair(1, 128), std::pair(2, 16)}) {
    RenderEngine own(threads);
    RenderLoopOptions options;
    options.tile_size = tile;
    LoopViews views(own, base, settings_of(GetParam()), options);
    views.render(turned_and_shifted(yard_camera(), 3, 0.1), 16);
    views.render(yard_camera(), 4);
    views.set_scene(moved);
    views.render(yard_camera(), 4);
    views.set_scene(edited(moved, {painted(2, Rgb(1, 1, 1)), LightEdit{0u, std::nullopt, 1.1}}));
    pictures.push_back(views.render(turned_and_shifted(yard_camera(), 1, 0), 8));
  }
  EXPECT_GT(pictures[0].end.progress.reuse_share, 0.1);
  EXPECT_TRUE(same_pixels(pictures[0], pictures[1]));
}

TEST_P(EditReuse, EditsInterruptedAnywhereAreAllHeeded) {
  // Edits that supersede one another at every stage, the last of them the one that counts.
  const auto rest = rested(base);
  LoopViews& views = *rest;
  std::vector<Scene> scenes;
  for (int i = 0; i < 8; ++i) scenes.push_back(edited(base, {moved_by(1, {0, 0, 0.15 * (i + 1)})}));
  for (int i = 0; i < 40; ++i) {
    RenderLoop::Update update;
    update.scene = scenes[std::size_t(i % 8)];
    views.loop().update(update);
    const double until = now_s() + 2e-4 * i;
    while (now_s() < until) {
    }
  }
  views.set_scene(moved);
  views.render(yard_camera(), 2);
  const ViewPicture& picture = views.render(yard_camera(), 16);
  EXPECT_EQ(picture.end.reason, FrameEndReason::samples);
  for (const float n : picture.samples) EXPECT_GE(n, 2);
  const ViewPicture& after = truth(moved);
  double squared = 0, reported = 0;
  for (std::size_t i = 0; i < after.samples.size(); ++i) {
    squared += std::pow(double(picture.radiance[1][i]) - double(after.radiance[1][i]), 2);
    reported += double(picture.variance[1][i]) + double(after.variance[1][i]);
  }
  EXPECT_GT(std::sqrt(reported / squared), 0.6);
}

TEST_P(EditReuse, LightThatIsScaledAgainAndAgainIsScaledOnce) {
  // All that shines, as a hand on a slider sets it, each before the picture of the last is done. Pixels scaled twice
  // would be off by a factor that no bound tells of.
  const auto brighter = [&](double factor) {
    return edited(base, {LightEdit{0u, std::nullopt, factor}, EnvironmentEdit{std::nullopt, factor}});
  };
  std::vector<Scene> scenes;
  for (int i = 0; i < 8; ++i) scenes.push_back(brighter(1.2 + 0.1 * i));
  const Scene last = brighter(2);
  const auto rest = rested(base);
  LoopViews& views = *rest;
  for (int i = 0; i < 60; ++i) {
    RenderLoop::Update update;
    update.scene = scenes[std::size_t(i % 8)];
    views.loop().update(update);
    const double until = now_s() + 5e-5 * i;
    while (now_s() < until) {
    }
  }
  views.set_scene(last);
  const ViewPicture& picture = views.render(yard_camera(), 8);
  const ViewPicture& after = truth(last);
  double sum = 0, expected = 0;
  for (std::size_t i = 0; i < after.samples.size(); ++i) {
    sum += double(picture.radiance[1][i]);
    expected += double(after.radiance[1][i]);
  }
  EXPECT_NEAR(sum / expected, 1, 0.05);
}

TEST_P(EditReuse, AnEditedSceneIsFreedOnceNothingIsOwedToIt) {
  const auto rest = rested(base);
  LoopViews& views = *rest;
  Scene between = edited(base, {moved_by(1, {0, 0, 0.5})});
  const std::weak_ptr<const RenderScene> watched = between;
  views.set_scene(std::exchange(between, nullptr));
  views.render(yard_camera(), 2);
  views.set_scene(moved);
  views.render(yard_camera(), 2);
  EXPECT_TRUE(watched.expired());
}

INSTANTIATE_TEST_SUITE_P(Modes, EditReuse, testing::Values(RenderMode::reproject, RenderMode::combined),
                         [](const auto& test) { return to_string(test.param); });

}  // namespace
}  // namespace helio::test
