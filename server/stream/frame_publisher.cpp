#include "server/stream/frame_publisher.h"

#include <spdlog/spdlog.h>

#include "renderer/base/clock.h"
#include "server/base/grpc_status.h"
#include "server/base/log_format.h"

namespace helio {

std::shared_ptr<OutboundStream> FramePublisher::attach(std::shared_ptr<OutboundStream> stream,
                                                       const TileFormat& format) {
  const std::lock_guard lock(mutex_);
  stream_.swap(stream);
  format_ = format;
  finish_after_.reset();
  if (in_flight()) {
    begin_->changed_s = 0;  // it may have been rendered for whoever listened before
    stream_->push(*begin_);
  }
  return stream;
}

bool FramePublisher::detach(const OutboundStream* stream) {
  const std::lock_guard lock(mutex_);
  if (stream_.get() != stream) return false;
  stream_.reset();
  return true;
}

std::shared_ptr<OutboundStream> FramePublisher::stream() const {
  const std::lock_guard lock(mutex_);
  return stream_;
}

bool FramePublisher::in_flight() const {
  return begin_ && !(end_ && begin_->tag.same_frame(end_->tag));
}

void FramePublisher::finish_after(std::uint64_t revision) {
  const std::lock_guard lock(mutex_);
  finish_after_ = revision;
  finish_status_ = grpc::Status::OK;
  if (stream_ && end_ && end_->tag.revision >= revision) stream_->finish_when_drained(finish_status_);
}

void FramePublisher::finish_cancelled(const grpc::Status& status, bool tell) {
  const std::lock_guard lock(mutex_);
  if (in_flight()) {  // its end is on the way
    finish_after_ = begin_->tag.revision;
    finish_status_ = status;
    return;
  }
  if (!stream_) return;
  const bool was_last = end_ && finish_after_ && end_->tag.revision >= *finish_after_;
  if (tell && !was_last) {
    over_ = true;
    FrameEnd end;
    end.reason = FrameEndReason::cancelled;
    FrameBegin begin;
    if (end_) {
      begin.tag = end_->tag;
      ++begin.tag.frame;
    }
    end.tag = begin.tag;
    stream_->push(begin);
    stream_->push(end);
  }
  stream_->finish_when_drained(status);
}

void FramePublisher::mute() {
  const std::lock_guard lock(mutex_);
  over_ = true;
  begin_.reset();
  preview_.reset();
}

std::optional<FrameEnd> FramePublisher::last_end() const {
  const std::lock_guard lock(mutex_);
  return end_;
}

void FramePublisher::forget_end() {
  const std::lock_guard lock(mutex_);
  end_.reset();
}

void FramePublisher::frame_begun(const FrameBegin& begin) {
  const std::lock_guard lock(mutex_);
  if (over_) return;
  std::optional<FrameBegin>& newest = begin.preview ? preview_ : begin_;
  try {
    newest = begin;
    if (!counters_) newest->changed_s = 0;
    if (stream_) stream_->push(*newest);
  } catch (...) {
    // Nothing of this frame can be told any more, not even that it failed; the client can attach again.
    newest.reset();
    if (stream_) stream_->finish(out_of_memory());
    throw;
  }
}

void FramePublisher::tile_ready(FrameTile tile) {
  std::shared_ptr<OutboundStream> stream;
  TileFormat format;
  int width = 0, height = 0;
  double exposure = 0;
  {
    const std::lock_guard lock(mutex_);
    std::optional<FrameBegin>& frame = tile.preview ? preview_ : begin_;
    if (!stream_ || !frame || (tiles_ == Tiles::final_only && !tile.final)) return;
    if (const double changed_s = std::exchange(frame->changed_s, 0); changed_s > 0)
      (tile.preview ? counters_->first_preview : counters_->first_tile).observe(now_s() - changed_s);
    stream = stream_;
    format = format_;
    width = frame->settings.width;
    height = frame->settings.height;
    exposure = frame->exposure;
  }
  if (!stream->queue().wants(tile.tag)) return;
  const bool variance =
      tile.final || tile.preview || format.variance_every <= 1 ||
      stream->queue().variance_due(tile.tag, {tile.pixels.window.x0, tile.pixels.window.y0}, format.variance_every);
  if (!variance) format.channels &= ~unsigned(kResolveVariance);
  auto encoded = encode(tile, width, height, format, exposure);
  if (!encoded) {
    spdlog::error("tile not sent revision={} x={} y={} error={}", tile.tag.revision, tile.pixels.window.x0,
                  tile.pixels.window.y0, logged(encoded.error().to_string()));
    return;
  }
  encoded->variance = variance;
  stream->push(std::move(*encoded));
}

void FramePublisher::frame_ended(const FrameEnd& end) {
  const std::lock_guard lock(mutex_);
  if (over_) return;
  if (preview_ && preview_->tag.same_frame(end.tag)) {
    preview_.reset();
    if (stream_) stream_->push(end);
    return;
  }
  end_ = end;
  end_->notice = notice_;
  if (!stream_) return;
  std::string token;
  if (make_token_ && begin_ && end.progress.trace.invalid() > 0) {
    token = make_token_(*begin_, end.progress.trace.first_invalid);
  }
  stream_->push(*end_, std::move(token));
  if (finish_after_ && end.tag.revision >= *finish_after_) stream_->finish_when_drained(finish_status_);
}

void FramePublisher::tell(const std::string& notice) {
  const std::lock_guard lock(mutex_);
  notice_ = notice;
  if (stream_ && !notice.empty()) stream_->push(Notice{NoticeSeverity::warning, notice});
}

std::size_t FramePublisher::backlog() const {
  const auto listening = stream();
  return listening ? listening->queue().tiles() : 0;
}

}  // namespace helio
