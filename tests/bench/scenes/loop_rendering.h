// Pictures of the benches: so many samples, through the render loop.
#pragma once

#include "tests/support/loop_picture.h"

namespace helio::bench {

using test::LoopPicture;

// As test::render_through_loop. internal: the frame failed or did not end by its samples.
Result<LoopPicture> render_picture(RenderEngine& engine, const std::shared_ptr<const RenderScene>& scene,
                                   const RenderSettings& settings, std::uint32_t samples, const CameraPose& camera,
                                   const RenderLoopOptions& options = {});
// The scene's first camera.
Result<LoopPicture> render_picture(RenderEngine& engine, const std::shared_ptr<const RenderScene>& scene,
                                   const RenderSettings& settings, std::uint32_t samples);

}  // namespace helio::bench
