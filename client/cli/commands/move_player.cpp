#include "client/cli/commands/move_player.h"

#include <google/protobuf/util/message_differencer.h>
#include <spdlog/fmt/fmt.h>

#include "client/cli/tev_option.h"
#include "renderer/base/clock.h"

namespace helio::cli {

namespace pb = heliograph::v1;

ReattachOptions reattach_options(double patience_s, Terminal& terminal) {
  ReattachOptions options;
  options.patience_s = patience_s;
  options.lost = [&terminal, patience_s](const Status& why) {
    terminal.end_progress();
    terminal.warn(fmt::format("{}: reconnecting, for {:g} s at most", why.error().to_string(), patience_s));
  };
  options.back = [&terminal] { terminal.say("notice: connected again; the session goes on"); };
  return options;
}

MovePlayer::MovePlayer(RenderClient& client, const std::string& session_id, const pb::TileFormat& format,
                       const pb::Budget& budget, double patience_s, Terminal& terminal, TevBridge* tev)
    : terminal_(terminal), tev_(tev), default_budget_(budget), budget_(budget) {
  pb::StreamRequest::Open open;
  open.set_session_id(session_id);
  *open.mutable_format() = format;
  stream_ = std::make_unique<SessionStream>(client, open, callbacks(), reattach_options(patience_s, terminal));
}

MovePlayer::~MovePlayer() {
  stream_.reset();
}

FrameCallbacks MovePlayer::callbacks() {
  FrameCallbacks callbacks;
  callbacks.frame_begin = [this](const pb::FrameBegin& frame) {
    std::lock_guard lock(mutex_);
    if (frame.preview()) preview_frame_ = frame.tag().frame();
    if (done_ || frame.preview() || frame.tag().view_id() != view_id_) return;
    const Status begun = current_.picture.begin(frame);
    if (!begun) fail(begun.error());
    if (const Status shown = tev_ ? tev_->begin(frame.settings()) : ok_status(); !shown) fail(shown.error());
    current_.unsampled.assign(frame.unsampled().begin(), frame.unsampled().end());
    current_.notices.assign(frame.notices().begin(), frame.notices().end());
  };
  callbacks.tile = [this](pb::Tile tile) {
    std::lock_guard lock(mutex_);
    if (done_ || tile.preview() || tile.tag().view_id() != view_id_) return;
    if (current_.first_tile_seconds == 0) current_.first_tile_seconds = now_s() - sent_s_;
    const auto added = add_and_show(current_.picture, std::move(tile), tev_);
    if (!added) fail(added.error());
  };
  callbacks.frame_end = [this](const pb::FrameEnd& end) {
    std::lock_guard lock(mutex_);
    if (done_ || end.tag().view_id() != view_id_ || end.tag().frame() == preview_frame_ ||
        end.reason() == pb::END_REASON_SUPERSEDED)
      return;
    current_.end = end;
    done_ = true;
    changed_.notify_all();
  };
  callbacks.progress = [this](const pb::Progress& progress) {
    std::lock_guard lock(mutex_);
    if (!done_ && progress.tag().view_id() == view_id_) {
      terminal_.progress(fmt::format("view {}: {}", view_id_ - 1, describe(progress)));
    }
  };
  callbacks.notice = [this](const pb::Notice& notice) {
    std::lock_guard lock(mutex_);
    notices_.push_back(single_line(notice.text()));
  };
  callbacks.ended = [this](const Status& status) {
    std::lock_guard lock(mutex_);
    fail(status ? Error{ErrorCode::unavailable, "the server closed the stream", {}} : status.error());
  };
  return callbacks;
}

void MovePlayer::fail(const Error& error) {
  if (!failure_) failure_ = error;
  done_ = true;
  changed_.notify_all();
}

Status MovePlayer::send(const PathView& view, double time_s) {
  const pb::Budget& budget = view.budget ? *view.budget : default_budget_;
  if (!google::protobuf::util::MessageDifferencer::Equals(budget, budget_)) {
    Status sent = stream_->send_budget(budget);
    if (!sent) return sent;
    budget_ = budget;
  }
  pb::View message;
  {
    std::lock_guard lock(mutex_);
    if (failure_) return *failure_;
    current_ = {};
    done_ = false;
    sent_s_ = now_s();
    message.set_id(++view_id_);
  }
  *message.mutable_camera() = view.camera;
  if (view.gaze) *message.mutable_gaze() = *view.gaze;
  message.set_time_s(time_s);
  return stream_->send_view(message);
}

Status MovePlayer::await(PlayedView& view) {
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [this] { return done_; });
  terminal_.end_progress();
  for (const std::string& notice : notices_) terminal_.warn(notice);
  notices_.clear();
  view = std::move(current_);
  current_ = {};
  if (failure_ && !view.end) return *failure_;
  return ok_status();
}

Status MovePlayer::close() {
  Status sent = stream_->close(true);
  if (!sent) return sent;
  return stream_->wait();
}

void MovePlayer::cancel() {
  std::lock_guard lock(mutex_);
  fail({ErrorCode::cancelled, "cancelled", {}});
}

}  // namespace helio::cli
