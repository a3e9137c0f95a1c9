// Threads that work through a bounded queue: loads, edits, replays and films take too long for gRPC's threads.
#pragma once

#include <condition_variable>
#include <cstddef>
#include <deque>
#include <functional>
#include <mutex>
#include <thread>
#include <vector>

namespace helio {

class TaskThread {
 public:
  explicit TaskThread(std::size_t max_waiting, int threads = 1);
  ~TaskThread();  // waits for the tasks in hand; those still waiting are destroyed without being called

  // False when max_waiting tasks wait already or the threads were stopped. What a task throws is logged.
  bool submit(std::function<void()> task);
  // Refuses further tasks and destroys those that wait.
  void stop();
  bool busy() const;
  std::size_t waiting() const;  // tasks that none has in hand

 private:
  void run();

  const std::size_t max_waiting_;
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<std::function<void()>> waiting_;
  bool stopping_ = false;
  int busy_ = 0;  // tasks in hand
  std::vector<std::thread> threads_;
};

}  // namespace helio
