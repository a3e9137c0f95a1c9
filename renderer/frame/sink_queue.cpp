#include "renderer/frame/sink_queue.h"

#include <algorithm>
#include <utility>

namespace helio {

SinkEvent SinkQueue::pop() {
  SinkEvent event = std::move(events_.front());
  events_.pop_front();
  return event;
}

std::size_t SinkQueue::bytes() const {
  std::size_t floats = 0;
  for (const SinkEvent& event : events_) {
    const auto* tile = std::get_if<FrameTile>(&event.what);
    if (!tile) continue;
    const ResolvedTile& p = tile->pixels;
    for (int c = 0; c < 3; ++c)
      floats += p.radiance[c].size() + p.variance[c].size() + p.normal[c].size() + p.albedo[c].size();
    floats += p.samples.size() + p.alpha.size() + p.depth.size();
  }
  return floats * sizeof(float);
}

void SinkQueue::drop_tiles() {
  std::erase_if(events_, [](const SinkEvent& event) { return std::holds_alternative<FrameTile>(event.what); });
}

void SinkQueue::drop_frame(const FrameRecord& frame) {
  std::erase_if(events_, [&](const SinkEvent& event) { return event.frame.get() == &frame; });
}

void deliver(SinkEvent event, FrameSink& sink) {
  if (auto* tile = std::get_if<FrameTile>(&event.what)) {
    sink.tile_ready(std::move(*tile));
  } else if (const auto* begin = std::get_if<FrameBegin>(&event.what)) {
    sink.frame_begun(*begin);
  } else {
    sink.frame_ended(std::get<FrameEnd>(event.what));
  }
}

}  // namespace helio
