// Pictures that go on from a checkpoint end as if they had never been left.
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <bit>
#include <chrono>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "adaptive_frames.h"
#include "fake_integrator.h"
#include "recording_sink.h"
#include "renderer/frame/picture_checkpoint.h"
#include "renderer/frame/stages/allocate.h"
#include "tests/support/failing_allocations.h"
#include "tests/support/loop_views.h"
#include "tests/support/small_rooms.h"

namespace helio::test {
namespace {

const CameraPose kHere = camera_at({0, 0, 0.95}, {0, -0.2, -1}, 75);

struct Course {
  const char* name;
  RenderMode mode;
  Integrator integrator;
  Budget budget;
  bool fake = false;  // radiance from a hash, of which a part is not finite
  std::optional<PixelRect> region = {};
  bool passes = false;
  double interval_s = 0.25;  // of publications, and so of plans
};

void PrintTo(const Course& course, std::ostream* out) {
  *out << course.name;
}

// Of the error that the picture has after 32 samples: as the variance falls about as 1/n, some 90 reach that.
Budget error(double share = 0.6) {
  Budget budget;
  budget.error = share;
  return budget;
}

// A mirror throws a point light's light about, which no camera path finds: some tiles of pt+bdpt get light paths.
SceneDescription mirror_room() {
  SceneDescription scene = mixed_scene();
  Material mirror = lambert(Rgb(0.9f, 0.9f, 0.9f));
  mirror.metallic = mirror.specular = 1;
  mirror.roughness = 0;
  scene.materials.push_back(mirror);
  add_mesh(scene, quad({-0.99f, -0.9f, -0.9f}, {0, 1.8f, 0}, {0, 0, 1.8f}, int(scene.materials.size()) - 1));
  scene.lights[0].intensity = Rgb(2, 2, 3);
  return scene;
}

RenderSettings settings_of(const Course& course) {
  RenderSettings settings = loop_settings(56, 40, course.mode);
  settings.integrator = course.integrator;
  settings.max_segments = 5;
  settings.adaptive.min_samples = 8;
  settings.region = course.region;
  return settings;
}

// Every checkpoint that a loop makes, as bytes. Asked for from the pieces, so that each plan is followed by one.
class Keeper {
 public:
  RenderLoopOptions options_of(const Course& course) {
    RenderLoopOptions options = plain_options(course);
    options.checkpoints = CheckpointOptions{.interval_s = 0, .keep = [this](auto checkpoint) {
                                              const auto bytes = checkpoint->encode();
                                              const std::lock_guard lock(mutex_);
                                              kept.emplace_back(bytes.begin(), bytes.end());
                                            }};
    options.make_tracer = [this, inner = options.make_tracer](std::shared_ptr<const RenderScene> scene) {
      return [this, trace = inner(std::move(scene))](const IntegrateJob& job, const CancelToken& cancel, Film& film,
                                                     TraceStats& stats) {
        if (RenderLoop* loop = asked.load()) loop->checkpoint_soon();
        return trace(job, cancel, film, stats);
      };
    };
    return options;
  }
  static RenderLoopOptions plain_options(const Course& course) {
    RenderLoopOptions options;
    options.tile_size = 32;
    options.publish_passes = course.passes;
    options.publish_interval_s = course.interval_s;
    options.make_tracer = [fake = course.fake](std::shared_ptr<const RenderScene> scene) {
      FakeIntegrator integrator;
      integrator.invalid_share = 0.05;
      integrator.noisy_from = 0.5f;
      return fake ? integrator.function() : path_tracer(std::move(scene));
    };
    return options;
  }

  std::vector<std::vector<std::uint8_t>> kept;
  std::atomic<RenderLoop*> asked = nullptr;

