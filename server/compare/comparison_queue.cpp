#include "server/compare/comparison_queue.h"

#include <spdlog/fmt/fmt.h>

#include <chrono>
#include <utility>

#include "renderer/base/clock.h"
#include "server/base/retry.h"

namespace helio {

Status ComparisonQueue::submit(std::shared_ptr<CancelToken> cancel, std::function<void()> run) {
  {
    const std::lock_guard lock(mutex_);
    there_.insert(cancel);
  }
  // Destroyed with the task, whether or not it was called.
  const std::shared_ptr<void> place(nullptr, [this, cancel](void*) {
    const std::lock_guard lock(mutex_);
    there_.erase(cancel);
    over_.notify_all();
  });
  if (thread_.submit([run = std::move(run), place] { run(); })) return ok_status();
  return Error{
      ErrorCode::resource_exhausted, fmt::format("max_comparisons: {} wait already", max_waiting_), {}, kRetrySeconds};
}

void ComparisonQueue::cancel_all() {
  const std::lock_guard lock(mutex_);
  for (const auto& cancel : there_) cancel->cancel();
}

std::size_t ComparisonQueue::size() {
  const std::lock_guard lock(mutex_);
  return there_.size();
}

bool ComparisonQueue::wait_until_empty(double deadline_s) {
  std::unique_lock lock(mutex_);
  return over_.wait_for(lock, std::chrono::duration<double>(std::max(0.0, deadline_s - now_s())),
                        [&] { return there_.empty(); });
}

}  // namespace helio
