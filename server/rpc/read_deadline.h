// Ends a call whose client does not send the message that is due, so that idle peers hold nothing for ever.
#pragma once

#include <atomic>
#include <functional>
#include <memory>

#include "server/base/timer_queue.h"

namespace helio {

// start() and stop() are called by one thread at a time.
class ReadDeadline {
 public:
  // `expired` is called at most once, on the timers' thread, maybe after this is gone: it owns what it uses, or holds
  // it by weak_ptr.
  ReadDeadline(TimerQueue& timers, double seconds, std::function<void()> expired);
  ~ReadDeadline();
  ReadDeadline(const ReadDeadline&) = delete;
  ReadDeadline& operator=(const ReadDeadline&) = delete;

  // The message is due `seconds` from now.
  void start();
  // It has come. False: too late, `expired` has been called or is being called.
  bool stop();

 private:
  TimerQueue& timers_;
  const double seconds_;
  const std::shared_ptr<const std::function<void()>> expired_;
  std::shared_ptr<std::atomic<bool>> decided_;  // by stop() or by the timer, whichever is first; null: not started
  TimerQueue::Id timer_;
};

}  // namespace helio
