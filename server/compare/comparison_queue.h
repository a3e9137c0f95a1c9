// Comparisons run one at a time, in the order in which they came: two at once would disturb each other.
#pragma once

#include <condition_variable>
#include <cstddef>
#include <functional>
#include <memory>
#include <mutex>
#include <set>

#include "renderer/base/cancel.h"
#include "renderer/base/result.h"
#include "server/base/task_thread.h"

namespace helio {

// Thread safe.
class ComparisonQueue {
 public:
  explicit ComparisonQueue(std::size_t max_waiting) : max_waiting_(max_waiting), thread_(max_waiting) {}

  // Calls `run` once those before are over. It must return soon after the token is raised. resource_exhausted, naming
  // max_comparisons.
  Status submit(std::shared_ptr<CancelToken> cancel, std::function<void()> run);
  // Of those that run or wait.
  void cancel_all();
  // False when some are left at that time (now_s() clock).
  bool wait_until_empty(double deadline_s);
  std::size_t size();  // of those
  bool busy() const { return thread_.busy(); }

 private:
  const std::size_t max_waiting_;
  std::mutex mutex_;
  std::condition_variable over_;
  std::set<std::shared_ptr<CancelToken>> there_;
  TaskThread thread_;  // destroyed first: its task uses what is above
};

}  // namespace helio
