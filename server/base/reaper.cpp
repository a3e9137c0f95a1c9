#include "server/base/reaper.h"

#include <malloc.h>

#include <chrono>
#include <utility>

namespace helio {
namespace {

// After the last item: buffers of the streams that ended with it are free by then, and a client that goes on to its
// next session has begun it.
constexpr std::chrono::milliseconds kTrimDelay(500);

}  // namespace

Reaper::Reaper() : thread_([this] { run(); }) {}

Reaper::~Reaper() {
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
  }
  changed_.notify_one();
  thread_.join();
}

void Reaper::take(Item* item) noexcept {
  const std::lock_guard lock(mutex_);
  item->next_ = std::exchange(waiting_, item);
  ++taken_;
  changed_.notify_one();
}

void Reaper::wait_until_idle() {
  std::unique_lock lock(mutex_);
  idle_.wait(lock, [this, taken = taken_] { return freed_ >= taken; });
}

void Reaper::run() {
  std::unique_lock lock(mutex_);
  bool freed = false;  // since memory was last given back to the system
  for (;;) {
    if (!waiting_) {
      const auto due = [this] { return waiting_ || stopping_; };
      if (!freed) {
        changed_.wait(lock, due);
      } else if (!changed_.wait_for(lock, kTrimDelay, due)) {
        // The allocator keeps small films' pages for the next one, which may never come.
        lock.unlock();
        malloc_trim(0);
        lock.lock();
        freed = false;
        continue;
      }
    }
    if (!waiting_) return;
    Item* item = std::exchange(waiting_, nullptr);
    const std::uint64_t taken = taken_;
    freed = true;
    lock.unlock();
    while (item) delete std::exchange(item, item->next_);
    lock.lock();
    freed_ = taken;
    idle_.notify_all();
  }
}

}  // namespace helio
