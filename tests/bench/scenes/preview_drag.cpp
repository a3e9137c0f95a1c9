#include "tests/bench/scenes/preview_drag.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <condition_variable>
#include <map>
#include <mutex>
#include <thread>
#include <utility>

#include "renderer/trace/camera/camera_projection.h"
#include "tests/support/loop_views.h"

namespace helio::bench {
namespace {

constexpr double kRestSeconds = 2, kDegreesAView = 0.5;
// What is brighter than so many times the picture's mean is white.
constexpr float kWhite = 4;

// Radiance of the whole previews, by view.
class PreviewSink final : public FrameSink {
 public:
  PreviewSink(int width, int height) : width_(width), height_(height) {}

  void frame_begun(const FrameBegin& begin) override {
    const std::lock_guard lock(mutex_);
    preview_ = begin.preview;
    view_ = begin.tag.view_id;
    if (preview_) pictures_[view_] = empty();
  }
  void tile_ready(FrameTile tile) override {
    if (!tile.preview) return;
    const std::lock_guard lock(mutex_);
    for (int c = 0; c < 3; ++c)
      test::put_rows(tile.pixels.display[c], tile.pixels.window, width_, pictures_[view_].channels[c]);
  }
  void frame_ended(const FrameEnd& end) override {
    const std::lock_guard lock(mutex_);
    if (!preview_) return;
    LoopPicture& picture = pictures_[view_];
    picture.seconds = end.progress.seconds;
    picture.end = end;
    changed_.notify_all();
  }

  // Waits for the view's. internal: it failed.
  Result<LoopPicture> take(std::uint64_t view) {
    std::unique_lock lock(mutex_);
    const auto ended = [&] { return pictures_.contains(view) && pictures_[view].seconds > 0; };
    if (!changed_.wait_for(lock, std::chrono::seconds(30), ended))
      return Error{ErrorCode::internal, "no preview came", std::to_string(view)};
    LoopPicture picture = std::move(pictures_[view]);
    pictures_.erase(view);
    if (picture.end.reason != FrameEndReason::preview)
      return Error{ErrorCode::internal, "the preview failed: " + picture.end.message, std::to_string(view)};
    return picture;
  }

 private:
  LoopPicture empty() const {
    LoopPicture picture;
    picture.width = width_;
    picture.height = height_;
    for (auto& channel : picture.channels) channel.assign(picture.view().pixels(), 0.0f);
    return picture;
  }

  int width_, height_;
  std::mutex mutex_;
  std::condition_variable changed_;
  bool preview_ = false;
  std::uint64_t view_ = 0;
  std::map<std::uint64_t, LoopPicture> pictures_;
};

}  // namespace

Result<DraggedPreviews> drag_previews(RenderEngine& engine, const ErrorScene& scene, const PreviewDrag& what) {
  RenderLoopOptions options;
  options.channels |= kResolveDisplay;
  const auto sink = std::make_shared<PreviewSink>(what.settings.width, what.settings.height);
  RenderLoop loop(engine, scene.scene, what.settings, {}, RenderRank::interactive, sink, options);
  DraggedPreviews drag;
  const auto move_to = [&](int view) {
    RenderLoop::Update update;
    update.view = View{std::uint64_t(view) + 1, test::turned_and_shifted(scene.view, kDegreesAView * view, 0)};
    update.view->camera.aspect = 0;
    if (what.gaze) update.view->gaze = what.gaze(view);
    loop.update(update);
    return update.view->camera;
  };
  move_to(0);
  std::this_thread::sleep_for(std::chrono::duration<double>(kRestSeconds));
  auto due = std::chrono::steady_clock::now();
  for (int view = 1; view <= what.looked_at.back(); ++view) {
    const CameraPose camera = move_to(view);
    auto picture = sink->take(std::uint64_t(view) + 1);
    if (!picture) return picture.error();
    drag.mean_seconds += picture->seconds / what.looked_at.back();
    if (std::ranges::find(what.looked_at, view) != what.looked_at.end()) {
      drag.previews.push_back(std::move(*picture));
      drag.cameras.push_back(camera);
    }
    due += std::chrono::microseconds(std::int64_t(1e6 / what.settings.preview.rate));
    std::this_thread::sleep_until(due);
  }
  return drag;
}

double preview_flicker(const LoopPicture& before, const ErrorScene& before_truth, const LoopPicture& after,
                       const ErrorScene& after_truth, const std::function<bool(int x, int y)>& counts) {
  const int width = before.width, height = before.height;
  const CameraProjection from(before_truth.view, width, height, V3d(0, 0, 0));
  const CameraProjection to(after_truth.view, width, height, V3d(0, 0, 0));
  const float white = kWhite * float(mean_of(after_truth.reference));
  double sum = 0, count = 0;
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      if (counts && !counts(x, y)) continue;
      const FilmPoint p = from.direction(to.direction_at(x + 0.5, y + 0.5));
      if (!p.in_front || !(p.x >= 0 && p.y >= 0 && p.x < width && p.y < height)) continue;
      const std::size_t there = std::size_t(p.y) * std::size_t(width) + std::size_t(p.x);
      const std::size_t here = std::size_t(y) * std::size_t(width) + std::size_t(x);
      for (int c = 0; c < 3; ++c) {
        const auto error = [&](const LoopPicture& picture, const ErrorScene& truth, std::size_t i) {
          return std::min(picture.channels[c][i], white) - std::min(truth.reference.channels[c][i], white);
        };
        sum += std::fabs(error(after, after_truth, here) - error(before, before_truth, there));
      }
      count += 3;
    }
  }
  return sum / count / mean_of(after_truth.reference);
}

}  // namespace helio::bench
