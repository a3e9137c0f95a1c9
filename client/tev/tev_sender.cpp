#include "client/tev/tev_sender.h"

#include <pthread.h>
#include <signal.h>
#include <time.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <system_error>

#include "renderer/base/clock.h"

namespace helio {

namespace {

constexpr double kNever = std::numeric_limits<double>::infinity();
constexpr double kLastTry = 0.2;  // seconds that a try may take which begins after the end of the picture

double thread_seconds() {
  timespec time{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return double(time.tv_sec) + 1e-9 * double(time.tv_nsec);
}

std::string seconds(double s) {
  const double tenths = std::round(10 * s) / 10;
  std::string text = std::to_string(tenths);
  text.erase(text.find_last_not_of('0') + 1);
  if (text.back() == '.') text.pop_back();
  return text + " s";
}

}  // namespace

TevSender::TevSender(TevAddress address, std::function<void(const std::string&)> warn, const TevTiming& timing)
    : address_(std::move(address)), warn_(std::move(warn)), timing_(timing) {
  // Signals are for the other threads.
  sigset_t all, before;
  sigfillset(&all);
  pthread_sigmask(SIG_SETMASK, &all, &before);
  try {
    thread_ = std::thread([this] { run(); });
    pthread_setname_np(thread_.native_handle(), "tev");
  } catch (const std::system_error& error) {
    warn_once("nothing is sent to tev: " + std::string(error.what()));
  }
  pthread_sigmask(SIG_SETMASK, &before, nullptr);
}

TevSender::~TevSender() {
  finish();
}

Status TevSender::begin(const TevImage& image) {
  if (Status valid = check_tev_image(image); !valid) return valid;
  const std::lock_guard lock(mutex_);
  if (image == image_) return ok_status();
  image_ = image;
  created_ = false;
  tiles_.clear();
  unsent_ = 0;
  wake_.signal();
  return ok_status();
}

Status TevSender::update(const PixelRect& window, Pixels pixels) {
  const std::lock_guard lock(mutex_);
  if (image_.channels.empty()) return Error{ErrorCode::invalid_argument, "came before an image began", "tile"};
  if (window.empty() || intersect(window, {0, 0, image_.width, image_.height}) != window) {
    return Error{ErrorCode::invalid_argument,
                 "does not lie in the image of " + std::to_string(image_.width) + "x" + std::to_string(image_.height),
                 "tile"};
  }
  if (finishing_) return ok_status();
  const std::pair<int, int> corner(window.y0, window.x0);
  const auto known = tiles_.find(corner);
  if (known == tiles_.end() || known->second.window != window) {
    std::erase_if(tiles_, [&](const auto& entry) {
      const bool gone = !intersect(entry.second.window, window).empty();
      unsent_ -= gone && !entry.second.sent;
      return gone;
    });
  } else if (!known->second.sent) {
    --unsent_;
  }
  tiles_[corner] = {window, std::make_shared<const Pixels>(std::move(pixels)), false};
  if (++unsent_ == 1) wake_.signal();
  return ok_status();
}

void TevSender::finish() {
  {
    const std::lock_guard lock(mutex_);
    if (!finishing_) {
      finishing_ = true;
      finish_by_s_ = now_s() + timing_.finish_s;
    }
    wake_.signal();
  }
  if (thread_.joinable()) thread_.join();
}

TevReport TevSender::report() const {
  const std::lock_guard lock(mutex_);
  return report_;
}

void TevSender::warn_once(const std::string& text) {
  {
    const std::lock_guard lock(mutex_);
    if (std::exchange(warned_, true)) return;
    report_.warning = text;
  }
  if (warn_) warn_(text);
}

void TevSender::lose(const std::string& what) {
  bool finishing = false;
  {
    const std::lock_guard lock(mutex_);
    finishing = finishing_;
    created_ = false;
    for (auto& [corner, tile] : tiles_) tile.sent = false;
    unsent_ = tiles_.size();
    next_try_s_ = now_s() + timing_.retry_s;
  }
  warn_once("tev at " + address_.text + " " + what +
            (finishing ? "; it lacks the last state of the picture"
                       : "; rendering goes on, and tev is tried again every " + seconds(timing_.retry_s)));
}

bool TevSender::keep_waiting() const {
  const std::lock_guard lock(mutex_);
  return !finishing_ || now_s() < finish_by_s_;
}

bool TevSender::anything_to_send() const {
  return !image_.channels.empty() && (!created_ || unsent_ > 0);
}

void TevSender::connect() {
  const Status connected = socket_.connect(address_, [&](double waited_s) {
    const std::lock_guard lock(mutex_);
    return waited_s < (finishing_ ? std::min(kLastTry, timing_.connect_s) : timing_.connect_s) &&
           (!finishing_ || now_s() < finish_by_s_);
  });
  if (!connected) return lose("does not answer (" + connected.error().message + ")");
  borders_shown_ = false;
  const std::lock_guard lock(mutex_);
  ++report_.connections;
}

Status TevSender::send(std::string_view head, std::string_view rest) {
  const std::size_t bytes = head.size() + rest.size();
  const Status sent = socket_.send(head, rest, [&](double waited_s) {
    if (waited_s >= timing_.blocked_s) {
      warn_once("tev at " + address_.text + " has read nothing for " + seconds(timing_.blocked_s) +
                "; rendering goes on, and tev gets the newest state once it reads");
    }
    return keep_waiting();
  });
  const std::lock_guard lock(mutex_);
  if (sent) report_.bytes += bytes;
  report_.thread_seconds = thread_seconds();
  return sent;
}

Status TevSender::send_update() {
  next_update_s_ = now_s() + timing_.interval_s;
  TevImage image;
  bool create = false;
  std::vector<std::pair<int, int>> corners;
  {
    const std::lock_guard lock(mutex_);
    image = image_;
    create = !std::exchange(created_, true);
    for (const auto& [corner, tile] : tiles_) {
      if (!tile.sent) corners.push_back(corner);
    }
  }
  if (create) {
    borders_shown_ = false;
    if (Status sent = send(tev_create_image(image, !std::exchange(focused_, true)), {}); !sent) return sent;
  }
  std::vector<PixelRect> windows;
  for (const std::pair<int, int>& corner : corners) {
    Tile tile;
    {
      const std::lock_guard lock(mutex_);
      if (!created_) return ok_status();  // another image has begun
      const auto found = tiles_.find(corner);
      if (found == tiles_.end() || found->second.sent) continue;
      found->second.sent = true;
      --unsent_;
      tile = found->second;
    }
    const std::size_t floats = std::size_t(tile.window.area()) * image.channels.size();
    if (const Status read = (*tile.pixels)(planes_); !read || planes_.size() != floats) continue;
    const auto head = tev_update_image_head(image, tile.window);
    if (!head) continue;
    const std::string_view bytes(reinterpret_cast<const char*>(planes_.data()), floats * sizeof(float));
    if (Status sent = send(*head, bytes); !sent) return sent;
    windows.push_back(tile.window);
  }
  if (windows.empty()) return ok_status();
  if (Status sent = send(tev_draw_borders(image, windows), {}); !sent) return sent;
  borders_shown_ = true;
  const std::lock_guard lock(mutex_);
  ++report_.updates;
  report_.tiles += windows.size();
  return ok_status();
}

void TevSender::run() {
  bool last_try = false;
  for (;;) {
    bool to_send = false, finishing = false;
    double finish_by_s = 0;
    {
      const std::lock_guard lock(mutex_);
      to_send = anything_to_send();
      finishing = finishing_;
      finish_by_s = finish_by_s_;
      report_.thread_seconds = thread_seconds();
    }
    if (finishing && now_s() >= finish_by_s) break;
    if (!socket_.connected()) {
      if (finishing && (last_try || !to_send)) break;
      if (finishing || now_s() >= next_try_s_) {
        last_try = finishing;
        connect();
        continue;
      }
    }
    if (to_send && socket_.connected() && now_s() >= next_update_s_) {
      if (const Status sent = send_update(); !sent) lose("is gone (" + sent.error().message + ")");
      continue;
    }
    if (finishing && !to_send) break;
    double until_s = !socket_.connected() ? next_try_s_ : to_send ? next_update_s_ : kNever;
    if (finishing) until_s = std::min(until_s, finish_by_s);
    if (const Status waited = socket_.wait(wake_, until_s); !waited) lose("has closed the connection");
  }
  if (socket_.connected() && borders_shown_) {
    TevImage image;
    {
      const std::lock_guard lock(mutex_);
      image = image_;
    }
    static_cast<void>(send(tev_draw_borders(image, {}), {}));
  }
  socket_.close();
  const std::lock_guard lock(mutex_);
  report_.thread_seconds = thread_seconds();
}

}  // namespace helio
