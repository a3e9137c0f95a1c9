#include "renderer/frame/sink_queue.h"

#include <algorithm>
#include <utility>

namespace helio {

void SinkQueue::push(SinkEventSlot& slot, SinkEvent event) noexcept {
  slot.front() = std::move(event);
  events_.splice(events_.end(), slot, slot.begin());
}

SinkEventSlot SinkQueue::pop() noexcept {
  SinkEventSlot slot;
  slot.splice(slot.end(), events_, events_.begin());
  return slot;
}

std::size_t SinkQueue::bytes() const {
  std::size_t bytes = 0;
  for (const SinkEvent& event : events_) {
    if (const auto* tile = std::get_if<FrameTile>(&event.what)) bytes += tile->pixels.bytes();
  }
  return bytes;
}

FrameEnd* SinkQueue::end_of(const FrameRecord& frame) {
  for (SinkEvent& event : events_) {
    if (event.frame.get() == &frame && std::holds_alternative<FrameEnd>(event.what))
      return &std::get<FrameEnd>(event.what);
  }
  return nullptr;
}

void SinkQueue::drop_tiles() noexcept {
  std::erase_if(events_, [](const SinkEvent& event) {
    return std::holds_alternative<FrameTile>(event.what) && !event.frame->begin.preview;
  });
}

void SinkQueue::cancel_previews() noexcept {
  const auto is_tile = [](const SinkEvent& event) {
    return std::holds_alternative<FrameTile>(event.what) && event.frame->begin.preview;
  };
  for (const SinkEvent& event : events_) {
    FrameEnd* end = is_tile(event) ? end_of(*event.frame) : nullptr;
    if (end) end->reason = FrameEndReason::cancelled;
  }
  std::erase_if(events_, is_tile);
}

void SinkQueue::drop_tiles_of(const FrameRecord& frame) noexcept {
  std::erase_if(events_, [&](const SinkEvent& event) {
    return std::holds_alternative<FrameTile>(event.what) && event.frame.get() == &frame;
  });
}

void SinkQueue::drop_frame(const FrameRecord& frame) noexcept {
  std::erase_if(events_, [&](const SinkEvent& event) { return event.frame.get() == &frame; });
}

void deliver(SinkEvent& event, FrameSink& sink) {
  if (auto* tile = std::get_if<FrameTile>(&event.what)) {
    sink.tile_ready(std::move(*tile));
  } else if (std::holds_alternative<FrameBegun>(event.what)) {
    sink.frame_begun(event.frame->begin);
  } else {
    sink.frame_ended(std::get<FrameEnd>(event.what));
  }
}

}  // namespace helio
