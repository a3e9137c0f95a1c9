// One view after the other through a render loop, as a session that moves.
#pragma once

#include <condition_variable>
#include <map>
#include <mutex>
#include <numeric>
#include <utility>
#include <vector>

#include "renderer/base/clock.h"
#include "renderer/base/picture_view.h"
#include "renderer/frame/render_loop.h"
#include "tests/support/tile_rows.h"

namespace helio::test {

// Of a small picture.
inline RenderSettings loop_settings(int width, int height, RenderMode mode) {
  RenderSettings settings;
  settings.width = width;
  settings.height = height;
  settings.mode = mode;
  settings.seed = 5;
  return settings;
}

struct ViewPicture {
  FrameEnd end;
  double seconds = 0;  // the update -> the end of the frame, whose final tiles are resolved by then
  int width = 0, height = 0;
  std::uint64_t seed = 0;  // of its fresh samples: in modes with reuse not that of the settings asked for
  std::vector<float> radiance[3], variance[3], samples, bound, density;  // row-major, top row first

  PictureView view() const { return {width, height, {radiance[0].data(), radiance[1].data(), radiance[2].data()}}; }
};

// Radiance, variance and samples, to the bit.
inline bool same_pixels(const ViewPicture& a, const ViewPicture& b) {
  for (int c = 0; c < 3; ++c) {
    if (a.radiance[c] != b.radiance[c] || a.variance[c] != b.variance[c]) return false;
  }
  return a.samples == b.samples;
}

inline double mean_samples(const ViewPicture& picture) {
  return std::accumulate(picture.samples.begin(), picture.samples.end(), 0.0) / double(picture.samples.size());
}

// Over pixels and channels.
inline double mean_radiance(const ViewPicture& picture) {
  double sum = 0;
  for (const std::vector<float>& channel : picture.radiance) {
    for (const float value : channel) sum += value;
  }
  return sum / (3.0 * double(picture.samples.size()));
}

class LoopViews {
 public:
  LoopViews(RenderEngine& engine, std::shared_ptr<const RenderScene> scene, const RenderSettings& settings,
            RenderLoopOptions options = {})
      : sink_(std::make_shared<Sink>(settings.width, settings.height)) {
    if (!options.publish_passes) options.publish_passes = false;
    loop_.emplace(engine, std::move(scene), settings, Budget{}, RenderRank::interactive, sink_, options);
  }

  // A view, or the same one with more samples (both halves together, fresh ones).
  const ViewPicture& render(const CameraPose& camera, std::uint32_t samples) {
    Budget budget;
    budget.samples = samples;
    return render(camera, budget);
  }
  // resume: as in RenderLoop::Update.
  const ViewPicture& render(const CameraPose& camera, const Budget& budget,
                            const std::optional<RenderSettings>& settings = std::nullopt,
                            std::shared_ptr<const PictureCheckpoint> resume = nullptr) {
    RenderLoop::Update update;
    update.settings = settings;
    update.resume = std::move(resume);
    update.scene = std::exchange(scene_, nullptr);
    View view;
    view.id = ++views_;
    view.camera = camera;
    view.gaze = gaze;
    view.camera.aspect = 0;  // as tests and benches that make a Camera of the pose see it
    update.view = view;
    update.budget = budget;
    const double started = now_s();
    const std::uint64_t revision = loop_->update(update);
    sink_->picture.seconds = sink_->wait_for(revision) - started;
    return sink_->picture;
  }

  // The picture that there is once the frame has ended that a gaze alone began. Precondition: it begins one.
  const ViewPicture& move_gaze(const Gaze& to) {
    gaze = to;
    const std::uint64_t frame = sink_->frame();
    loop_->move_gaze(to);
    sink_->wait_for_frame_after(frame);
    return sink_->picture;
  }
  // The picture that there is once no frame has been in flight for a while.
  const ViewPicture& settle() {
    sink_->wait_until_idle();
    return sink_->picture;
  }
  std::optional<Gaze> gaze;  // of the next views