 private:
  std::mutex mutex_;
};

std::shared_ptr<const PictureCheckpoint> decoded(const std::vector<std::uint8_t>& bytes,
                                                 const RenderSettings& settings) {
  auto checkpoint = PictureCheckpoint::decode(bytes, settings);
  if (!checkpoint) ADD_FAILURE() << checkpoint.error().to_string();
  return checkpoint ? std::make_shared<const PictureCheckpoint>(std::move(checkpoint).value()) : nullptr;
}

class CheckpointFrame : public testing::TestWithParam<Course> {
 protected:
  // The course's, with the error in radiance.
  Budget budget(RenderEngine& engine) const {
    Budget budget = GetParam().budget;
    if (!budget.error) return budget;
    LoopViews views(engine, scene_, settings_of(GetParam()), Keeper::plain_options(GetParam()));
    *budget.error *= views.render(kHere, 32).end.progress.error.rmse;
    return budget;
  }

  std::shared_ptr<const RenderScene> scene_ = build(mirror_room());
};

TEST_P(CheckpointFrame, EndsWithTheBitsOfAnUninterruptedOne) {
  const Course& course = GetParam();
  const RenderSettings settings = settings_of(course);
  ASSERT_TRUE(can_checkpoint(settings));
  RenderEngine one(1), three(3);
  const Budget budget = this->budget(three);
  const ViewPicture whole = LoopViews(three, scene_, settings, Keeper::plain_options(course)).render(kHere, budget);
  ASSERT_EQ(whole.end.reason, budget.error ? FrameEndReason::error : FrameEndReason::samples) << whole.end.message;
  if (budget.error) {
    EXPECT_GT(whole.end.progress.samples_per_pixel, 32u);
    EXPECT_FALSE(std::has_single_bit(whole.end.progress.samples_per_pixel)) << "looks at such counts need no memory";
  }
  ASSERT_GT(mean_radiance(whole), 0);

  Keeper keeper;
  {
    LoopViews views(three, scene_, settings, keeper.options_of(course));
    keeper.asked = &views.loop();
    const ViewPicture& watched = views.render(kHere, budget);
    EXPECT_TRUE(same_pixels(watched, whole)) << "making checkpoints changes the picture";
    EXPECT_EQ(watched.end.progress.error.rmse, whole.end.progress.error.rmse);
    keeper.asked = nullptr;
  }
  ASSERT_GE(keeper.kept.size(), 3u);

  const std::size_t step = std::max<std::size_t>(1, keeper.kept.size() / 5);
  for (std::size_t k = 0; k < keeper.kept.size(); k += step) {
    const auto checkpoint = decoded(keeper.kept[k], settings);
    ASSERT_TRUE(checkpoint);
    EXPECT_GT(checkpoint->samples(), 0u);
    EXPECT_EQ(checkpoint->head().splats, film_state(settings).splats) << "pt+bdpt: no tile has light paths";
    EXPECT_LE(keeper.kept[k].size(), checkpoint_bytes(settings));
    RenderLoopOptions options = Keeper::plain_options(course);
    options.tile_size = 16;  // another cut
    LoopViews views(one, scene_, settings, options);
    const ViewPicture& resumed = views.render(kHere, budget, std::nullopt, checkpoint);
    EXPECT_TRUE(same_pixels(resumed, whole)) << "checkpoint " << k << " of " << keeper.kept.size() << ", samples "
                                             << checkpoint->samples();
    EXPECT_EQ(resumed.end.reason, whole.end.reason);
    EXPECT_EQ(resumed.end.progress.samples_per_pixel, whole.end.progress.samples_per_pixel);
    EXPECT_EQ(resumed.end.progress.trace.paths, whole.end.progress.trace.paths);
    EXPECT_EQ(resumed.end.progress.trace.invalid(), whole.end.progress.trace.invalid());
    EXPECT_EQ(views.loop().invalid_samples(), whole.end.progress.trace.invalid());
    if (!merges(course.integrator)) {
      EXPECT_EQ(resumed.end.progress.error.rmse, whole.end.progress.error.rmse);
    }
  }
}

// A checkpoint of a picture that was itself taken from one; the view after it is as it would have been.
TEST_P(CheckpointFrame, IsFollowedByTheSameView) {
  const Course& course = GetParam();
  const RenderSettings settings = settings_of(course);
  const CameraPose there = turned_and_shifted(kHere, 5, 0.05);
  RenderEngine engine(2);
  const Budget budget = this->budget(engine);
  LoopViews path(engine, scene_, settings, Keeper::plain_options(course));
  path.render(kHere, budget);
  const ViewPicture expected = path.render(there, budget);

  std::shared_ptr<const PictureCheckpoint> checkpoint;
  for (int leg = 0; leg < 3; ++leg) {
    Keeper keeper;
    LoopViews views(engine, scene_, settings, keeper.options_of(course));
    keeper.asked = &views.loop();
    views.render(kHere, budget, std::nullopt, checkpoint);
    keeper.asked = nullptr;
    if (leg == 2 || keeper.kept.empty()) {
      EXPECT_TRUE(same_pixels(views.render(there, budget), expected));
      break;
    }
    checkpoint = decoded(keeper.kept[keeper.kept.size() / 2], settings);
    ASSERT_TRUE(checkpoint);
  }
}

INSTANTIATE_TEST_SUITE_P(
    Courses, CheckpointFrame,
    testing::Values(
        Course{"pt", RenderMode::pt, Integrator::path, samples(32)},
        Course{"pt_odd", RenderMode::pt, Integrator::path, samples(13)},
        Course{"pt_shown", RenderMode::pt, Integrator::path, samples(48), false, {}, true, 2e-3},
        Course{"pt_region", RenderMode::pt, Integrator::path, samples(32), false, PixelRect{5, 7, 43, 31}},
        Course{"pt_error", RenderMode::pt, Integrator::path, error()},
        Course{"pt_error_shown", RenderMode::pt, Integrator::path, error(), false, {}, true, 2e-3},
        Course{"pt_invalid", RenderMode::pt, Integrator::path, samples(64), true},
        Course{"pt_invalid_error", RenderMode::pt, Integrator::path, error(), true, {}, true, 1e-3},
        Course{"adaptive", RenderMode::adaptive, Integrator::path, samples(40)},
        Course{"adaptive_shown", RenderMode::adaptive, Integrator::path, samples(40), false, {}, true, 2e-3},
        Course{"adaptive_region", RenderMode::adaptive, Integrator::path, samples(40), false, PixelRect{16, 0, 56, 27}},
        Course{"adaptive_error", RenderMode::adaptive, Integrator::path, error(), false, {}, true, 2e-3},
        Course{"adaptive_invalid", RenderMode::adaptive, Integrator::path, samples(64), true, {}, true, 1e-3},
        Course{"adaptive_bdpt", RenderMode::adaptive, Integrator::bdpt, samples(24)},
        Course{"pt_bdpt", RenderMode::pt, Integrator::pt_bdpt, samples(32), false, {}, true, 2e-3},
        Course{"pt_bdpt_error", RenderMode::pt, Integrator::pt_bdpt, error()},
        Course{"adaptive_pt_bdpt", RenderMode::adaptive, Integrator::pt_bdpt, samples(32)},
        Course{"light", RenderMode::pt, Integrator::light, samples(32)},
        Course{"bdpt", RenderMode::pt, Integrator::bdpt, samples(32), false, {}, true, 2e-3},
        Course{"bdpt_region", RenderMode::pt, Integrator::bdpt, samples(32), false, PixelRect{5, 7, 43, 31}},
        Course{"bdpt_error", RenderMode::pt, Integrator::bdpt, error()},
        Course{"lvc", RenderMode::pt, Integrator::lvc, samples(32), false, {}, true, 2e-3},
        Course{"lvc_error", RenderMode::pt, Integrator::lvc, error()},
        Course{"vcm", RenderMode::pt, Integrator::vcm, samples(16)},
        Course{"photon", RenderMode::pt, Integrator::photon, samples(16)}),
    [](const auto& info) { return std::string(info.param.name); });

class CheckpointLoop : public testing::Test {
 protected:
  CheckpointLoop() {
    fake_.seconds_per_sample = 2e-7;
    sink_->keep_pixels = false;
  }
  RenderLoopOptions options(double interval_s) {
    RenderLoopOptions options;
    options.publish_interval_s = 1e-3;  // many plans
    options.publish_passes = true;
    options.checkpoints = CheckpointOptions{.interval_s = interval_s, .keep = [this](auto checkpoint) {
                                              const std::lock_guard lock(mutex_);
                                              ++made_;
                                              if (hold_) held_ = std::move(checkpoint);
                                            }};
    return options;
  }
  static RenderLoop::Update view(double x) {
    RenderLoop::Update update;
    update.view = view_at(1, x);
    return update;
  }
  int made() {
    const std::lock_guard lock(mutex_);
    return made_;
  }
  std::vector<std::uint8_t> held_bytes() {
    const std::lock_guard lock(mutex_);
    if (!held_) return {};
    return {held_->encode().begin(), held_->encode().end()};
  }

