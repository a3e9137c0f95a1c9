#include "server/base/timer_queue.h"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <future>
#include <new>
#include <stdexcept>
#include <thread>

namespace helio {
namespace {

TEST(TimerQueue, AFunctionThatThrowsEndsNothing) {
  TimerQueue timers;
  std::atomic<int> out_of_memory{0}, failed{0};
  std::promise<void> done;
  timers.call_at(0, [&] {
    if (++out_of_memory < 3) throw std::bad_alloc();
    done.set_value();
  });
  timers.call_at(0, [&] {
    ++failed;
    throw std::runtime_error("no");
  });
  timers.call_at(0, [&] {
    ++failed;
    throw 7;
  });
  done.get_future().wait();
  EXPECT_EQ(out_of_memory, 3) << "memory that was out may be there a little later";
  EXPECT_EQ(failed, 2) << "called once each";
}

TEST(TimerQueue, NothingIsCalledAfterItWasStopped) {
  TimerQueue timers;
  std::promise<void> started;
  std::atomic<int> ended{0}, called{0};
  timers.call_at(0, [&] {
    started.set_value();
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
    ++ended;
  });
  timers.call_at(0, [&] { ++called; });
  started.get_future().wait();
  timers.stop();
  EXPECT_EQ(ended, 1) << "the function in hand is waited for";
  timers.call_at(0, [&] { ++called; });
  timers.stop();
  EXPECT_EQ(called, 0);
}

}  // namespace
}  // namespace helio
