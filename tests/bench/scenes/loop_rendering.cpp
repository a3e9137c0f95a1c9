#include "tests/bench/scenes/loop_rendering.h"

namespace helio::bench {

Result<LoopPicture> render_picture(RenderEngine& engine, const std::shared_ptr<const RenderScene>& scene,
                                   const RenderSettings& settings, std::uint32_t samples, const CameraPose& camera,
                                   const RenderLoopOptions& options) {
  Budget budget;
  budget.samples = samples;
  LoopPicture picture = test::render_through_loop(engine, scene, settings, budget, camera, options);
  if (picture.end.reason != FrameEndReason::samples) {
    return Error{ErrorCode::internal,
                 std::string("the frame ended by ") + to_string(picture.end.reason) + " " + picture.end.message,
                 {}};
  }
  return picture;
}

Result<LoopPicture> render_picture(RenderEngine& engine, const std::shared_ptr<const RenderScene>& scene,
                                   const RenderSettings& settings, std::uint32_t samples) {
  return render_picture(engine, scene, settings, samples, camera_pose(scene->description().cameras.at(0)));
}

}  // namespace helio::bench
