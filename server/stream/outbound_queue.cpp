#include "server/stream/outbound_queue.h"

#include <algorithm>

namespace helio {
namespace {

// Rate limiting lets this much sending time accumulate while nothing is sent.
constexpr double kRateBurst = 0.1;

}  // namespace

void OutboundQueue::push(Greeting greeting) {
  const std::lock_guard lock(mutex_);
  if (!closed_) greeting_ = std::move(greeting);
}

void OutboundQueue::push(Notice notice) {
  const std::lock_guard lock(mutex_);
  if (!closed_) notices_[notice.severity] = std::move(notice);
}

void OutboundQueue::push(const FrameBegin& begin) {
  const std::lock_guard lock(mutex_);
  if (closed_ || (!begin.preview && begin.tag.revision < min_revision_)) return;
  Frame frame;
  frame.begin = begin;  // may throw: then the queue is as it was
  if (begin.preview) return push_preview(std::move(frame));
  retire_frame();
  end_previews();
  min_revision_ = begin.tag.revision;
  frame_ = std::move(frame);
}

void OutboundQueue::push_preview(Frame preview) {
  std::list<Frame> newest;
  newest.push_back(std::move(preview));  // may throw, as above
  retire_frame();
  if (!previews_.empty() && !previews_.back().begun) {
    drop_tiles(previews_.back());
    previews_.pop_back();
  }
  end_previews();
  previews_.splice(previews_.end(), newest);
}

void OutboundQueue::end_previews() {
  for (Frame& preview : previews_) {
    if (preview.end) continue;
    preview.end.emplace().tag = preview.begin.tag;
    preview.end->progress.tag = preview.begin.tag;
    preview.end->reason = FrameEndReason::failed;
  }
}

OutboundQueue::Frame* OutboundQueue::frame_of(const FrameTag& tag) {
  for (Frame& preview : previews_) {
    if (preview.begin.tag.same_frame(tag)) return preview.end ? nullptr : &preview;
  }
  const bool current = frame_ && frame_->begin.tag.same_frame(tag) && !frame_->ended;
  return current && tag.revision >= min_revision_ ? &*frame_ : nullptr;
}

void OutboundQueue::push(const FrameProgress& progress) {
  const std::lock_guard lock(mutex_);
  Frame* frame = frame_of(progress.tag);
  if (frame && !frame->end) frame->progress = progress;
}

void OutboundQueue::push(EncodedTile tile) {
  const std::lock_guard lock(mutex_);
  Frame* frame = frame_of(tile.tag);
  if (!frame) return;
  const Corner corner{tile.window.x0, tile.window.y0};
  const std::size_t bytes = tile.bytes.size();
  if (const auto place = frame->places.find(corner); place != frame->places.end()) {
    bytes_ -= place->second->bytes.size();
    note_dropped(*frame, 1);
    *place->second = std::move(tile);
  } else {
    const auto at = frame->tiles.insert(frame->tiles.end(), std::move(tile));
    try {
      frame->places[corner] = at;
    } catch (...) {
      frame->tiles.erase(at);
      throw;
    }
  }
  bytes_ += bytes;
  peak_bytes_ = std::max(peak_bytes_, bytes_);
}

void OutboundQueue::push(const FrameEnd& end, std::string replay_token) {
  const std::lock_guard lock(mutex_);
  Frame* frame = nullptr;
  for (Frame& preview : previews_) {
    if (preview.begin.tag.same_frame(end.tag)) frame = &preview;
  }
  if (frame_ && frame_->begin.tag.same_frame(end.tag)) frame = &*frame_;  // of whatever revision
  if (!frame || frame->ended) return;
  frame->end = end;
  frame->replay_token = std::move(replay_token);
  frame->progress.reset();  // the end says it all
}

void OutboundQueue::drop_before(std::uint64_t revision) {
  const std::lock_guard lock(mutex_);
  min_revision_ = std::max(min_revision_, revision);
  if (!frame_ || frame_->begin.tag.revision >= min_revision_) return;
  drop_tiles(*frame_);
  frame_->progress.reset();
  if (!frame_->begun) frame_.reset();
}

bool OutboundQueue::wants(const FrameTag& tag) const {
  const std::lock_guard lock(mutex_);
  return frame_of(tag) != nullptr;
}

bool OutboundQueue::variance_due(const FrameTag& tag, Corner corner, int every) const {
  const std::lock_guard lock(mutex_);
  const Frame* frame = frame_of(tag);
  if (!frame) return true;
  const auto since = frame->since_variance.find(corner);
  return since == frame->since_variance.end() || since->second + 1 >= every;
}

void OutboundQueue::limit_credit(std::uint32_t tiles) {
  const std::lock_guard lock(mutex_);
  credit_ = tiles;
}

bool OutboundQueue::add_credit(std::uint32_t tiles) {
  const std::lock_guard lock(mutex_);
  if (!credit_) return false;
  *credit_ += tiles;
  return true;
}

void OutboundQueue::limit_rate(std::optional<double> bytes_per_second) {
  const std::lock_guard lock(mutex_);
  rate_ = bytes_per_second;
  rate_free_s_ = 0;
}

OutboundQueue::Next OutboundQueue::pop(double now_s) {
  const std::lock_guard lock(mutex_);
  if (greeting_) {
    Next next{std::move(*greeting_)};
    greeting_.reset();
    return next;
  }
  if (!notices_.empty()) return {std::move(notices_.extract(notices_.begin()).mapped())};
  if (previous_end_) {
    Next next{std::move(*previous_end_)};
    previous_end_.reset();
    return next;
  }
  if (!previews_.empty()) {
    Next next = pop(previews_.front(), now_s);
    if (previews_.front().ended) previews_.pop_front();
    return next;
  }
  return frame_ ? pop(*frame_, now_s) : Next();
}

OutboundQueue::Next OutboundQueue::pop(Frame& frame, double now_s) {
  if (!frame.begun) {
    frame.begun = true;
    return {frame.begin};
  }
  if (frame.progress) {
    Next next{*frame.progress};
    frame.progress.reset();
    return next;
  }
  if (!frame.tiles.empty()) return pop_tile(frame, now_s);
  if (frame.end && !frame.ended) {
    frame.ended = true;
    return {frame.report()};
  }
  return {};
}

OutboundQueue::Next OutboundQueue::pop_tile(Frame& frame, double now_s) {
  if (credit_ && *credit_ == 0) return {};
  if (rate_ && now_s < rate_free_s_) return {std::nullopt, rate_free_s_};
  const Corner corner{frame.tiles.front().window.x0, frame.tiles.front().window.y0};
  const auto [place, first] = frame.since_variance.try_emplace(corner, 0);  // may throw: then the tile waits on
  int& since_variance = place->second;
  EncodedTile tile = std::move(frame.tiles.front());
  tile.changed_s = first ? frame.begin.changed_s : 0;
  since_variance = tile.variance ? 0 : since_variance + 1;
  frame.places.erase(corner);
  frame.tiles.pop_front();
  bytes_ -= tile.bytes.size();
  frame.bytes_sent += tile.bytes.size();
  if (credit_) --*credit_;
  if (rate_) rate_free_s_ = std::max(rate_free_s_, now_s - kRateBurst) + double(tile.bytes.size()) / *rate_;
  return {std::move(tile)};
}

bool OutboundQueue::empty() const {
  const std::lock_guard lock(mutex_);
  return !greeting_ && notices_.empty() && !previous_end_ && previews_.empty() &&
         (!frame_ || (frame_->begun && !frame_->progress && frame_->tiles.empty() && (!frame_->end || frame_->ended)));
}

void OutboundQueue::close() {
  const std::lock_guard lock(mutex_);
  closed_ = true;
  greeting_.reset();
  notices_.clear();
  previous_end_.reset();
  previews_.clear();
  frame_.reset();
  bytes_ = 0;
}

std::size_t OutboundQueue::tiles() const {
  const std::lock_guard lock(mutex_);
  return frame_ ? frame_->tiles.size() : 0;
}

std::uint64_t OutboundQueue::bytes() const {
  const std::lock_guard lock(mutex_);
  return bytes_;
}

std::uint64_t OutboundQueue::peak_bytes() const {
  const std::lock_guard lock(mutex_);
  return peak_bytes_;
}

void OutboundQueue::note_dropped(Frame& frame, std::size_t tiles) {
  frame.dropped += tiles;
  if (counters_) counters_->superseded_tiles.add(tiles);
}

void OutboundQueue::drop_tiles(Frame& frame) {
  note_dropped(frame, frame.tiles.size());
  for (const EncodedTile& tile : frame.tiles) bytes_ -= tile.bytes.size();
  frame.tiles.clear();
  frame.places.clear();
}

void OutboundQueue::retire_frame() {
  if (!frame_) return;
  drop_tiles(*frame_);
  if (frame_->begun && frame_->end && !frame_->ended) {
    previous_end_ = frame_->report();
  }
  frame_.reset();
}

}  // namespace helio
