#include "server/timer_queue.h"

#include <chrono>

#include "renderer/base/clock.h"

namespace helio {

TimerQueue::TimerQueue() : thread_([this] { run(); }) {}

TimerQueue::~TimerQueue() {
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
  }
  changed_.notify_one();
  thread_.join();
}

TimerQueue::Id TimerQueue::call_at(double at_s, std::function<void()> function) {
  const std::lock_guard lock(mutex_);
  const Id id{at_s, ++calls_};
  const auto added = waiting_.emplace(id, std::move(function)).first;
  if (added == waiting_.begin()) changed_.notify_one();
  return id;
}

void TimerQueue::cancel(const Id& id) {
  std::function<void()> dropped;  // destroyed outside the lock
  const std::lock_guard lock(mutex_);
  const auto found = waiting_.find(id);
  if (found == waiting_.end()) return;
  dropped = std::move(found->second);
  waiting_.erase(found);
}

void TimerQueue::run() {
  std::unique_lock lock(mutex_);
  while (!stopping_) {
    if (waiting_.empty()) {
      changed_.wait(lock);
      continue;
    }
    const double left = waiting_.begin()->first.at_s - now_s();
    if (left > 0) {
      changed_.wait_for(lock, std::chrono::duration<double>(left));
      continue;
    }
    auto due = waiting_.extract(waiting_.begin());
    lock.unlock();
    due.mapped()();
    due = {};
    lock.lock();
  }
}

}  // namespace helio
