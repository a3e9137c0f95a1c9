// Reprojection as published (Schalk 2018), through the render loop.
#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>

#include "renderer/film/core/film.h"
#include "renderer/film/core/sample_targets.h"
#include "renderer/film/history/film_history.h"
#include "renderer/frame/paper/paper_film.h"
#include "renderer/frame/paper/threshold_allocation.h"
#include "renderer/metrics/error_metrics.h"
#include "tests/support/loop_views.h"
#include "tests/support/small_rooms.h"

namespace helio::test {
namespace {

constexpr int kWidth = 61, kHeight = 45;

RenderSettings settings_of(RenderMode mode, int stored_hits = 4) {
  RenderSettings settings;
  settings.width = kWidth;
  settings.height = kHeight;
  settings.mode = mode;
  settings.variant = ModeVariant::paper;
  settings.adaptive = {kPaperMinSamples, 16, ErrorMeasure::relmse};
  settings.reprojection.stored_hits = stored_hits;
  settings.seed = 5;
  return settings;
}

CameraPose home() {
  return camera_at({0.1, 0.1, 0.9}, {0, -0.2, -1}, 60);
}

// In the mixed scene, past the pane that lets half of the samples through: pixels of it show two depths.
CameraPose past_the_pane() {
  return camera_at({0.1, 0.1, 0.55}, {0, -0.2, -1}, 60);
}

double seconds_of(const ViewPicture& picture, const std::string& pass) {
  for (const PassTime& time : picture.end.passes) {
    if (time.pass == pass) return time.seconds;
  }
  return 0;
}

class PaperReuseFrame : public testing::TestWithParam<RenderMode> {
 protected:
  RenderEngine engine{2};
  std::shared_ptr<const RenderScene> room = build(lambert_room()), mixed = build(mixed_scene());
};

TEST_P(PaperReuseFrame, TheFirstPictureIsThatOfTheModeWithoutReuse) {
  RenderSettings plain = settings_of(allocates(GetParam()) ? RenderMode::adaptive : RenderMode::pt);
  for (const auto& scene : {room, mixed}) {
    LoopViews reusing(engine, scene, settings_of(GetParam())), other(engine, scene, plain);
    const ViewPicture& picture = reusing.render(home(), 24);
    EXPECT_EQ(picture.end.progress.reuse_share, 0);
    EXPECT_EQ(picture.end.progress.verification_rays, 0u);
    const ViewPicture expected = other.render(home(), 24);
    EXPECT_EQ(picture.radiance[1], expected.radiance[1]);
    EXPECT_EQ(picture.samples, expected.samples);
  }
}

TEST_P(PaperReuseFrame, ATurnKeepsWhatIsStillTrue) {
  LoopViews views(engine, room, settings_of(GetParam())), fresh(engine, room, settings_of(RenderMode::pt));
  views.render(turned_and_shifted(home(), 4, 0), 256);
  const ViewPicture moved = views.render(home(), 2);
  EXPECT_GT(moved.end.progress.reuse_share, 0.9);
  EXPECT_GT(moved.end.progress.verification_rays, std::uint64_t(2 * kWidth * kHeight));  // of four hits a pixel
  EXPECT_LT(moved.end.progress.verification_rays, std::uint64_t(4 * kWidth * kHeight));
  EXPECT_GT(seconds_of(moved, "reproject"), 0);
  EXPECT_EQ(seconds_of(moved, "review"), 0);
  const ViewPicture truth = fresh.render(home(), 4096);
  LoopViews restarted(engine, room, settings_of(RenderMode::pt));
  const ViewPicture restart = restarted.render(home(), 2);
  EXPECT_LT(squared_error(moved.view(), truth.view())->mse, 0.5 * squared_error(restart.view(), truth.view())->mse);
  // More than one copy of a pixel may have got samples, and every pixel has some.
  EXPECT_GE(*std::min_element(moved.samples.begin(), moved.samples.end()), 1);
}

TEST_P(PaperReuseFrame, FourStoredHitsCarryMoreThanOne) {
  const auto share = [&](int stored_hits) {
    LoopViews views(engine, room, settings_of(GetParam(), stored_hits));
    views.render(turned_and_shifted(home(), 2, 0), 64);
    return views.render(home(), 2).end.progress.reuse_share * mean_samples(views.render(home(), 2));
  };
  EXPECT_GT(share(4), 1.2 * share(1));
}

TEST_P(PaperReuseFrame, TheSameViewKeepsItsBits) {
  LoopViews views(engine, mixed, settings_of(GetParam()));
  views.render(turned_and_shifted(past_the_pane(), 3, 0.02), 16);
  const ViewPicture moved = views.render(past_the_pane(), 16);
  EXPECT_TRUE(same_pixels(views.render(past_the_pane(), 16), moved));
}

TEST_P(PaperReuseFrame, BitsDependNeitherOnThreadsNorOnTiles) {
  std::vector<ViewPicture> pictures;
  for (const auto& [threads, tile] : {std::pair(1, 128), std::pair(3, 128), std::pair(2, 16)}) {
    RenderEngine own(threads);
    RenderLoopOptions options;
    options.tile_size = tile;
    LoopViews views(own, mixed, settings_of(GetParam()), options);
    for (int step = 4; step > 0; --step) views.render(turned_and_shifted(past_the_pane(), 2.0 * step, 0.01 * step), 3);
    pictures.push_back(views.render(past_the_pane(), 20));
  }
  EXPECT_GT(pictures[0].end.progress.reuse_share, 0.1);
  EXPECT_TRUE(same_pixels(pictures[0], pictures[1]));
  EXPECT_TRUE(same_pixels(pictures[0], pictures[2]));
}

TEST_P(PaperReuseFrame, AJumpCarriesNothing) {
  LoopViews views(engine, room, settings_of(GetParam()));
  views.render(home(), 16);
  const ViewPicture& behind = views.render(turned_and_shifted(home(), 180, 0), 16);
  EXPECT_EQ(behind.end.progress.reuse_share, 0);
  EXPECT_EQ(behind.end.progress.samples_per_pixel, 16u);
}

TEST_P(PaperReuseFrame, SettingsRegionsLensesAndFiltersBeginAnew) {
  LoopViews views(engine, room, settings_of(GetParam()));
  const ViewPicture first = views.render(home(), 24);
  Budget budget;
  budget.samples = 24;
  RenderSettings other = settings_of(GetParam());
  other.reprojection.max_error = 0.5;
  EXPECT_EQ(views.render(turned_and_shifted(home(), 1, 0), budget, other).end.progress.reuse_share, 0);
  EXPECT_TRUE(same_pixels(views.render(home(), budget, settings_of(GetParam())), first));
  other = settings_of(GetParam(), 1);
  EXPECT_EQ(views.render(turned_and_shifted(home(), 1, 0), budget, other).end.progress.reuse_share, 0);
  other = settings_of(GetParam());
  other.region = PixelRect{5, 3, 40, 30};
  EXPECT_EQ(views.render(turned_and_shifted(home(), 1, 0), budget, other).end.progress.reuse_share, 0);
  EXPECT_GT(views.render(home(), budget).end.progress.reuse_share, 0.1);
  other = settings_of(GetParam());
  other.filter = {PixelFilterKind::tent, 1};
  views.render(home(), budget, other);
  EXPECT_EQ(views.render(turned_and_shifted(home(), 1, 0), budget).end.progress.reuse_share, 0);
  CameraPose lens = home();
  lens.lens_radius = 0.05;
  views.render(lens, budget, settings_of(GetParam()));
  EXPECT_EQ(views.render(turned_and_shifted(lens, 1, 0), budget).end.progress.reuse_share, 0);
}

TEST_P(PaperReuseFrame, ABudgetThatIsSpentAtOnceLosesNothing) {
  LoopViews views(engine, room, settings_of(GetParam()));
  views.render(home(), 256);
  Budget none;
  none.time_s = 1e-9;
  for (int step = 1; step <= 3; ++step) views.render(turned_and_shifted(home(), 0.1 * step, 0), none);
  EXPECT_GT(mean_samples(views.render(home(), 2)), 180);
}

TEST_P(PaperReuseFrame, ViewsInterruptedAnywhereLoseNothing) {
  LoopViews views(engine, room, settings_of(GetParam()));
  views.render(home(), 256);
  for (int i = 0; i < 60; ++i) {
    RenderLoop::Update update;
    View view;
    view.id = 1000 + std::uint64_t(i);
    view.camera = turned_and_shifted(home(), 0.05 * (i + 1), 0);
    update.view = view;
    views.loop().update(update);
    const double until = now_s() + 1e-4 * i;
    while (now_s() < until) {
    }
  }
  const ViewPicture& picture = views.render(turned_and_shifted(home(), 2, 0), 2);
  EXPECT_EQ(picture.end.reason, FrameEndReason::samples);
  EXPECT_GE(*std::min_element(picture.samples.begin(), picture.samples.end()), 1);
  // Each move that got through thinned the old samples out; most of the picture has some left all the same.
  EXPECT_GT(mean_samples(picture), 50);
}

TEST_P(PaperReuseFrame, PicturesAreShownWhileTheyAreMade) {
  RenderLoopOptions options;
  options.publish_passes = true;
  LoopViews views(engine, room, settings_of(GetParam()), options);
  views.render(turned_and_shifted(home(), 2, 0), 16);
  const ViewPicture& picture = views.render(home(), 16);
  EXPECT_EQ(picture.end.reason, FrameEndReason::samples);
  EXPECT_GT(picture.end.progress.reuse_share, 0.1);
  EXPECT_GE(*std::min_element(picture.samples.begin(), picture.samples.end()), 1);
}

INSTANTIATE_TEST_SUITE_P(Modes, PaperReuseFrame, testing::Values(RenderMode::reproject, RenderMode::combined),
                         [](const auto& test) { return to_string(test.param); });

TEST(PaperCombined, FreshSamplesGoFirstWhereNothingWasCarried) {
  RenderEngine engine(2);
  LoopViews views(engine, build(lambert_room()), settings_of(RenderMode::combined));
  views.render(turned_and_shifted(home(), 5, 0), 64);  // beyond iteration 16: every pixel has its probability
  const ViewPicture before = views.render(home(), 1);
  // 61 x 45 samples, of which pixels that came with a probability (at least 4/16) got none before iteration 16: those
  // that did not have 16 of them or so, and in a Lambert room no more than a fifth of the pixels is new.
  std::vector<float> samples = before.samples;
  std::sort(samples.begin(), samples.end());
  EXPECT_GE(samples.front(), 4);               // min_spp of Algorithm 2
  EXPECT_GT(samples[samples.size() / 2], 16);  // most were carried
}

// Algorithm 2, iteration by iteration, on three pixels: nothing known, carried without a probability, carried with one.
TEST(PaperCombined, IterationsAreThoseOfAlgorithm2) {
  Film film(3, 1, paper_film_state({.targets = true, .history = true}, 1));
  ThresholdSettings settings;
  settings.min_samples = 2;
  settings.max_samples = 6;
  for (int h = 0; h < kHalves; ++h) {
    for (int x = 1; x < 3; ++x) {
      // 5 samples of 1 each: no variance, P_variance = eps / (1 + eps), below every threshold but 0.
      for (int i = 0; i < 5; ++i) film.half(h, x, 0).add(Rgb(1, 1, 1));
      film.history()->carried(x, 0).count[h] = 5;
    }
  }
  paper_film(film).probability(2, 0) = 0.5f;
  std::vector<std::vector<int>> taken(3);
  for (std::uint32_t iteration = 0; iteration < 200; ++iteration) {
    AllocationRequest request;
    request.iteration = iteration;
    request.fill = true;
    ThresholdAllocation allocation(film, film.bounds(), settings, request);
    for (std::size_t part = 0; part < allocation.parts(); ++part) allocation.run(0, part);
    allocation.finish_sweep(0);
    for (int x = 0; x < 3; ++x) {
      int count = 0;
      for (int h = 0; h < kHalves; ++h) {
        while (film.attempted(h, x, 0) < film.targets()->target(h, x, 0)) {
          // The new pixel is noisy enough to be taken always: 0 and 4 in turn.
          const float value = x == 0 ? 4.0f * float(iteration % 2) : 1;
          film.half(h, x, 0).add(Rgb(value, value, value));
          ++count;
        }
      }
      taken[std::size_t(x)].push_back(count);
    }
  }
  const auto first_six = [&](int x) {
    return std::vector<int>(taken[std::size_t(x)].begin(), taken[std::size_t(x)].begin() + 6);
  };
  EXPECT_EQ(first_six(0), (std::vector<int>{1, 1, 1, 1, 1, 1}));
  // tau: 1 in iterations 0 to 2, then 0.75, 0.5, 0.25; 0 would come at 6.
  EXPECT_EQ(first_six(1), (std::vector<int>{0, 0, 0, 0, 0, 0}));
  EXPECT_EQ(first_six(2), (std::vector<int>{0, 0, 0, 0, 0, 0}));
  // At max_spp: 6 of 6; 10 of 6, more than one, as the paper says may happen; and what it came with.
  EXPECT_EQ(paper_film(film).probability(0, 0), 1);
  EXPECT_FLOAT_EQ(paper_film(film).probability(1, 0), 10.0f / 6);
  EXPECT_EQ(paper_film(film).probability(2, 0), 0.5f);
  const auto later = [&](int x) {
    return std::accumulate(taken[std::size_t(x)].begin() + 6, taken[std::size_t(x)].end(), 0);
  };
  EXPECT_EQ(later(0), 194);
  EXPECT_EQ(later(1), 194);
  EXPECT_NEAR(later(2), 97, 3 * 7);  // binomial: deviation 7
}

TEST(PaperReuseMemory, IsAsDocumented) {
  const auto bytes = [](int stored_hits, bool targets) {
    return Film::bytes_per_pixel(paper_film_state({.targets = targets, .history = stored_hits > 0}, stored_hits));
  };
  EXPECT_EQ(bytes(0, false), 120u);
  EXPECT_EQ(bytes(0, true), 132u);
  EXPECT_EQ(bytes(1, false), 120u + 258u);
  EXPECT_EQ(bytes(4, false), 120u + 354u);
  EXPECT_EQ(bytes(4, true), 132u + 354u);
  // And so it is: 64 x 64 pixels, with little for the whole beside them.
  const FilmState state = paper_film_state({.targets = true, .history = true}, 4);
  const Film film(64, 64, state);
  EXPECT_NEAR(double(film.bytes()) / (64 * 64), 132 + 354, 2);
  EXPECT_EQ(film.state(), state);
  EXPECT_NE(film.state(), paper_film_state({.targets = true, .history = true}, 1));
}

}  // namespace
}  // namespace helio::test
