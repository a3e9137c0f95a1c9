// What waits to be told to a loop's sink, in order. A plain data structure: its owner locks it.
#pragma once

#include <cstddef>
#include <deque>
#include <memory>
#include <variant>

#include "renderer/frame/frame_sink.h"

namespace helio {

// One frame, from the sink's side. Times in seconds; points in time on the now_s() clock.
struct FrameRecord {
  FrameBegin begin;
  double accepted_s = 0, begun_s = 0;
  double first_tile_s = 0;  // 0: no tile was handed over yet
  double reproject_seconds = 0, choose_seconds = 0, review_seconds = 0, allocate_seconds = 0, lights_seconds = 0,
         integrate_seconds = 0, measure_seconds = 0, resolve_seconds = 0, publish_seconds = 0;
  bool begin_delivered = false;
};

struct SinkEvent {
  std::shared_ptr<FrameRecord> frame;
  std::variant<FrameBegin, FrameTile, FrameEnd> what;
};

class SinkQueue {
 public:
  void push(SinkEvent event) { events_.push_back(std::move(event)); }
  SinkEvent pop();  // precondition: !empty()
  bool empty() const { return events_.empty(); }
  std::size_t size() const { return events_.size(); }
  std::size_t bytes() const;

  void drop_tiles();
  void drop_frame(const FrameRecord& frame);
  void clear() { events_.clear(); }

 private:
  std::deque<SinkEvent> events_;
};

// Hands the event over. Precondition: an end is complete.
void deliver(SinkEvent event, FrameSink& sink);

}  // namespace helio
