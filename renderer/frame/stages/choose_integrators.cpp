#include "renderer/frame/stages/choose_integrators.h"

#include <utility>

#include "renderer/frame/picture_state.h"

namespace helio {

ChooseIntegrators::ChooseIntegrators(std::shared_ptr<const RenderScene> scene, const CameraPose& pose,
                                     const PathSettings& settings, std::shared_ptr<const CancelToken> cancel,
                                     Film& film, TechniqueHistory* history)
    : FrameStage(StageId::choose),
      scene_(scene),
      film_(film),
      history_(history),
      pilot_(std::move(scene), pose, film.width(), film.height(), settings, std::move(cancel),
             history ? history->views(scene_, film.width(), film.height()) : TechniqueHistory::Views()) {}

void ChooseIntegrators::run(int sweep, std::size_t part, TraceStats&) {
  pilot_.run(sweep, part);
}

void ChooseIntegrators::finish_sweep(int sweep) {
  pilot_.finish_sweep(sweep);
  if (pilot_.has_result()) film_.set_light_tiles(std::make_shared<const LightTiles>(pilot_.result()));
}

void ChooseIntegrators::finished(TileGrid&) {
  if (history_ && pilot_.probed()) history_->note(scene_, pilot_.probed(), pilot_.whole());
}

void ChooseIntegrators::note(PictureState& picture) {
  picture.state.choice_due = false;
}

}  // namespace helio
