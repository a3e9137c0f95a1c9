// Queue of a loop's sink: tiles and ends of frames, in order. A plain data structure: its owner locks it.
#pragma once

#include <cstddef>
#include <list>
#include <memory>
#include <variant>

#include "renderer/frame/frame_sink.h"
#include "renderer/frame/stage.h"

namespace helio {

struct FrameRecord;

struct FrameBegun {};  // its FrameBegin is the record's

struct SinkEvent {
  std::shared_ptr<FrameRecord> frame;
  std::variant<FrameBegun, FrameTile, FrameEnd> what;
};

// Memory for one event, and the event once it has one; empty when the memory was handed on.
using SinkEventSlot = std::list<SinkEvent>;

// One frame, from the sink's side. Times in seconds; points in time on the now_s() clock.
struct FrameRecord {
  FrameBegin begin;
  double accepted_s = 0, begun_s = 0;
  double first_tile_s = 0;           // 0: no tile was handed over yet
  PerStage<double> stage_seconds{};  // of processor time
  double publish_seconds = 0;        // of the same, in the sink
  bool begin_delivered = false;
  int end_tries = 0;  // the sink threw when it was told of the end
  // Allocated with the record: a frame that has one can begin and end without memory.
  SinkEventSlot begin_slot{1}, end_slot{1};
};

class SinkQueue {
 public:
  void push(SinkEvent event) { events_.push_back(std::move(event)); }
  // Precondition: the slot is not empty. Allocates nothing.
  void push(SinkEventSlot& slot, SinkEvent event) noexcept;
  SinkEventSlot pop() noexcept;  // precondition: !empty()
  void put_back(SinkEventSlot& slot) noexcept { events_.splice(events_.begin(), slot); }
  bool empty() const { return events_.empty(); }
  std::size_t size() const { return events_.size(); }
  std::size_t bytes() const;
  // Null: it does not wait.
  FrameEnd* end_of(const FrameRecord& frame);

  void drop_tiles() noexcept;  // but those of previews
  // Drops the tiles of previews that have ended, whose ends then say so.
  void cancel_previews() noexcept;
  void drop_tiles_of(const FrameRecord& frame) noexcept;
  void drop_frame(const FrameRecord& frame) noexcept;
  void clear() noexcept { events_.clear(); }

 private:
  std::list<SinkEvent> events_;
};

// Hands the event over. Precondition: an end is complete.
void deliver(SinkEvent& event, FrameSink& sink);

}  // namespace helio
