#include "renderer/frame/stage_runner.h"

#include <utility>

#include "renderer/base/check.h"
#include "renderer/frame/window_order.h"

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
  order_ = parts_ > 0 ? stage_->order() : nullptr;
  next_ = done_ = 0;
  ends_ = sweep_ < sweeps_ && parts_ == 0 ? End::due : End::no;
}

bool StageRunner::parts_open() const {
  return stage_ && (order_ ? order_->any_open() : next_ < parts_);
}

std::optional<StageItem> StageRunner::next() {
  if (!any_open()) return std::nullopt;
  StageItem item{stage_, sweep_, 0, !parts_open()};
  if (item.ends_sweep) {
    ends_ = End::taken;
  } else {
    item.part = order_ ? *order_->next() : next_++;
  }
  ++in_flight_;
  return item;
}

void StageRunner::finish(const StageItem& item, bool done) {
  --in_flight_;
  if (item.stage != stage_) return;  // stopped meanwhile
  if (!done) return stop();
  if (item.ends_sweep) {
    ++sweep_;
    open_sweep();
  } else {
    if (order_) order_->finish(item.part);
    if (++done_ == parts_) ends_ = End::due;
  }
}

void StageRunner::stop() {
  stage_.reset();
  order_ = nullptr;
  ends_ = End::no;
  parts_ = next_ = 0;
}

}  // namespace helio
