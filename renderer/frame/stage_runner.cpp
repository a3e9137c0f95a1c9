#include "renderer/frame/stage_runner.h"

#include <utility>

#include "renderer/base/check.h"

namespace helio {

void run(const StageItem& item, TraceStats& stats) {
  if (item.ends_sweep) {
    item.stage->finish_sweep(item.sweep);
  } else {
    item.stage->run(item.sweep, item.part, stats);
  }
}

void StageRunner::begin(std::shared_ptr<FrameStage> stage) {
  HELIO_DCHECK(in_flight_ == 0);
  stop();
  stage_ = std::move(stage);
  sweep_ = 0;
  if (stage_) open_sweep();
}

// What the stage says of itself is asked for while nothing of it is in flight, and remembered.
void StageRunner::open_sweep() {
  sweeps_ = stage_->sweeps();
  parts_ = sweep_ < sweeps_ ? stage_->parts() : 0;
  next_ = done_ = 0;
  ends_ = sweep_ < sweeps_ && parts_ == 0 ? End::due : End::no;
}

std::optional<StageItem> StageRunner::next() {
  if (!any_open()) return std::nullopt;
  ++in_flight_;
  if (parts_open()) return StageItem{stage_, sweep_, next_++, false};
  ends_ = End::taken;
  return StageItem{stage_, sweep_, 0, true};
}

void StageRunner::finish(const StageItem& item, bool done) {
  --in_flight_;
  if (item.stage != stage_) return;  // stopped meanwhile
  if (!done) return stop();
  if (item.ends_sweep) {
    ++sweep_;
    open_sweep();
  } else if (++done_ == parts_) {
    ends_ = End::due;
  }
}

void StageRunner::stop() {
  stage_.reset();
  ends_ = End::no;
  parts_ = next_ = 0;
}

}  // namespace helio
