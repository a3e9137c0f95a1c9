#include "loop_rendering.h"

#include <algorithm>
#include <future>

#include "renderer/base/clock.h"

namespace helio::bench {

namespace {

class PictureSink final : public FrameSink {
 public:
  explicit PictureSink(LoopPicture& picture) : picture_(picture) {}

  void frame_begun(const FrameBegin&) override {}
  void tile_ready(FrameTile tile) override {
    const PixelRect& window = tile.pixels.window;
    for (int c = 0; c < 3; ++c) {
      for (int y = window.y0; y < window.y1; ++y) {
        const auto row = tile.pixels.radiance[c].begin() + std::ptrdiff_t(y - window.y0) * window.width();
        std::copy_n(row, window.width(), picture_.channels[c].begin() + std::ptrdiff_t(y) * picture_.width + window.x0);
      }
    }
  }
  void frame_ended(const FrameEnd& end) override { end_.set_value({end, now_s()}); }

  std::pair<FrameEnd, double> wait() { return end_.get_future().get(); }

 private:
  LoopPicture& picture_;
  std::promise<std::pair<FrameEnd, double>> end_;
};

}  // namespace

Result<LoopPicture> render_picture(RenderEngine& engine, const std::shared_ptr<const RenderScene>& scene,
                                   const RenderSettings& settings, std::uint32_t samples) {
  LoopPicture picture;
  picture.width = settings.width;
  picture.height = settings.height;
  for (auto& channel : picture.channels) channel.assign(picture.view().pixels(), 0.0f);

  Budget budget;
  budget.samples = samples;
  const auto sink = std::make_shared<PictureSink>(picture);
  RenderLoop loop(engine, scene, settings, budget, RenderRank::job, sink);
  View view;
  view.id = 1;
  view.camera = camera_pose(scene->description().cameras.front());
  RenderLoop::Update update;
  update.view = view;
  const double started = now_s();
  loop.update(update);
  const auto [end, ended] = sink->wait();
  if (end.reason != FrameEndReason::samples) {
    return Error{
        ErrorCode::internal, std::string("the frame ended by ") + to_string(end.reason) + " " + end.message, {}};
  }
  picture.seconds = ended - started;
  picture.rays = end.progress.trace.rays;
  return picture;
}

}  // namespace helio::bench
