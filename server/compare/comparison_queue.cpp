#include "server/compare/comparison_queue.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <chrono>
#include <utility>

#include "renderer/base/clock.h"
#include "server/base/retry.h"

namespace helio {

ComparisonQueue::ComparisonQueue(std::size_t max_waiting) : max_waiting_(max_waiting), thread_([this] { work(); }) {}

ComparisonQueue::~ComparisonQueue() {
  std::deque<Entry> dropped;  // destroyed without the lock
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
    if (running_) running_->cancel();
    dropped.swap(waiting_);
    changed_.notify_all();
  }
  thread_.join();
}

Result<std::size_t> ComparisonQueue::submit(std::shared_ptr<CancelToken> cancel, std::function<void()> run) {
  const std::lock_guard lock(mutex_);
  if (waiting_.size() >= max_waiting_) {
    return Error{ErrorCode::resource_exhausted,
                 fmt::format("max_comparisons: {} wait already", max_waiting_),
                 {},
                 kRetrySeconds};
  }
  const std::size_t before = waiting_.size() + (running_ ? 1 : 0);
  waiting_.push_back({std::move(cancel), std::move(run)});
  changed_.notify_all();
  return before;
}

void ComparisonQueue::withdraw(const CancelToken& cancel) {
  Entry dropped;  // destroyed without the lock
  const std::lock_guard lock(mutex_);
  const auto found =
      std::find_if(waiting_.begin(), waiting_.end(), [&](const Entry& entry) { return entry.cancel.get() == &cancel; });
  if (found == waiting_.end()) return;
  dropped = std::move(*found);
  waiting_.erase(found);
  changed_.notify_all();
}

void ComparisonQueue::cancel_all() {
  const std::lock_guard lock(mutex_);
  if (running_) running_->cancel();
  for (const Entry& entry : waiting_) entry.cancel->cancel();
}

bool ComparisonQueue::wait_until_empty(double deadline_s) {
  std::unique_lock lock(mutex_);
  return changed_.wait_for(lock, std::chrono::duration<double>(std::max(0.0, deadline_s - now_s())),
                           [&] { return waiting_.empty() && !running_; });
}

std::size_t ComparisonQueue::waiting() {
  const std::lock_guard lock(mutex_);
  return waiting_.size();
}

bool ComparisonQueue::busy() {
  const std::lock_guard lock(mutex_);
  return running_ != nullptr || !waiting_.empty();
}

void ComparisonQueue::work() {
  std::unique_lock lock(mutex_);
  for (;;) {
    changed_.wait(lock, [this] { return stopping_ || !waiting_.empty(); });
    if (stopping_) return;
    Entry entry = std::move(waiting_.front());
    waiting_.pop_front();
    running_ = entry.cancel;
    lock.unlock();
    entry.run();
    entry = {};
    lock.lock();
    running_.reset();
    changed_.notify_all();
  }
}

}  // namespace helio
