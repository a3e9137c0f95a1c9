#include "client/cli/commands/play_path.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <chrono>

#include "renderer/base/clock.h"

namespace helio::cli {

namespace pb = heliograph::v1;

namespace {

constexpr double kPatience = 0.05;  // seconds between two looks for an interrupt

Json milliseconds(std::optional<double> seconds) {
  return seconds ? Json(1e3 * *seconds) : Json();
}

std::optional<double> quantile(std::vector<double> values, double q) {
  if (values.empty()) return std::nullopt;
  std::sort(values.begin(), values.end());
  return values[std::size_t(q * double(values.size() - 1))];
}

}  // namespace

void ShownPictures::tile(std::uint64_t view, bool preview, std::uint32_t pass, std::int64_t pixels, double now) {
  Arrival& arrival = (preview ? previews_ : films_)[view];
  if (arrival.first == 0) arrival.first = now;
  if (pass != 0 || arrival.whole != 0) return;
  arrival.pixels += pixels;
  if (arrival.pixels >= whole_) arrival.whole = now;
}

Json ShownPictures::report(double seconds, double end) const {
  const std::uint64_t last = sent_.empty() ? 0 : sent_.rbegin()->first;
  std::uint64_t views = 0, with_a_tile = 0, whole = 0, shown = 0;
  std::vector<double> ages;
  for (const auto& [view, at] : sent_) {
    if (view < 2) continue;
    ++views;
    double when = 0;
    for (const auto* kind : {&previews_, &films_}) {
      const auto found = kind->find(view);
      if (found == kind->end()) continue;
      if (found->second.whole > 0 && (when == 0 || found->second.whole < when)) when = found->second.whole;
    }
    with_a_tile += previews_.count(view) + films_.count(view) > 0;
    if (when == 0) continue;
    ++shown;
    if (when > end) continue;
    ++whole;
    ages.push_back(when - at);
  }
  const auto after_last = [&](const std::map<std::uint64_t, Arrival>& kind, double Arrival::*what) {
    const auto found = kind.find(last);
    const bool there = found != kind.end() && found->second.*what > 0;
    return there ? std::optional<double>(found->second.*what - sent_.at(last)) : std::nullopt;
  };
  Json json;
  json["views"] = views;
  json["views_with_a_tile"] = with_a_tile;
  json["whole_pictures"] = whole;
  json["whole_share"] = views > 0 ? double(whole) / double(views) : 0.0;
  json["whole_per_second"] = seconds > 0 ? double(whole) / seconds : 0.0;
  json["skipped_views"] = views - shown;
  json["previews"] = previews_.size();
  json["age_p50_ms"] = milliseconds(quantile(ages, 0.5));
  json["age_p95_ms"] = milliseconds(quantile(ages, 0.95));
  json["last_preview_whole_ms"] = milliseconds(after_last(previews_, &Arrival::whole));
  json["last_film_first_tile_ms"] = milliseconds(after_last(films_, &Arrival::first));
  json["last_film_whole_ms"] = milliseconds(after_last(films_, &Arrival::whole));
  return json;
}

class PathPlayer {
 public:
  PathPlayer(RenderClient& client, const std::string& session_id, const pb::TileFormat& format,
             const RealTimePlay& play, Terminal& terminal)
      : play_(play), terminal_(terminal), shown_(play.pixels) {
    pb::StreamRequest::Open open;
    open.set_session_id(session_id);
    *open.mutable_format() = format;
    stream_ = client.stream_frames(open, callbacks());
  }
  ~PathPlayer() { stream_.reset(); }

  Status send(const PathView& view) {
    pb::View message;
    {
      const std::lock_guard lock(mutex_);
      if (failure_) return *failure_;
      message.set_id(++view_);
      film_ = {};
      ended_ = false;
      shown_.sent(view_, now_s());
    }
    *message.mutable_camera() = view.camera;
    message.set_time_s(play_.time_s);
    return stream_->send_view(message);
  }

  // Until `at` on the now_s() clock, or the end of the newest view's film where that is waited for.
  Status wait(double at, bool for_film, const Interrupt& interrupt) {
    std::unique_lock lock(mutex_);
    while (!failure_ && !(for_film && ended_) && now_s() < at && !interrupt.raised()) {
      changed_.wait_for(lock, std::chrono::duration<double>(std::min(at - now_s(), kPatience)));
    }
    for (const std::string& notice : notices_) terminal_.warn(notice);
    notices_.clear();
    if (failure_) return *failure_;
    if (interrupt.raised()) return Error{ErrorCode::cancelled, "cancelled", {}};
    return ok_status();
  }

