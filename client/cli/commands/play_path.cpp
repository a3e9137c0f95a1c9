#include "client/cli/commands/play_path.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <limits>
#include <memory>
#include <mutex>
#include <optional>

#include "client/cli/tev_option.h"
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

void ShownPictures::tile(std::uint64_t view, bool preview, const PixelRect& window, double now_s) {
  Arrival& arrival = (preview ? previews_ : films_)[view];
  if (arrival.first_s == 0) arrival.first_s = now_s;
  if (arrival.whole_s != 0 || !arrival.corners.emplace(window.x0, window.y0).second) return;
  arrival.pixels += window.area();
  if (arrival.pixels >= whole_) arrival.whole_s = now_s;
}

Json ShownPictures::report(double rate, double end_s) const {
  if (sent_.size() < 2) return {};
  const std::uint64_t first = sent_.begin()->first, last = sent_.rbegin()->first;
  std::uint64_t views = 0, with_a_tile = 0, whole = 0, shown = 0;
  std::vector<double> ages;
  for (const auto& [view, sent_s] : sent_) {
    if (view == first) continue;
    ++views;
    double whole_s = 0;
    for (const auto* kind : {&previews_, &films_}) {
      const auto found = kind->find(view);
      if (found == kind->end() || found->second.whole_s == 0) continue;
      whole_s = whole_s == 0 ? found->second.whole_s : std::min(whole_s, found->second.whole_s);
    }
    with_a_tile += previews_.contains(view) || films_.contains(view);
    if (whole_s == 0) continue;
    ++shown;
    if (whole_s > end_s) continue;
    ++whole;
    ages.push_back(whole_s - sent_s);
  }
  const auto after_last = [&](const std::map<std::uint64_t, Arrival>& kind, double Arrival::* moment) {
    const auto found = kind.find(last);
    const bool there = found != kind.end() && found->second.*moment > 0;
    return there ? std::optional<double>(found->second.*moment - sent_.at(last)) : std::nullopt;
  };
  Json json;
  json["views"] = views;
  json["views_with_a_tile"] = with_a_tile;
  json["whole_pictures"] = whole;
  json["whole_share"] = double(whole) / double(views);
  json["whole_per_second"] = rate * double(whole) / double(views);
  json["skipped_views"] = views - shown;
  json["previews"] = previews_.size();
  json["age_p50_ms"] = milliseconds(quantile(ages, 0.5));
  json["age_p95_ms"] = milliseconds(quantile(ages, 0.95));
  json["last_preview_whole_ms"] = milliseconds(after_last(previews_, &Arrival::whole_s));
  json["last_film_first_tile_ms"] = milliseconds(after_last(films_, &Arrival::first_s));
  json["last_film_whole_ms"] = milliseconds(after_last(films_, &Arrival::whole_s));
  return json;
}

std::string describe_shown(const Json& shown) {
  const auto ms = [&](const char* name) {
    return shown[name].is_null() ? std::string("none") : fmt::format("{:.0f} ms", shown[name].get<double>());
  };
  return fmt::format(
      "{} views: {} whole pictures while moving, {:.1f} a second; {} views skipped; age of what was shown: median {}, "
      "95 % {}\nafter the last view: preview {}, first tile of the film {}, whole film {}",
      shown["views"].get<std::uint64_t>(), shown["whole_pictures"].get<std::uint64_t>(),
      shown["whole_per_second"].get<double>(), shown["skipped_views"].get<std::uint64_t>(), ms("age_p50_ms"),
      ms("age_p95_ms"), ms("last_preview_whole_ms"), ms("last_film_first_tile_ms"), ms("last_film_whole_ms"));
}

namespace {

class PathPlayer {
 public:
  PathPlayer(RenderClient& client, const std::string& session_id, const pb::TileFormat& format,
             const RealTimePlay& play, Terminal& terminal, TevBridge* tev)
      : play_(play), terminal_(terminal), tev_(tev), shown_(play.pixels) {
    pb::StreamRequest::Open open;
    open.set_session_id(session_id);
    *open.mutable_format() = format;
    stream_ = std::make_unique<SessionStream>(client, open, callbacks(), reattach_options(play.patience_s, terminal));
  }
  ~PathPlayer() { stream_.reset(); }
  PathPlayer(const PathPlayer&) = delete;
  PathPlayer& operator=(const PathPlayer&) = delete;

  Status send(const PathView& view) {
    pb::View message;
    {
      const std::lock_guard lock(mutex_);
      if (failure_) return *failure_;
      message.set_id(++view_);
      film_ = {};
      ended_ = false;
      shown_.sent(view_, sent_s_ = now_s());
    }
    *message.mutable_camera() = view.camera;
  if (view.gaze) *message.mutable_gaze() = *view.gaze;
    message.set_time_s(play_.time_s);
    return stream_->send_view(message);
  }

