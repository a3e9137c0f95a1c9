// A thread that works through a bounded queue: loads, edits and replays take too long for gRPC's threads.
#pragma once

#include <condition_variable>
#include <cstddef>
#include <deque>
#include <functional>
#include <mutex>
#include <thread>

namespace helio {

class TaskThread {
 public:
  explicit TaskThread(std::size_t max_waiting);
  ~TaskThread();  // waits for the task in hand; those still waiting are destroyed without being called

  // False when max_waiting tasks wait already or the thread was stopped.
  bool submit(std::function<void()> task);
  // Refuses further tasks and destroys those that wait.
  void stop();
  bool busy() const;

 private:
  void run();

  const std::size_t max_waiting_;
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<std::function<void()>> waiting_;
  bool stopping_ = false, busy_ = false;
  std::thread thread_;
};

}  // namespace helio
