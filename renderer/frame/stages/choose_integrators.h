// Pass: decides which tiles of a new picture get light paths (trace/selection/pilot_render.h). Integrator pt+bdpt.
#pragma once

#include "renderer/frame/stages/sweeps.h"
#include "renderer/trace/selection/pilot_render.h"

namespace helio {

class TechniqueChoice {
 public:
  // The film outlives this, and has no samples; so does the history, which is drawn on and added to. Null: none, as
  // where a picture may depend on none before. A work that was cancelled is to be dropped before its sweep ends; what
  // it has chosen by then counts, and is not remembered.
  TechniqueChoice(std::shared_ptr<const RenderScene> scene, const CameraPose& pose, const PathSettings& settings,
                  std::shared_ptr<const CancelToken> cancel, Film& film, TechniqueHistory* history)
      : scene_(scene),
        film_(film),
        history_(history),
        probe_(std::move(scene), pose, film.width(), film.height(), settings, std::move(cancel),
               history ? history->views(scene_, film.width(), film.height()) : TechniqueHistory::Views()) {}

  std::size_t parts() const { return probe_.parts(); }
  int sweeps() const { return probe_.sweeps(); }
  void run(int sweep, std::size_t part) { probe_.run(sweep, part); }
  void finish_sweep(int sweep) {
    probe_.finish_sweep(sweep);
    if (!probe_.has_result()) return;
    film_.set_light_tiles(std::make_shared<const LightTiles>(probe_.result()));
    if (sweep + 1 < sweeps()) return;
    if (history_ && probe_.probed()) history_->note(scene_, probe_.probed(), probe_.whole());
  }

 private:
  std::shared_ptr<const RenderScene> scene_;
  Film& film_;
  TechniqueHistory* history_;
  PilotRender probe_;
};

using ChoosePiece = SweepPiece<TechniqueChoice>;
using ChoosePass = SweepPass<TechniqueChoice>;

}  // namespace helio
