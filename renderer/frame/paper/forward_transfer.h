// Stage: reprojection as published (forward_reprojection.h): the film is copied aside, and its pixels ask for those of
// the new camera's film.
#pragma once

#include <memory>
#include <vector>

#include "renderer/frame/paper/forward_reprojection.h"
#include "renderer/frame/stages/history_transfer.h"
#include "renderer/frame/stages/temporal_reprojection.h"

namespace helio {

// The sweeps of one move: gather (film to copy, unless the film is of no use), project, carry. Where nothing can be
// carried over, one that clears. A move that is interrupted after the first sweep is begun again from the copy.
class ForwardTransfer final : public TemporalReprojection {
 public:
  // Scene, film, which has first hits, and history outlive this. max_error: of eq. 15, radiance, > 0.
  ForwardTransfer(std::shared_ptr<const RenderScene> scene, Film& film, const PixelRect& region,
                  PictureHistory& history, const CameraPose& pose, const PixelFilter& filter, float max_error);

  std::size_t parts() const override { return windows_.size(); }
  int sweeps() const override { return int(kinds_.size()); }
  void run(int sweep, std::size_t part, TraceStats& stats) override;
  void finish_sweep(int sweep) override;
  void note(PictureState& picture) override;

 private:
  enum class Sweep { gather, withdraw, project, carry, clear };

  Film& film_;
  LeftPicture& left_;
  PictureHistory& history_;
  CameraPose pose_;
  std::vector<PixelRect> windows_;
  std::vector<Sweep> kinds_;
  std::unique_ptr<ForwardReprojection> reprojection_;  // null: clear
};

}  // namespace helio
