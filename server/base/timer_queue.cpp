#include "server/base/timer_queue.h"

#include <spdlog/spdlog.h>

#include <chrono>
#include <exception>
#include <new>
#include <utility>

#include "renderer/base/clock.h"

namespace helio {

TimerQueue::TimerQueue() : thread_([this] { run(); }) {}

TimerQueue::~TimerQueue() {
  stop();
}

void TimerQueue::stop() {
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
  }
  changed_.notify_one();
  if (thread_.joinable()) thread_.join();
  waiting_.clear();
}

TimerQueue::Id TimerQueue::call_at(double at_s, std::function<void()> function) {
  const std::lock_guard lock(mutex_);
  const Id id{at_s, ++calls_};
  if (stopping_) return id;
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
    bool again = false;
    try {
      due.mapped()();
    } catch (const std::bad_alloc&) {
      again = true;
    } catch (const std::exception& exception) {
      spdlog::error("timer: {}", exception.what());
    } catch (...) {
      spdlog::error("timer: unknown error");
    }
    if (!again) due = {};
    lock.lock();
    if (again) {
      due.key().at_s = now_s() + kAgainAfter;
      waiting_.insert(std::move(due));  // allocates nothing
    }
  }
}

}  // namespace helio
