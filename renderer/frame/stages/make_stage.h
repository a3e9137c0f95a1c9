// Builds the stages that a plan asks for.
#pragma once

#include <memory>

#include "renderer/film/display/display_layer.h"
#include "renderer/frame/checkpoint/checkpoint_maker.h"
#include "renderer/frame/frame_pipeline.h"
#include "renderer/frame/picture_state.h"
#include "renderer/frame/stages/history_transfer.h"
#include "renderer/trace/selection/technique_history.h"

namespace helio {

// What a stage may work on. All of it outlives the stage.
struct StageContext {
  const std::shared_ptr<const RenderScene>& scene;  // null: another source of radiance
  const RenderSettings& settings;                   // of the frame
  const CameraPose& camera;
  const std::shared_ptr<CancelToken>& cancel;
  Film& film;
  const TileGrid& grid;
  PictureHistory& history;
  TechniqueHistory* techniques;  // null: the picture may depend on none before
  DisplayLayer* display;         // null: no tile has that layer
  PictureState& picture;
  std::uint64_t view_id = 0;
  CheckpointMaker* checkpoints = nullptr;  // null: none are made
  std::optional<GazeDensity> density = {};  // of the film; absent: no gaze, or it changes nothing there
};

std::shared_ptr<FrameStage> make_stage(const StageRequest& request, const StageContext& context);
// Of the whole plan.
FrameStages make_stages(const FramePlan& plan, const StageContext& context);

}  // namespace helio