  Status close() {
    if (const Status sent = stream_->close(true); !sent) return sent;
    return stream_->wait();
  }

  Json report(double seconds, double end) {
    const std::lock_guard lock(mutex_);
    return shown_.report(seconds, end);
  }
  PlayedView take_film() {
    const std::lock_guard lock(mutex_);
    return std::move(film_);
  }

 private:
  FrameCallbacks callbacks() {
    FrameCallbacks callbacks;
    callbacks.frame_begin = [this](const pb::FrameBegin& frame) {
      const std::lock_guard lock(mutex_);
      if (frame.preview() || frame.tag().view_id() != view_) return;
      if (const Status begun = film_.picture.begin(frame); !begun) fail(begun.error());
      film_.unsampled.assign(frame.unsampled().begin(), frame.unsampled().end());
      film_.notices.assign(frame.notices().begin(), frame.notices().end());
    };
    callbacks.tile = [this](pb::Tile tile) {
      const std::lock_guard lock(mutex_);
      const pb::Rect& w = tile.window();
      shown_.tile(tile.tag().view_id(), tile.preview(), tile.pass(),
                  std::int64_t(w.x1() - w.x0()) * (w.y1() - w.y0()), now_s());
      if (tile.preview() || tile.tag().view_id() != view_) return;
      if (const auto added = film_.picture.add(std::move(tile)); !added) fail(added.error());
    };
    callbacks.frame_end = [this](const pb::FrameEnd& end) {
      const std::lock_guard lock(mutex_);
      if (end.reason() == pb::END_REASON_PREVIEW || end.reason() == pb::END_REASON_SUPERSEDED) return;
      if (end.tag().view_id() != view_) return;
      film_.end = end;
      ended_ = true;
      changed_.notify_all();
    };
    callbacks.progress = [this](const pb::Progress& progress) {
      const std::lock_guard lock(mutex_);
      if (progress.tag().view_id() == view_) terminal_.progress(describe(progress));
    };
    callbacks.notice = [this](const pb::Notice& notice) {
      const std::lock_guard lock(mutex_);
      notices_.push_back(single_line(notice.text()));
    };
    callbacks.ended = [this](const Status& status) {
      const std::lock_guard lock(mutex_);
      fail(status ? Error{ErrorCode::unavailable, "the server closed the stream", {}} : status.error());
    };
    return callbacks;
  }

  void fail(const Error& error) {
    if (!failure_) failure_ = error;
    changed_.notify_all();
  }

  const RealTimePlay play_;
  Terminal& terminal_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::uint64_t view_ = 0;
  ShownPictures shown_;
  PlayedView film_;     // of the newest view
  bool ended_ = false;  // its film
  std::vector<std::string> notices_;
  std::optional<Error> failure_;
  std::unique_ptr<FrameStream> stream_;  // last: its callbacks use what is above
};

Status play_in_real_time(RenderClient& client, const std::string& session_id, const pb::TileFormat& format,
                         const std::vector<PathView>& views, const RealTimePlay& play, const Interrupt& interrupt,
                         Terminal& terminal, Json& json, PlayedView& last) {
  PathPlayer player(client, session_id, format, play, terminal);
  const auto all = [&]() -> Status {
    if (const Status sent = player.send(views.front()); !sent) return sent;
    if (const Status rested = player.wait(now_s() + play.rest_s, false, interrupt); !rested) return rested;
    const double begun = now_s();
    for (std::size_t i = 1; i < views.size(); ++i) {
      if (const Status due = player.wait(begun + double(i - 1) / play.rate, false, interrupt); !due) return due;
      if (const Status sent = player.send(views[i]); !sent) return sent;
    }
    const double end = now_s() + 1 / play.rate;
    const Status ended = player.wait(now_s() + 1e9, true, interrupt);
    terminal.end_progress();
    json = player.report(double(views.size() - 1) / play.rate, end);
    last = player.take_film();
    return ended ? player.close() : ended;
  };
  return all();
}

}  // namespace helio::cli