  // Until `at_s` on the now_s() clock.
  Status wait_until(double at_s, const Interrupt& interrupt) { return wait(at_s, false, interrupt); }
  // Until the film of the newest view has come to its end.
  Status wait_for_film(const Interrupt& interrupt) {
    return wait(std::numeric_limits<double>::infinity(), true, interrupt);
  }
  Status close() {
    if (const Status sent = stream_->close(true); !sent) return sent;
    return stream_->wait();
  }

  Json report(double end_s) {
    const std::lock_guard lock(mutex_);
    return shown_.report(play_.rate, end_s);
  }
  PlayedView take_film() {
    const std::lock_guard lock(mutex_);
    return std::move(film_);
  }

 private:
  Status wait(double at_s, bool for_film, const Interrupt& interrupt) {
    std::unique_lock lock(mutex_);
    while (!failure_ && !(for_film && ended_) && !interrupt.raised()) {
      const double left_s = at_s - now_s();
      if (left_s <= 0) break;
      changed_.wait_for(lock, std::chrono::duration<double>(std::min(left_s, kPatience)));
    }
    for (const std::string& notice : notices_) terminal_.warn(notice);
    notices_.clear();
    if (failure_) return *failure_;
    if (interrupt.raised()) return Error{ErrorCode::cancelled, "cancelled", {}};
    return ok_status();
  }

  FrameCallbacks callbacks() {
    FrameCallbacks callbacks;
    callbacks.frame_begin = [this](const pb::FrameBegin& frame) {
      const std::lock_guard lock(mutex_);
      if (frame.preview()) preview_frame_ = frame.tag().frame();
      if (frame.preview() || frame.tag().view_id() != view_) return;
      if (const Status begun = film_.picture.begin(frame); !begun) fail(begun.error());
      if (const Status shown = tev_ ? tev_->begin(frame.settings()) : ok_status(); !shown) fail(shown.error());
      film_.unsampled.assign(frame.unsampled().begin(), frame.unsampled().end());
      film_.notices.assign(frame.notices().begin(), frame.notices().end());
    };
    callbacks.tile = [this](pb::Tile tile) {
      const std::lock_guard lock(mutex_);
      const pb::Rect& w = tile.window();
      const double now = now_s();
      shown_.tile(tile.tag().view_id(), tile.preview(), {w.x0(), w.y0(), w.x1(), w.y1()}, now);
      if (tile.preview() || tile.tag().view_id() != view_) return;
      if (film_.first_tile_seconds == 0) film_.first_tile_seconds = now - sent_s_;
      if (const auto added = add_and_show(film_.picture, std::move(tile), tev_); !added) fail(added.error());
    };
    callbacks.frame_end = [this](const pb::FrameEnd& end) {
      const std::lock_guard lock(mutex_);
      if (end.tag().frame() == preview_frame_ || end.reason() == pb::END_REASON_SUPERSEDED) return;
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
  TevBridge* const tev_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::uint64_t view_ = 0, preview_frame_ = 0;  // the newest view | frame that is a preview
  double sent_s_ = 0;                           // the newest view
  ShownPictures shown_;
  PlayedView film_;     // of the newest view
  bool ended_ = false;  // its film
  std::vector<std::string> notices_;
  std::optional<Error> failure_;
  std::unique_ptr<SessionStream> stream_;  // last: its callbacks use what is above
};

Status play_views(PathPlayer& player, const std::vector<PathView>& views, const RealTimePlay& play,
                  const Interrupt& interrupt) {
  if (const Status sent = player.send(views.front()); !sent) return sent;
  if (const Status rested = player.wait_until(now_s() + play.rest_s, interrupt); !rested) return rested;
  const double begun_s = now_s();
  for (std::size_t i = 1; i < views.size(); ++i) {
    if (const Status due = player.wait_until(begun_s + double(i - 1) / play.rate, interrupt); !due) return due;
    if (const Status sent = player.send(views[i]); !sent) return sent;
  }
  return ok_status();
}

}  // namespace

Status play_in_real_time(RenderClient& client, const std::string& session_id, const pb::TileFormat& format,
                         const std::vector<PathView>& views, const RealTimePlay& play, const Interrupt& interrupt,
                         Terminal& terminal, TevBridge* tev, Json& shown, PlayedView& last) {
  PathPlayer player(client, session_id, format, play, terminal, tev);
  Status played = play_views(player, views, play, interrupt);
  const double end_s = now_s() + 1 / play.rate;
  if (played) played = player.wait_for_film(interrupt);
  terminal.end_progress();
  shown = player.report(end_s);
  last = player.take_film();
  return played ? player.close() : played;
}

}  // namespace helio::cli
