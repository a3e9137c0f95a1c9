// A picture through a render loop of job rank: as the product makes it.
#pragma once

#include <future>
#include <memory>
#include <utility>
#include <vector>

#include "renderer/base/clock.h"
#include "renderer/base/picture_view.h"
#include "renderer/frame/render_loop.h"
#include "tests/support/tile_rows.h"

namespace helio::test {

struct LoopPicture {
  FrameEnd end;
  double seconds = 0;  // view accepted -> end of the frame, whose final tiles are resolved by then
  int width = 0, height = 0;
  std::vector<float> channels[3];  // row-major, top row first
  std::vector<float> display[3], display_error;  // likewise, where the loop's channels have them

  PictureView view() const { return {width, height, {channels[0].data(), channels[1].data(), channels[2].data()}}; }
  PictureView display_view() const {
    return {width, height, {display[0].data(), display[1].data(), display[2].data()}};
  }
};

namespace detail {

class LoopPictureSink final : public FrameSink {
 public:
  explicit LoopPictureSink(LoopPicture& picture) : picture_(picture) {}

  void frame_begun(const FrameBegin&) override {}
  void tile_ready(FrameTile tile) override {
    const PixelRect& window = tile.pixels.window;
    for (int c = 0; c < 3; ++c) {
      put_rows(tile.pixels.radiance[c], window, picture_.width, picture_.channels[c]);
      put_rows(tile.pixels.display[c], window, picture_.width, picture_.display[c]);
    }
    put_rows(tile.pixels.display_error, window, picture_.width, picture_.display_error);
  }
  void frame_ended(const FrameEnd& end) override { end_.set_value({end, now_s()}); }

  std::pair<FrameEnd, double> wait() { return end_.get_future().get(); }

 private:
  LoopPicture& picture_;
  std::promise<std::pair<FrameEnd, double>> end_;
};

}  // namespace detail

// A view to the end of the budget. The loop, and with it the film, is made before the clock starts, as for a resident
// session.
inline LoopPicture render_through_loop(RenderEngine& engine, const std::shared_ptr<const RenderScene>& scene,
                                       const RenderSettings& settings, const Budget& budget, const CameraPose& camera,
                                       const RenderLoopOptions& options = {}) {
  LoopPicture picture;
  picture.width = settings.width;
  picture.height = settings.height;
  const std::size_t pixels = picture.view().pixels();
  for (auto& channel : picture.channels) channel.assign(pixels, 0.0f);
  if (options.channels & kResolveDisplay) {
    for (auto& channel : picture.display) channel.assign(pixels, 0.0f);
    picture.display_error.assign(pixels, 0.0f);
  }
  const auto sink = std::make_shared<detail::LoopPictureSink>(picture);
  RenderLoop loop(engine, scene, settings, budget, RenderRank::job, sink, options);
  View view;
  view.id = 1;
  view.camera = camera;
  view.camera.aspect = 0;  // as tests and benches that make a Camera of the pose see it
  RenderLoop::Update update;
  update.view = view;
  const double started = now_s();
  loop.update(update);
  auto [end, ended] = sink->wait();
  picture.end = std::move(end);
  picture.seconds = ended - started;
  return picture;
}

// The scene's first camera.
inline LoopPicture render_through_loop(RenderEngine& engine, const std::shared_ptr<const RenderScene>& scene,
                                       const RenderSettings& settings, const Budget& budget) {
  return render_through_loop(engine, scene, settings, budget, camera_pose(scene->description().cameras.at(0)));
}

}  // namespace helio::test
