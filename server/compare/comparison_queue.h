// Comparisons run one at a time, in the order in which they came: two at once would disturb each other.
#pragma once

#include <condition_variable>
#include <cstddef>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <thread>

#include "renderer/base/cancel.h"
#include "renderer/base/result.h"

namespace helio {

// Thread safe.
class ComparisonQueue {
 public:
  explicit ComparisonQueue(std::size_t max_waiting);
  ~ComparisonQueue();  // waits for the one that runs, which it cancels; those that wait are dropped

  // Calls `run` once those before are over; how many these are. It must return soon after the token is raised.
  // resource_exhausted, naming max_comparisons.
  Result<std::size_t> submit(std::shared_ptr<CancelToken> cancel, std::function<void()> run);
  // Drops the one with this token if it waits.
  void withdraw(const CancelToken& cancel);
  // Of the one that runs and of those that wait, which are then called one after the other.
  void cancel_all();
  // False when some are left at that time (now_s() clock).
  bool wait_until_empty(double deadline_s);
  bool busy();
  std::size_t waiting();

 private:
  struct Entry {
    std::shared_ptr<CancelToken> cancel;
    std::function<void()> run;
  };
  void work();

  const std::size_t max_waiting_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<Entry> waiting_;
  std::shared_ptr<CancelToken> running_;  // null: none
  bool stopping_ = false;
  std::thread thread_;
};

}  // namespace helio
