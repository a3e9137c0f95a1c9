#include "renderer/frame/render_engine.h"

#include <oneapi/tbb/info.h>
#include <oneapi/tbb/task_arena.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>

#include "renderer/base/check.h"
#include "renderer/base/clock.h"
#include "renderer/frame/failure_reason.h"
#include "renderer/frame/thread_clock.h"

namespace helio {

// Of the machine, where both have work.
constexpr double kInteractiveShare = 8, kJobShare = 1;
// Seconds, which the clock's integers hold.
constexpr double kLongestWait = 3600;

struct RenderEngine::Impl::Arena {
  // Every slot is reserved for our own threads: none waits for a worker of oneTBB's pool, which is free for BVH builds.
  explicit Arena(int threads) : arena(threads, unsigned(threads)) { arena.initialize(); }
  tbb::task_arena arena;
};

RenderEngine::Impl::Impl(int threads) : queue_({kInteractiveShare, kJobShare}) {
  const int count = threads > 0 ? threads : tbb::info::default_concurrency();
  arena_ = std::make_unique<Arena>(count);
  workers_.reserve(std::size_t(count));
  thread_ids_.reserve(std::size_t(count));
  try {
    for (int i = 0; i < count; ++i) workers_.emplace_back([this] { work(); });
  } catch (...) {
    stop();
    throw;
  }
}

RenderEngine::Impl::~Impl() {
  stop();
}

void RenderEngine::Impl::stop() {
  {
    const std::lock_guard lock(mutex_);
    HELIO_DCHECK(clients_.empty());
    stop_ = true;
  }
  work_or_stop_.notify_all();
  for (std::thread& worker : workers_) worker.join();
}

FairQueue::Id RenderEngine::Impl::add(PieceSource& source, RenderRank rank, const std::string& owner) {
  const std::lock_guard lock(mutex_);
  const FairQueue::Id id = queue_.add(std::size_t(rank), owner);
  try {
    clients_[id].source = &source;
  } catch (...) {
    queue_.remove(id);
    throw;
  }
  return id;
}

void RenderEngine::Impl::remove(FairQueue::Id id) {
  std::unique_lock lock(mutex_);
  clients_.at(id).removing = true;
  queue_.set_ready(id, false);
  piece_finished_.wait(lock, [&] { return queue_.in_flight(id) == 0; });
  if (queue_.holder() == id) end_hold();
  queue_.remove(id);
  clients_.erase(id);
}

void RenderEngine::Impl::hold(FairQueue::Id id, double seconds) {
  {
    const std::lock_guard lock(mutex_);
    queue_.hold(id);
    hold_until_s_ = now_s() + seconds;
    first_wake_s_ = std::min(first_wake_s_, hold_until_s_);
  }
  work_or_stop_.notify_all();  // someone has to be awake when it ends
}

void RenderEngine::Impl::release(FairQueue::Id id) {
  const std::lock_guard lock(mutex_);
  if (queue_.holder() == id) end_hold();
}

void RenderEngine::Impl::end_hold() {
  queue_.hold(std::nullopt);
  hold_until_s_ = kNever;
  work_or_stop_.notify_all();
}

void RenderEngine::Impl::set_ready(FairQueue::Id id, Client& client) {
  if (client.removing) return;
  ++client.wakes;
  queue_.set_ready(id, true);
}

void RenderEngine::Impl::wake(FairQueue::Id id) {
  {
    const std::lock_guard lock(mutex_);
    set_ready(id, clients_.at(id));
  }
  work_or_stop_.notify_all();
}

void RenderEngine::Impl::wake_at(FairQueue::Id id, double at_s) {
  {
    const std::lock_guard lock(mutex_);
    clients_.at(id).wake_at_s = at_s;
    if (at_s >= first_wake_s_) return;
    first_wake_s_ = at_s;
  }
  work_or_stop_.notify_all();  // those who sleep too long
}

// Those whose time has come; with mutex_ held.
void RenderEngine::Impl::wake_due() {
  const double now = now_s();
  if (now < first_wake_s_) return;
  if (hold_until_s_ <= now) end_hold();
  first_wake_s_ = hold_until_s_;
  for (auto& [id, client] : clients_) {
    if (client.wake_at_s <= now) {
      client.wake_at_s = kNever;
      set_ready(id, client);
    }
    first_wake_s_ = std::min(first_wake_s_, client.wake_at_s);
  }
}

double RenderEngine::Impl::used_seconds(FairQueue::Id id) const {
  const std::lock_guard lock(mutex_);
  return queue_.used_seconds(id);
}

double RenderEngine::Impl::used_seconds() const {
  const std::lock_guard lock(mutex_);
  return queue_.used_seconds();
}

bool RenderEngine::Impl::run_piece(PieceSource& source) noexcept {
  try {
    return arena_->arena.execute([&] { return source.run_piece(); });
  } catch (...) {
    return source.failed(failure_reason());
  }
}

std::vector<int> RenderEngine::Impl::thread_ids() const {
  const std::lock_guard lock(mutex_);
  return thread_ids_;
}

void RenderEngine::Impl::count(const RenderTotals& done) noexcept {
  if (done.samples > 0) samples_.fetch_add(done.samples, std::memory_order_relaxed);
  if (done.rays > 0) rays_.fetch_add(done.rays, std::memory_order_relaxed);
  if (done.invalid_samples > 0) invalid_samples_.fetch_add(done.invalid_samples, std::memory_order_relaxed);
}

RenderTotals RenderEngine::Impl::totals() const noexcept {
  const auto read = [](const auto& value) { return value.load(std::memory_order_relaxed); };
  return {read(samples_), read(rays_), read(invalid_samples_)};
}

void RenderEngine::Impl::work() {
  std::unique_lock lock(mutex_);
  thread_ids_.push_back(int(gettid()));
  for (;;) {
    if (first_wake_s_ < kNever) wake_due();
    while (!stop_ && !queue_.any_ready()) {
      if (first_wake_s_ < kNever) {
        const double seconds = std::clamp(first_wake_s_ - now_s(), 0.0, kLongestWait);
        work_or_stop_.wait_for(lock, std::chrono::duration<double>(seconds));
        wake_due();
      } else {
        work_or_stop_.wait(lock);
      }
    }
    if (stop_) return;
    const FairQueue::Id id = *queue_.take();
    Client& client = clients_.at(id);  // stays: remove() waits for this piece
    const std::uint64_t wakes = client.wakes;
    lock.unlock();
    const double started = thread_used_s();
    const bool more = run_piece(*client.source);
    const double seconds = thread_used_s() - started;
    lock.lock();
    if (more) {
      const bool others_slept = !queue_.any_ready();
      set_ready(id, client);
      if (others_slept) work_or_stop_.notify_all();
    } else if (client.wakes == wakes) {
      queue_.set_ready(id, false);
    }
    queue_.finish(id, seconds);
    if (client.removing) piece_finished_.notify_all();
  }
}

RenderEngine::RenderEngine(int threads) : impl_(std::make_unique<Impl>(threads)) {}
RenderEngine::~RenderEngine() = default;
int RenderEngine::threads() const {
  return impl_->threads();
}
double RenderEngine::used_seconds() const {
  return impl_->used_seconds();
}
RenderTotals RenderEngine::totals() const {
  return impl_->totals();
}
std::vector<int> RenderEngine::thread_ids() const {
  return impl_->thread_ids();
}

}  // namespace helio
