// Latencies that hold on an idle machine, and a fair allowance where other programs run.
#pragma once

#include <algorithm>
#include <atomic>
#include <chrono>
#include <thread>
#include <vector>

#include "renderer/base/clock.h"

namespace helio {

// The 99th percentile of what is given; the largest where there are fewer than 100.
inline double percentile_99(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return values[std::min(values.size() - 1, values.size() * 99 / 100)];
}

// How late this machine wakes a thread that sleeps, with nothing of ours to blame but as many busy threads as the test
// has: what a latency is measured against where other programs run.
inline double wake_delay_p99() {
  std::atomic<bool> stop{false};
  std::vector<std::thread> busy;
  for (int i = 0; i < 2; ++i) {
    busy.emplace_back([&] {
      while (!stop) {
      }
    });
  }
  std::vector<double> delays;
  for (int i = 0; i < 100; ++i) {
    const double before = now_s();
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
    delays.push_back(now_s() - before - 0.002);
  }
  stop = true;
  for (std::thread& thread : busy) thread.join();
  return percentile_99(delays);
}

// Two wakes stand between a request and its effect: the worker's and ours. What is asked is asked of code that the
// thread sanitizer does not slow down, five to fifteen times.
inline double allowed_delay(double asked) {
#ifdef __SANITIZE_THREAD__
  asked *= 15;
#endif
  return asked + 2 * wake_delay_p99();
}

}  // namespace helio
