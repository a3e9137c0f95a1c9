// One thread that calls functions at given times: grace periods, progress reports, paced sending.
#pragma once

#include <compare>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <map>
#include <mutex>
#include <thread>

namespace helio {

class TimerQueue {
 public:
  TimerQueue();
  ~TimerQueue();  // functions that are still waiting are dropped

  struct Id {
    double at_s = 0;
    std::uint64_t number = 0;
    friend auto operator<=>(const Id&, const Id&) = default;
  };
  // Calls `function` once, at time `at_s` of now_s() or soon after. It must be short and hold what it uses by weak_ptr.
  // One that throws std::bad_alloc is called again kAgainAfter later: until then it may have done a part of its work.
  // Other exceptions are logged.
  Id call_at(double at_s, std::function<void()> function);
  static constexpr double kAgainAfter = 0.1;  // seconds
  // Drops the function, unless it has been called or is being called.
  void cancel(const Id& id);

  // Drops the functions that wait, and waits for the one in hand; none is called from then on. Must not be called from
  // one.
  void stop();

 private:
  void run();

  std::mutex mutex_;
  std::condition_variable changed_;
  std::map<Id, std::function<void()>> waiting_;
  std::uint64_t calls_ = 0;
  bool stopping_ = false;
  std::thread thread_;
};

}  // namespace helio
