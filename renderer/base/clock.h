// Time in seconds.
#pragma once

#include <algorithm>
#include <chrono>

namespace helio {

// Monotonic: the one clock of budgets, fairness and reports.
inline double now_s() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

// A deadline as gRPC takes it, so many seconds from now; below 0: now.
inline std::chrono::system_clock::time_point deadline_in(double seconds) {
  return std::chrono::system_clock::now() + std::chrono::duration_cast<std::chrono::system_clock::duration>(
                                                std::chrono::duration<double>(std::max(0.0, seconds)));
}

}  // namespace helio
