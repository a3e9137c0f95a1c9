#include "renderer/trace/accel/build_arena.h"

#include <gtest/gtest.h>
#include <tbb/parallel_for.h>

#include <atomic>
#include <chrono>
#include <thread>

namespace helio {
namespace {

int niceness() {
  return getpriority(PRIO_PROCESS, 0);
}

// A build on every core must not take half of the machine from those who render.
TEST(BuildArena, WorkersAreNicerThanTheirCaller) {
  if (build_concurrency(0) < 2) GTEST_SKIP() << "one core: oneTBB has no workers";
  const int own = niceness();
  const std::thread::id caller = std::this_thread::get_id();
  std::atomic<int> workers{0}, nice_workers{0};
  tbb::task_arena arena(build_concurrency(0));
  const NiceBuildWorkers nice(arena);
  const auto give_up = std::chrono::steady_clock::now() + std::chrono::seconds(30);
  arena.execute([&] {
    tbb::parallel_for(0, 64, [&](int) {
      if (std::this_thread::get_id() != caller) {
        ++workers;
        nice_workers += niceness() == std::min(19, own + kBuildNiceness);
      }
      // Until one has come.
      while (workers == 0 && std::chrono::steady_clock::now() < give_up) std::this_thread::yield();
    });
  });
  EXPECT_GT(workers, 0);
  EXPECT_EQ(nice_workers, workers);
  EXPECT_EQ(niceness(), own);
}

}  // namespace
}  // namespace helio