  FakeIntegrator fake_;
  RenderEngine engine_{2};
  std::shared_ptr<RecordingSink> sink_ = std::make_shared<RecordingSink>();
  std::mutex mutex_;
  int made_ = 0;
  bool hold_ = false;
  std::shared_ptr<const PictureCheckpoint> held_;
};

TEST_F(CheckpointLoop, MakesOneWhenAskedAndNoneUnasked) {
  RenderLoop loop(engine_, fake_.function(), film_of(64, 48), samples(64), RenderRank::job, sink_, options(0));
  ASSERT_TRUE(sink_->wait_for_end(loop.update(view(0))));
  EXPECT_EQ(made(), 0);
  loop.checkpoint_soon();
  loop.checkpoint_soon();
  const auto end = sink_->wait_for_end(loop.update(view(1)));
  ASSERT_TRUE(end);
  EXPECT_EQ(made(), 1) << "two asked before it began";
  const auto is = [](const PassTime& pass) { return pass.pass == "checkpoint"; };
  EXPECT_EQ(std::count_if(end->passes.begin(), end->passes.end(), is), 1);
  ASSERT_TRUE(sink_->wait_for_end(loop.update(view(2))));
  EXPECT_EQ(made(), 1);
}

TEST_F(CheckpointLoop, MakesThemAtTheInterval) {
  RenderLoop loop(engine_, fake_.function(), film_of(16, 16), {}, RenderRank::job, sink_, options(1e-3));
  loop.update(view(0));
  EXPECT_TRUE(sink_->wait([&] { return made() >= 3; }));
}

TEST_F(CheckpointLoop, PreparesItsMemoryWhenToldTo) {
  RenderLoopOptions with = options(0);
  with.checkpoints->prepare_later = true;
  RenderLoop loop(engine_, fake_.function(), film_of(64, 48), samples(64), RenderRank::job, sink_, with);
  loop.checkpoint_soon();
  ASSERT_TRUE(sink_->wait_for_end(loop.update(view(0))));
  EXPECT_EQ(made(), 0);
  const std::size_t own = checkpoint_bytes(film_of(64, 48)), before = loop.memory_bytes();
  for (int i = 0; i < 2; ++i) {
    loop.prepare_checkpoints();
    EXPECT_GE(loop.memory_bytes(), before + own * 9 / 10);
    EXPECT_LE(loop.memory_bytes(), before + own * 11 / 10);
  }
  ASSERT_TRUE(sink_->wait_for_end(loop.update(view(1))));
  EXPECT_EQ(made(), 1) << "it was asked for before";
}

TEST_F(CheckpointLoop, BeginsNoneWhileOneIsHeld) {
  hold_ = true;
  RenderLoopOptions with = options(0);
  RenderLoop loop(engine_, fake_.function(), film_of(64, 48), samples(32), RenderRank::job, sink_, with);
  loop.checkpoint_soon();
  ASSERT_TRUE(sink_->wait_for_end(loop.update(view(0))));
  ASSERT_EQ(made(), 1);
  const std::vector<std::uint8_t> before = held_bytes();
  ASSERT_FALSE(before.empty());
  loop.checkpoint_soon();
  ASSERT_TRUE(sink_->wait_for_end(loop.update(view(1))));
  EXPECT_EQ(made(), 1) << "the first is still held";
  EXPECT_EQ(held_bytes(), before);
  held_.reset();
  ASSERT_TRUE(sink_->wait_for_end(loop.update(view(2))));
  EXPECT_EQ(made(), 2) << "it was asked for, and nobody holds the first";
  EXPECT_NE(held_bytes(), before);
}

TEST_F(CheckpointLoop, OutlivesTheLoopAndIsCountedAsLong) {
  hold_ = true;
  const auto count = std::make_shared<int>(0);
  {
    RenderLoopOptions with = options(0);
    with.checkpoints->count = count;
    RenderLoop loop(engine_, fake_.function(), film_of(64, 48), samples(16), RenderRank::job, sink_, with);
    const std::size_t own = checkpoint_bytes(film_of(64, 48));
    EXPECT_GT(own, 64u * 48 * 120);
    EXPECT_GE(loop.memory_bytes(), own + Film::bytes_per_pixel({}) * 64 * 48);
    with.checkpoints.reset();
    loop.checkpoint_soon();
    ASSERT_TRUE(sink_->wait_for_end(loop.update(view(0))));
  }
  EXPECT_FALSE(held_bytes().empty());
  EXPECT_GT(count.use_count(), 1);
  held_.reset();
  EXPECT_EQ(count.use_count(), 1) << "freed with the last who held it";
}

// Other settings have memory of another size, or none.
TEST_F(CheckpointLoop, FollowsTheSettings) {
  hold_ = true;
  RenderLoop loop(engine_, fake_.function(), film_of(32, 32), samples(8), RenderRank::job, sink_, options(0));
  RenderLoop::Update update = view(0);
  update.settings = film_of(64, 48);
  loop.checkpoint_soon();
  ASSERT_TRUE(sink_->wait_for_end(loop.update(update)));
  ASSERT_EQ(made(), 1);
  EXPECT_TRUE(PictureCheckpoint::decode(held_bytes(), *update.settings).ok());
  held_.reset();

  update.settings->mode = RenderMode::reproject;
  EXPECT_FALSE(can_checkpoint(*update.settings));
  EXPECT_EQ(checkpoint_bytes(*update.settings), 0u);
  loop.checkpoint_soon();
  ASSERT_TRUE(sink_->wait_for_end(loop.update(update)));
  EXPECT_EQ(made(), 1);
}

// As of a session when its daemon drains: the picture may have come to its end long before.
TEST_F(CheckpointLoop, BeginInALoopThatWasMadeWithoutThem) {
  hold_ = true;
  RenderLoopOptions without = options(0);
  const CheckpointOptions checkpoints = *std::exchange(without.checkpoints, std::nullopt);
  const RenderSettings settings = film_of(64, 48);
  RenderLoop loop(engine_, fake_.function(), settings, samples(13), RenderRank::interactive, sink_, without);
  ASSERT_TRUE(sink_->wait_for_end(loop.update(view(0))));
  const std::size_t before = loop.memory_bytes();
  loop.begin_checkpoints(checkpoints);
  loop.begin_checkpoints({});  // it makes some already
  EXPECT_EQ(loop.memory_bytes(), before + checkpoint_bytes(settings));
  loop.checkpoint_soon();
  RenderLoop::Update same;
  same.budget = samples(13);
  const auto end = sink_->wait_for_end(loop.update(same));
  ASSERT_TRUE(end);
  EXPECT_EQ(made(), 1) << "the budget was reached, and somebody asked";
  EXPECT_EQ(end->progress.samples_per_pixel, 13u);
  ASSERT_TRUE(held_);
  EXPECT_EQ(held_->samples(), 13u * 64 * 48) << "no sample more";
}

// Until samples have a cost, plans last until the count has doubled, which may be as long as all that was rendered: no
// checkpoint comes before, and a daemon cannot drain.
TEST_F(CheckpointLoop, AfterOneTheFirstPlanIsShort) {
  constexpr std::uint64_t kPixels = 32 * 32;
  fake_.seconds_per_sample = 5e-6;  // 5 ms for one in every pixel, where a plan is to last 1 ms
  hold_ = true;
  const RenderSettings settings = film_of(32, 32);
  RenderLoop::Update update = view(0);
  // The first checkpoint that this is true of.
  const auto render_until = [&](const std::function<bool(std::uint64_t)>& is_so) -> std::vector<std::uint8_t> {
    held_.reset();
    made_ = 0;
    sink_ = std::make_shared<RecordingSink>();
    sink_->keep_pixels = false;
    RenderLoop loop(engine_, fake_.function(), settings, Budget{}, RenderRank::job, sink_, options(0));
    loop.update(update);
    for (int i = 1; i < 200; ++i) {
      loop.checkpoint_soon();
      if (!sink_->wait([&] { return made() >= i; })) break;
      if (is_so(held_->samples() / kPixels)) return held_bytes();
      const std::lock_guard lock(mutex_);
      held_.reset();
    }
    return {};
  };
  const auto before = render_until([](std::uint64_t n) { return n > 32 && std::bit_ceil(n) - n > 16; });
  auto resume = PictureCheckpoint::decode(before, settings);
  ASSERT_TRUE(resume.ok()) << resume.error().to_string();
  const std::uint64_t had = resume->samples() / kPixels;
  update.resume = std::make_shared<const PictureCheckpoint>(std::move(*resume));
  const auto after = render_until([&](std::uint64_t n) { return n > had; });
  resume = PictureCheckpoint::decode(after, settings);
  ASSERT_TRUE(resume.ok()) << resume.error().to_string();
  EXPECT_LE(resume->samples() / kPixels, had + 8) << "of " << std::bit_ceil(had);
}

// Frames are superseded and cancelled at any moment, copies among them. Whatever was kept is whole.
class CutCheckpoint : public CheckpointLoop, public testing::WithParamInterface<RenderMode> {};

TEST_P(CutCheckpoint, IsNeverHalfACopy) {
  std::vector<std::vector<std::uint8_t>> kept;
  RenderSettings settings = film_of(96, 64);
  settings.mode = GetParam();
  settings.adaptive.min_samples = 8;
  fake_.noisy_from = 0.5f;
  {
    RenderLoopOptions with = options(0);
    with.checkpoints->keep = [&](auto checkpoint) {
      const std::lock_guard lock(mutex_);
      ++made_;
      if (kept.size() < 400) kept.emplace_back(checkpoint->encode().begin(), checkpoint->encode().end());
    };
    RenderLoop loop(engine_, fake_.function(), settings, samples(1000), RenderRank::job, sink_, with);
    loop.update(view(0));
    for (int i = 0; i < 3000 && made() < 200; ++i) {
      loop.checkpoint_soon();
      RenderLoop::Update same;  // the picture goes on
      same.budget = samples(1000 + std::uint32_t(i % 7));
      if (i % 50 == 49) same.view = view_at(1, i % 100);  // another one
      if (i % 11 == 10) loop.cancel();
      loop.update(same);
      std::this_thread::sleep_for(std::chrono::microseconds(20 * (i % 40)));
    }
  }
  ASSERT_GE(kept.size(), 20u);
  for (const auto& bytes : kept) {
    // Counts of all pixels are held against the progress of their blocks.
    ASSERT_TRUE(decoded(bytes, settings));
  }
}

INSTANTIATE_TEST_SUITE_P(Modes, CutCheckpoint, testing::Values(RenderMode::pt, RenderMode::adaptive),
                         [](const auto& info) { return std::string(to_string(info.param)); });

class Resuming : public CheckpointLoop {
 protected:
  std::shared_ptr<const PictureCheckpoint> made_with(const RenderSettings& settings, double x) {
    hold_ = true;
    RenderLoop loop(engine_, fake_.function(), settings, samples(16), RenderRank::job, sink_, options(0));
    loop.checkpoint_soon();
    sink_->wait_for_end(loop.update(view(x)));
    sink_ = std::make_shared<RecordingSink>();
    return std::exchange(held_, nullptr);
  }
};

TEST_F(Resuming, RefusesWhatDoesNotSuitAndChangesNothing) {
  const auto checkpoint = made_with(film_of(64, 48), 1);
  ASSERT_TRUE(checkpoint);
  RenderLoop loop(engine_, fake_.function(), film_of(64, 48), samples(16), RenderRank::job, sink_, {});
  RenderLoop::Update update;
  update.resume = checkpoint;
  EXPECT_EQ(loop.update(update), 0u) << "there is no view";
  update.view = view_at(1, 2);
  EXPECT_EQ(loop.update(update), 0u) << "another camera";
  const auto refused = checkpoint->suits(film_of(64, 48), *update.view);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::failed_precondition);
  EXPECT_EQ(refused.error().where, "checkpoint.view.camera");
  update.view = view_at(1, 1);
  RenderSettings others[] = {film_of(48, 64), film_of(64, 48), film_of(64, 48), film_of(64, 48)};
  others[1].seed = 1;
  others[2].mode = RenderMode::adaptive;
  others[3].region = PixelRect{0, 0, 64, 47};
  for (const RenderSettings& settings : others) {
    update.settings = settings;
    EXPECT_EQ(loop.update(update), 0u);
    EXPECT_EQ(checkpoint->suits(settings, *update.view).error().where, "checkpoint.settings");
  }
  EXPECT_EQ(loop.revision(), 0u);
  EXPECT_TRUE(sink_->read([&] { return sink_->begins.empty(); }));
  update.settings.reset();
  EXPECT_EQ(loop.update(update), 1u);
  EXPECT_TRUE(sink_->wait_for_end(1));
}

// Only the samples that are missing are traced; a view that comes first takes nothing of it.
TEST_F(Resuming, TracesWhatIsMissing) {
  const auto checkpoint = made_with(film_of(64, 48), 1);
  ASSERT_TRUE(checkpoint);
  for (const bool another : {false, true}) {
    fake_.counters = std::make_shared<FakeIntegrator::Counters>();
    const auto sink = std::make_shared<RecordingSink>();
    RenderLoop loop(engine_, fake_.function(), film_of(64, 48), samples(16), RenderRank::job, sink, {});
    RenderLoop::Update update = view(1);
    update.resume = checkpoint;
    loop.update(update);
    if (another) loop.update(view(3));
    const auto end = sink->wait_for_end(loop.revision());
    ASSERT_TRUE(end);
    EXPECT_EQ(end->reason, FrameEndReason::samples);
    EXPECT_EQ(end->progress.samples_per_pixel, 16u);
    EXPECT_EQ(fake_.counters->out_of_order, 0u);
    if (!another) {
      EXPECT_EQ(fake_.counters->samples, 16u * 64 * 48 - checkpoint->samples());
    }
  }
}

TEST_F(Resuming, CountsTheSecondsThatWereUsed) {
  hold_ = true;
  fake_.seconds_per_sample = 1e-6;
  Budget budget;
  budget.time_s = 1000;
  {
    RenderLoop loop(engine_, fake_.function(), film_of(64, 48), budget, RenderRank::job, sink_, options(0));
    loop.update(view(1));
    ASSERT_TRUE(sink_->wait([&] { return loop.progress().seconds > 0.1; }));
    loop.checkpoint_soon();
    ASSERT_TRUE(sink_->wait([&] { return made() == 1; }));
  }
  const auto checkpoint = std::exchange(held_, nullptr);
  ASSERT_TRUE(checkpoint);
  EXPECT_GE(checkpoint->seconds(), 0.1);
  // That budget is used up: the picture is shown as it is.
  budget.time_s = 0.5 * checkpoint->seconds();
  fake_.counters = std::make_shared<FakeIntegrator::Counters>();
  const auto sink = std::make_shared<RecordingSink>();
  RenderLoop loop(engine_, fake_.function(), film_of(64, 48), budget, RenderRank::job, sink, {});
  RenderLoop::Update update = view(1);
  update.resume = checkpoint;
  const auto end = sink->wait_for_end(loop.update(update));
  ASSERT_TRUE(end);
  EXPECT_EQ(end->reason, FrameEndReason::time);
  EXPECT_EQ(fake_.counters->samples, 0u);
  EXPECT_GE(end->progress.samples_per_pixel, 1u);
  EXPECT_GE(end->progress.seconds, checkpoint->seconds());
  EXPECT_EQ(end->progress.budget_used, 1);
}

// The frame that puts the pixels back is superseded again and again.
TEST_F(Resuming, IsDoneAgainWhereItWasInterrupted) {
  const RenderSettings settings = film_of(256, 200);
  const auto checkpoint = made_with(settings, 1);
  ASSERT_TRUE(checkpoint);
  fake_.counters = std::make_shared<FakeIntegrator::Counters>();
  RenderLoop loop(engine_, fake_.function(), settings, samples(16), RenderRank::job, sink_, {});
  RenderLoop::Update update = view(1);
  update.resume = checkpoint;
  loop.update(update);
  for (int i = 0; i < 200; ++i) {
    RenderLoop::Update same;
    same.budget = samples(16);
    loop.update(same);
    std::this_thread::sleep_for(std::chrono::microseconds(10 * (i % 30)));
  }
  const auto end = sink_->wait_for_end(loop.revision());
  ASSERT_TRUE(end);
  EXPECT_EQ(end->reason, FrameEndReason::samples);
  EXPECT_EQ(fake_.counters->samples, 16u * 256 * 200 - checkpoint->samples());
  EXPECT_EQ(fake_.counters->out_of_order, 0u);
}

// Memory that is out while a picture is copied or put back fails that picture alone.
TEST_F(Resuming, FailsOnlyThePictureWhereMemoryIsOut) {
  const ExemptFromFailing exempt;
  const RenderSettings settings = film_of(32, 24);
  const auto checkpoint = made_with(settings, 1);
  ASSERT_TRUE(checkpoint);
  hold_ = false;
  RenderLoopOptions with = options(0);
  with.publish_interval_s = 1e6;
  std::uint64_t failed = 0;
  bool thrown = true;
  for (std::uint64_t first = 1; thrown && first < 100000; first += 1 + first / 16) {
    const auto sink = std::make_shared<RecordingSink>();
    RenderLoop loop(engine_, fake_.function(), settings, samples(16), RenderRank::job, sink, with);
    RenderLoop::Update update = view(1);
    update.resume = checkpoint;
    loop.checkpoint_soon();
    std::optional<FrameEnd> end;
    {
      const FailingAllocations failing(first);
      end = sink->wait_for_end(loop.update(update));
      thrown = failing.thrown() > 0;
    }
    ASSERT_TRUE(end);
    if (end->reason == FrameEndReason::failed) {
      EXPECT_EQ(end->message, "out of memory");
      ++failed;
    }
    loop.checkpoint_soon();
    const int before = made();
    end = sink->wait_for_end(loop.update(update));
    ASSERT_TRUE(end);
    EXPECT_EQ(end->reason, FrameEndReason::samples) << first;
    EXPECT_EQ(end->progress.samples_per_pixel, 16u);
    EXPECT_EQ(made(), before + 1) << first;
  }
  EXPECT_GE(failed, 5u);
}

}  // namespace
}  // namespace helio::test
