#include "server/rpc/read_deadline.h"

#include <utility>

#include "renderer/base/clock.h"

namespace helio {

ReadDeadline::ReadDeadline(TimerQueue& timers, double seconds, std::function<void()> expired)
    : timers_(timers),
      seconds_(seconds),
      expired_(std::make_shared<const std::function<void()>>(std::move(expired))) {}

ReadDeadline::~ReadDeadline() {
  stop();
}

void ReadDeadline::start() {
  decided_ = std::make_shared<std::atomic<bool>>(false);
  timer_ = timers_.call_at(now_s() + seconds_, [decided = decided_, expired = expired_] {
    if (decided->exchange(true)) return;
    try {
      (*expired)();
    } catch (...) {
      decided->store(false);  // the queue calls again
      throw;
    }
  });
}

bool ReadDeadline::stop() {
  if (!decided_) return true;
  const bool in_time = !decided_->exchange(true);
  if (in_time) {
    timers_.cancel(timer_);
    decided_ = nullptr;
  }
  return in_time;
}

}  // namespace helio
