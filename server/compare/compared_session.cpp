#include "server/compare/compared_session.h"

#include <algorithm>
#include <utility>
#include <vector>

#include "renderer/base/clock.h"
#include "server/base/processor_time.h"

namespace helio {
namespace {

// The machine's clock ticks a hundred times a second: of shorter pictures it is known what other sessions and jobs
// took, and, where the kernel tells it, for how long the workers waited for a processor.
constexpr double kMachineTold = 1;
constexpr double kNoTime = 1e-9;  // seconds: a difference of sums, where nobody took anything

Error failed(const std::string& why) {
  return {ErrorCode::internal, "the picture failed: " + why, {}};
}

}  // namespace

Result<std::unique_ptr<ComparedSession>> ComparedSession::create(const RenderContext::Resources& resources,
                                                                 std::shared_ptr<const LoadedScene> scene,
                                                                 const ComparedMode& mode, std::uint64_t seed,
                                                                 unsigned more, const std::optional<Gaze>& gaze) {
  std::unique_ptr<ComparedSession> session(new ComparedSession);
  session->display_ = mode.picture == ComparedMode::Picture::display;
  session->previews_ = mode.picture == ComparedMode::Picture::preview;
  session->gaze_ = gaze;
  session->time_s_ = scene->manifest.time_s;
  session->engine_ = &resources.engine;
  session->collector_ =
      std::make_shared<PictureCollector>(mode.settings.width, mode.settings.height, session->display_);
  RenderSettings settings = mode.settings;
  settings.seed = seed;
  auto rendering = RenderContext::create(resources, SceneLease(std::move(scene)), settings, Budget(), RenderRank::job,
                                         FramePublisher::Tiles::final_only, mode.channels() | kResolveSamples | more,
                                         session->collector_);
  if (!rendering) return rendering.error();
  session->rendering_ = std::move(*rendering);
  return session;
}

View ComparedSession::next_view(const CameraPose& camera) {
  View view;
  view.id = ++view_id_;
  view.camera = camera;
  view.time_s = time_s_;
  view.gaze = gaze_;
  return view;
}

template <class Wait>
Result<PictureCost> ComparedSession::measure(RenderLoop::Update update, const Idle& idle, const Wait& wait) {
  RenderLoop& loop = rendering_->loop();
  const double started = now_s(), own = loop.used_seconds(), all = engine_->used_seconds();
  const double process = process_cpu_s();
  const std::optional<double> machine = machine_busy_s();
  const std::vector<int> workers = engine_->thread_ids();
  const std::optional<double> waited = waited_for_processor_s(workers);
  if (hold_left_s_ > 0) loop.hold_others(hold_left_s_);
  const std::uint64_t revision = loop.update(update);
  const auto frame = wait(revision, [&] { idle(loop.progress()); });
  const double wall = now_s() - started, own_used = loop.used_seconds() - own;
  if (hold_left_s_ > 0) {
    loop.release_others();
    hold_left_s_ -= wall;
  }
  if (!frame) {
    loop.cancel();
    return Error{ErrorCode::cancelled, "the comparison was cancelled", {}};
  }
  if (frame->end.reason == FrameEndReason::failed) return failed(frame->end.message);
  PictureCost cost;
  cost.progress = frame->end.progress;
  cost.seconds = frame->end.progress.seconds;
  cost.samples = frame->end.progress.samples_per_pixel;
  double others = engine_->used_seconds() - all - own_used;
  if (wall >= kMachineTold) {
    // Loads and encoding in this process, and whatever else runs on the machine.
    others = std::max(others, process_cpu_s() - process - own_used);
    const std::optional<double> machine_now = machine_busy_s();
    if (machine && machine_now) others = std::max(others, *machine_now - *machine - own_used);
  }
  const std::optional<double> waited_now = waited ? waited_for_processor_s(workers) : std::nullopt;
  if (waited_now) others = std::max(others, *waited_now - *waited);
  if (others < kNoTime) others = 0;
  cost.others_share = std::clamp(others / (std::max(wall, 1e-6) * engine_->threads()), 0.0, 1.0);
  begin_ = frame->begin;
  return cost;
}

Result<PictureCost> ComparedSession::film(RenderLoop::Update update, const CancelToken& cancel, const Idle& idle) {
  auto cost = measure(std::move(update), idle, [&](std::uint64_t revision, const auto& told) {
    return collector_->wait_for_film(revision, cancel, told);
  });
  if (!cost) return cost;
  const FilmError& error = cost->progress.error;
  told_rmse_ = display_ ? collector_->display_error() : error.known ? std::optional(error.rmse) : std::nullopt;
  return cost;
}

Result<PictureCost> ComparedSession::render(const CameraPose& view, const Budget& budget, const CancelToken& cancel,
                                            const Idle& idle) {
  RenderLoop::Update update;
  update.view = next_view(view);
  update.budget = budget;
  return film(std::move(update), cancel, idle);
}

Result<PictureCost> ComparedSession::go_on(const Budget& budget, const CancelToken& cancel, const Idle& idle) {
  RenderLoop::Update update;
  update.budget = budget;
  return film(std::move(update), cancel, idle);
}

Result<PictureCost> ComparedSession::preview(const CameraPose& view, const CancelToken& cancel, const Idle& idle) {
  RenderLoop::Update update;
  update.view = next_view(view);
  const double asked = now_s();
  double came = asked;
  auto cost = measure(std::move(update), idle, [&](std::uint64_t, const auto& told) {
    auto frame = collector_->wait_for_preview(view_id_, cancel, told);
    came = now_s();
    return frame;
  });
  // No film of it: that would be rendered while the preview is measured.
  rendering_->loop().cancel();
  told_rmse_.reset();
  if (cost) cost->seconds = came - asked;
  return cost;
}

}  // namespace helio