  // The next view is of this scene.
  void set_scene(std::shared_ptr<const RenderScene> scene) { scene_ = std::move(scene); }

  RenderLoop& loop() { return *loop_; }
  // How many have ended so.
  int previews(FrameEndReason reason) {
    const std::lock_guard lock(sink_->mutex);
    return sink_->previews[reason];
  }

 private:
  struct Sink final : FrameSink {
    Sink(int width, int height) {
      picture.width = width;
      picture.height = height;
      for (int c = 0; c < 3; ++c) {
        picture.radiance[c].resize(std::size_t(width) * std::size_t(height));
        picture.variance[c].resize(picture.radiance[c].size());
      }
      picture.samples.resize(picture.radiance[0].size());
      picture.bound.resize(picture.radiance[0].size());
      picture.density.resize(picture.radiance[0].size());
    }
    void frame_begun(const FrameBegin& begin) override {
      const std::lock_guard lock(mutex);
      previewing = begin.preview;
      if (previewing) return;
      in_flight = true;
      ++begun;
      picture.seed = begin.settings.seed;
    }
    void tile_ready(FrameTile tile) override {
      if (tile.preview) return;
      const std::lock_guard lock(mutex);
      const PixelRect& window = tile.pixels.window;
      for (int c = 0; c < 3; ++c) {
        put_rows(tile.pixels.radiance[c], window, picture.width, picture.radiance[c]);
        put_rows(tile.pixels.variance[c], window, picture.width, picture.variance[c]);
      }
      put_rows(tile.pixels.samples, window, picture.width, picture.samples);
      put_rows(tile.pixels.bias_bound, window, picture.width, picture.bound);
      put_rows(tile.pixels.density, window, picture.width, picture.density);
    }
    void frame_ended(const FrameEnd& end) override {
      const std::lock_guard lock(mutex);
      if (previewing) {
        ++previews[end.reason];
        return;
      }
      picture.end = end;
      in_flight = false;
      ended_s = now_s();
      changed.notify_all();
    }
    double wait_for(std::uint64_t revision) {
      std::unique_lock lock(mutex);
      changed.wait(lock, [&] { return picture.end.tag.revision >= revision; });
      return ended_s;
    }

    std::uint64_t frame() {
      const std::lock_guard lock(mutex);
      return picture.end.tag.frame;
    }
    void wait_for_frame_after(std::uint64_t frame) {
      std::unique_lock lock(mutex);
      changed.wait(lock, [&] { return picture.end.tag.frame > frame; });
    }
    void wait_until_idle() {
      std::unique_lock lock(mutex);
      for (std::uint64_t seen = ~std::uint64_t(0); in_flight || seen != begun;) {
        seen = begun;
        changed.wait_for(lock, std::chrono::milliseconds(50), [] { return false; });
      }
    }

    ViewPicture picture;
    bool in_flight = false;
    std::uint64_t begun = 0;  // frames of the film
    std::map<FrameEndReason, int> previews;
    bool previewing = false;
    double ended_s = 0;
    std::mutex mutex;
    std::condition_variable changed;
  };

  std::shared_ptr<Sink> sink_;
  std::optional<RenderLoop> loop_;
  std::shared_ptr<const RenderScene> scene_;
  std::uint64_t views_ = 0;
};

// About the camera's own up vector, positive to the left; then along its own right axis.
inline CameraPose turned_and_shifted(CameraPose pose, double degrees, double shift) {
  const double a = degrees * std::numbers::pi / 180, cosine = std::cos(a), sine = std::sin(a);
  const V3d right = pose.right, forward = pose.forward;
  pose.position += right * shift;
  if (degrees == 0) return pose;
  pose.forward = forward * cosine - right * sine;
  pose.right = right * cosine + forward * sine;
  return pose;
}

}  // namespace helio::test
