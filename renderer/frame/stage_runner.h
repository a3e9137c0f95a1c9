// Hands out the parts of one stage, sweep by sweep.
#pragma once

#include <cstddef>
#include <memory>
#include <optional>

#include "renderer/frame/stage.h"

namespace helio {

// A part of a sweep, or its end.
struct StageItem {
  std::shared_ptr<FrameStage> stage;
  int sweep = 0;
  std::size_t part = 0;
  bool ends_sweep = false;
};

// Thread safe for items that were handed out together. Adds to `stats` what was traced.
void run(const StageItem& item, TraceStats& stats);

// Not thread safe: the owner's lock guards it.
class StageRunner {
 public:
  // Precondition: nothing is in flight. Null: nothing is to be done.
  void begin(std::shared_ptr<FrameStage> stage);
  std::optional<StageItem> next();
  bool any_open() const { return ends_ == End::due || parts_open(); }
  // Parts of a sweep that nobody has taken; its end does not count.
  bool parts_open() const;
  // done: the item has run; else the stage is in no defined state and goes no further.
  void finish(const StageItem& item, bool done);
  // Hands out nothing more.
  void stop();
  // Nothing is in flight, and nothing more will be handed out.
  bool finished() const { return in_flight_ == 0 && (!stage_ || complete()); }
  // All sweeps are done.
  bool complete() const { return stage_ && sweep_ == sweeps_; }
  // Of the sweep in hand, if its parts wait for each other.
  WindowOrder* order() const { return order_; }

 private:
  enum class End { no, due, taken };
  void open_sweep();

  std::shared_ptr<FrameStage> stage_;
  WindowOrder* order_ = nullptr;  // the stage's
  int sweep_ = 0, sweeps_ = 0;
  std::size_t parts_ = 0, next_ = 0, done_ = 0;  // of the sweep
  End ends_ = End::no;
  int in_flight_ = 0;
};

}  // namespace helio
