// The arena that a scene is prepared in, and the priority of its workers.
#pragma once

#include <sys/resource.h>
#include <tbb/info.h>
#include <tbb/task_arena.h>
#include <tbb/task_scheduler_observer.h>

#include <algorithm>

namespace helio {

// threads: 0 or less: as many as the machine runs at once. Never more, or TBB would complain on stderr.
inline int build_concurrency(int threads) {
  const int most = tbb::info::default_concurrency();
  return threads > 0 ? std::min(threads, most) : most;
}

// So much nicer than render workers are the workers of a build, which together are as many: where both want every core
// the scheduler gives a build a quarter of the machine (weights 335 and 1024), and where nothing renders all of it.
inline constexpr int kBuildNiceness = 5;

// While it lives, oneTBB's workers that enter the arena are made nicer, for good: nothing but builds uses them. Threads
// that call execute() stay as they are.
class NiceBuildWorkers final : public tbb::task_scheduler_observer {
 public:
  explicit NiceBuildWorkers(tbb::task_arena& arena) : task_scheduler_observer(arena) { observe(true); }
  ~NiceBuildWorkers() override { observe(false); }

  void on_scheduler_entry(bool worker) override {
    static thread_local bool nice = false;
    if (!worker || nice) return;
    nice = true;
    // On Linux this sets the calling thread's alone. If it is refused a build has half of a busy machine, as without.
    setpriority(PRIO_PROCESS, 0, getpriority(PRIO_PROCESS, 0) + kBuildNiceness);
  }
};

}  // namespace helio
