// The machine's workers: N threads that take turns over the render loops, in the order of a FairQueue: while
// both have work, interactive ones together get eight times as much of the machine as jobs together, and owners of either
// kind have equal shares of it. What a piece throws ends the work of its source, never a worker.
//
// The threads are ours and step into one oneTBB arena for each piece, so whatever parallel algorithm a piece may call
// stays within the engine's share of the machine, while an idle worker sleeps on a condition variable and holds no
// slot.
#pragma once

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <limits>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "renderer/frame/fair_queue.h"
#include "renderer/frame/render_loop.h"

namespace helio {

// Something whose work comes in pieces.
class PieceSource {
 public:
  virtual ~PieceSource() = default;
  // Runs one piece (at most about 5 ms) on the calling worker, if there is one; several workers may call at once. True
  // when another call would find something to do. failed() is called with the reason of what it throws.
  virtual bool run_piece() = 0;
  // A call of run_piece() threw: by the worker that called, while others may be in theirs. What the source was about is
  // given up, and whoever waits for it is told, without memory if need be. Returns what run_piece() would.
  virtual bool failed(std::string reason) noexcept = 0;
};

// Thread safe.
struct RenderEngine::Impl {
  explicit Impl(int threads);
  ~Impl();

  FairQueue::Id add(PieceSource& source, RenderRank rank, const std::string& owner = {});
  void remove(FairQueue::Id id);  // waits for its pieces in flight; never call from one
  void wake(FairQueue::Id id);    // run_piece() has something to do
  // The same, once now_s() is at_s; the newest call for a source counts.
  void wake_at(FairQueue::Id id, double at_s);
  // Nobody else is rendered for so long, or until release(id) or remove(id). The newest call counts.
  void hold(FairQueue::Id id, double seconds);
  void release(FairQueue::Id id);
  double used_seconds(FairQueue::Id id) const;
  double used_seconds() const;
  int threads() const { return int(workers_.size()); }
  std::vector<int> thread_ids() const;
  // Of a piece.
  void count(const RenderTotals& done) noexcept;
  RenderTotals totals() const noexcept;

 private:
  static constexpr double kNever = std::numeric_limits<double>::infinity();

  struct Arena;
  struct Client {
    PieceSource* source = nullptr;
    std::uint64_t wakes = 0;  // tells a worker that found nothing whether something came in since it looked
    bool removing = false;
    double wake_at_s = kNever;
  };

  void stop();
  void work();
  bool run_piece(PieceSource& source) noexcept;
  void set_ready(FairQueue::Id id, Client& client);
  void wake_due();
  void end_hold();  // with mutex_ held

  mutable std::mutex mutex_;
  std::condition_variable work_or_stop_, piece_finished_;
  FairQueue queue_;  // groups: by RenderRank
  std::map<FairQueue::Id, Client> clients_;
  double first_wake_s_ = kNever;  // of the clients' and the hold's end, or earlier
  double hold_until_s_ = kNever;
  bool stop_ = false;
  std::unique_ptr<Arena> arena_;
  std::vector<std::thread> workers_;
  std::vector<int> thread_ids_;
  std::atomic<std::uint64_t> samples_{0}, rays_{0}, invalid_samples_{0};
};

}  // namespace helio
