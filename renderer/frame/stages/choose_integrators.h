// Stage: decides which tiles of a new picture get light paths (trace/selection/pilot_render.h). Integrator pt+bdpt.
#pragma once

#include <memory>

#include "renderer/frame/stage.h"
#include "renderer/trace/selection/pilot_render.h"

namespace helio {

class ChooseIntegrators final : public FrameStage {
 public:
  // The film outlives this, and has no samples; so does the history, which is drawn on and added to. Null: none, as
  // where a picture may depend on none before. A stage that was cancelled is to be let go before its sweep ends; what
  // it has chosen by then counts, and is not remembered.
  ChooseIntegrators(std::shared_ptr<const RenderScene> scene, const CameraPose& pose, const PathSettings& settings,
                    std::shared_ptr<const CancelToken> cancel, Film& film, TechniqueHistory* history);

  int sweeps() const override { return pilot_.sweeps(); }
  std::size_t parts() const override { return pilot_.parts(); }
  void run(int sweep, std::size_t part, TraceStats& stats) override;
  void finish_sweep(int sweep) override;
  void finished(TileGrid& grid) override;
  void note(PictureState& picture) override;

 private:
  std::shared_ptr<const RenderScene> scene_;
  Film& film_;
  TechniqueHistory* history_;
  PilotRender pilot_;
};

}  // namespace helio
