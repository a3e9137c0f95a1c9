#include "renderer/frame/stages/checkpoint.h"

#include <utility>

#include "renderer/base/clock.h"
#include "renderer/frame/stages/make_stage.h"

namespace helio {
namespace {

PictureHead head_of(const StageContext& context) {
  const PictureState& picture = context.picture;
  PictureHead head;
  head.settings = settings_digest(context.settings);
  head.camera = camera_digest(context.camera);
  head.region = context.grid.region();
  head.view_id = context.view_id;
  head.seconds = now_s() - picture.state.begun_s;
  head.samples = picture.samples;
  head.trace = picture.trace;
  head.measured = picture.state.measured;
  head.round = picture.state.round;
  head.cells = context.grid.progress();
  read_film(context.film, head);
  return head;
}

}  // namespace

MakeCheckpoint::MakeCheckpoint(const StageContext& context, CheckpointMaker& maker)
    : FrameStage(StageId::checkpoint), film_(context.film), memory_(maker.memory()), keep_(maker.keeper(memory_)) {
  memory_->checkpoint.begin(head_of(context), context.film.state());
  maker.clock.begun();
}

void MakeCheckpoint::run(int, std::size_t part, TraceStats&) {
  PictureCheckpoint& checkpoint = memory_->checkpoint;
  checkpoint.film().save(film_, part, checkpoint.pixels());
}

void MakeCheckpoint::finish_sweep(int) {
  keep_();
}

}  // namespace helio
