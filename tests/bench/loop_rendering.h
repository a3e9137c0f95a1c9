// A picture as the product makes it: through a RenderLoop of job rank.
#pragma once

#include <memory>
#include <vector>

#include "renderer/base/picture_view.h"
#include "renderer/frame/render_loop.h"

namespace helio::bench {

struct LoopPicture {
  double seconds = 0;  // view accepted -> end of the frame, whose final tiles are resolved by then
  std::uint64_t rays = 0;
  int width = 0, height = 0;
  std::vector<float> channels[3];

  PictureView view() const { return {width, height, {channels[0].data(), channels[1].data(), channels[2].data()}}; }
};

// The loop, and with it the film, is made before the clock starts, as for a resident session. internal: the frame
// failed or did not end by its samples.
Result<LoopPicture> render_picture(RenderEngine& engine, const std::shared_ptr<const RenderScene>& scene,
                                   const RenderSettings& settings, std::uint32_t samples);

}  // namespace helio::bench
