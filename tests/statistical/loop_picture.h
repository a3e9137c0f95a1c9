// A picture through a render loop, as a job makes it.
#pragma once

#include <future>
#include <memory>
#include <vector>

#include "renderer/frame/render_loop.h"

namespace helio::test {

class LoopPicture final : public FrameSink {
 public:
  // Renders the first camera of the scene to the end of the budget. One at a time.
  FrameEnd render(RenderEngine& engine, const std::shared_ptr<const RenderScene>& scene, const RenderSettings& settings,
                  const Budget& budget) {
    width_ = settings.width;
    for (auto& channel : radiance) channel.assign(std::size_t(settings.width) * std::size_t(settings.height), 0.0f);
    end_ = std::promise<FrameEnd>();
    const std::shared_ptr<FrameSink> self(this, [](FrameSink*) {});
    RenderLoop loop(engine, scene, settings, budget, RenderRank::job, self);
    View view;
    view.id = 1;
    view.camera = camera_pose(scene->description().cameras.at(0));
    RenderLoop::Update update;
    update.view = view;
    loop.update(update);
    return end_.get_future().get();
  }

  void frame_begun(const FrameBegin&) override {}
  void tile_ready(FrameTile tile) override {
    const PixelRect& w = tile.pixels.window;
    for (int c = 0; c < 3; ++c) {
      for (int y = w.y0; y < w.y1; ++y) {
        const auto row = tile.pixels.radiance[c].begin() + std::ptrdiff_t(y - w.y0) * w.width();
        std::copy_n(row, w.width(), radiance[c].begin() + std::ptrdiff_t(y) * width_ + w.x0);
      }
    }
  }
  void frame_ended(const FrameEnd& end) override { end_.set_value(end); }

  std::vector<float> radiance[3];  // row-major, top row first

 private:
  int width_ = 0;
  std::promise<FrameEnd> end_;
};

}  // namespace helio::test
