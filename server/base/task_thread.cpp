#include "server/base/task_thread.h"

#include <spdlog/spdlog.h>

#include <exception>

namespace helio {

TaskThread::TaskThread(std::size_t max_waiting, int threads) : max_waiting_(max_waiting) {
  threads_.reserve(std::size_t(threads));
  for (int i = 0; i < threads; ++i) threads_.emplace_back([this] { run(); });
}

TaskThread::~TaskThread() {
  stop();
  for (std::thread& thread : threads_) thread.join();
}

bool TaskThread::submit(std::function<void()> task) {
  const std::lock_guard lock(mutex_);
  if (stopping_ || waiting_.size() >= max_waiting_) return false;
  waiting_.push_back(std::move(task));
  changed_.notify_one();
  return true;
}

void TaskThread::stop() {
  std::deque<std::function<void()>> dropped;  // destroyed outside the lock
  const std::lock_guard lock(mutex_);
  stopping_ = true;
  dropped.swap(waiting_);
  changed_.notify_all();
}

bool TaskThread::busy() const {
  const std::lock_guard lock(mutex_);
  return busy_ > 0;
}

std::size_t TaskThread::waiting() const {
  const std::lock_guard lock(mutex_);
  return waiting_.size();
}

void TaskThread::run() {
  std::unique_lock lock(mutex_);
  for (;;) {
    changed_.wait(lock, [this] { return stopping_ || !waiting_.empty(); });
    if (waiting_.empty()) return;
    std::function<void()> task = std::move(waiting_.front());
    waiting_.pop_front();
    ++busy_;
    lock.unlock();
    try {
      task();
    } catch (const std::exception& exception) {
      spdlog::error("a task failed: {}", exception.what());
    }
    task = nullptr;
    lock.lock();
    --busy_;
  }
}

}  // namespace helio
