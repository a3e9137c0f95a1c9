#include "server/stream/outbound_stream.h"

#include <variant>

#include "renderer/base/clock.h"
#include "server/base/grpc_status.h"

namespace helio {

void OutboundStream::kick() {
  const std::lock_guard lock(mutex_);
  advance();
}

void OutboundStream::advance() noexcept {
  try {
    send_next();
  } catch (...) {
    // The message in hand is lost, and the client would wait for it; it can attach again.
    end_ = out_of_memory();
    queue_.close();
    if (!writing_ && !finished_) {
      finished_ = true;
      call_->finish(*end_);
    }
  }
}

void OutboundStream::set_end(const grpc::Status& status) noexcept {
  if (!end_) end_ = copy_status(status);
}

void OutboundStream::send_next() {
  while (!writing_ && !finished_) {
    const double now = now_s();
    OutboundQueue::Next next = queue_.pop(now);
    if (next.message) {
      is_tile_ = std::holds_alternative<EncodedTile>(*next.message);
      note_age(*next.message, now);
      message_ = encoder_(std::move(*next.message));
      if (!message_.Valid()) continue;
      writing_ = true;
      call_->start_write(&message_);
      return;
    }
    if (end_ && queue_.empty()) {
      finished_ = true;
      call_->finish(*end_);
      return;
    }
    if (next.wait_until_s > 0) wake_at(next.wait_until_s);
    return;
  }
}

void OutboundStream::note_age(const Outbound& message, double now) {
  const auto* tile = std::get_if<EncodedTile>(&message);
  if (!counters_ || !tile || tile->changed_s == 0) return;
  (tile->preview ? counters_->preview_age : counters_->picture_age).observe(now - tile->changed_s);
}

void OutboundStream::wake_at(double at_s) {
  if (wake_at_s_ == at_s) return;
  timers_.call_at(at_s, [weak = weak_from_this()] {
    if (const auto stream = weak.lock()) stream->kick();
  });
  wake_at_s_ = at_s;
}

void OutboundStream::finish(const grpc::Status& status) {
  const std::lock_guard lock(mutex_);
  set_end(status);
  queue_.close();
  advance();
}

void OutboundStream::finish_when_drained(const grpc::Status& status) {
  const std::lock_guard lock(mutex_);
  set_end(status);
  advance();
}

bool OutboundStream::finished() const {
  const std::lock_guard lock(mutex_);
  return end_.has_value();
}

void OutboundStream::write_done(bool ok) {
  const std::lock_guard lock(mutex_);
  writing_ = false;
  if (ok && counters_) {
    counters_->bytes.add(message_.Length());
    if (is_tile_) counters_->tiles.add();
  }
  message_.Clear();
  if (!ok) {
    set_end({grpc::StatusCode::CANCELLED, "client is gone"});
    queue_.close();
  }
  advance();
}

}  // namespace helio
