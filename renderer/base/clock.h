// Monotonic time in seconds: the one clock of budgets, fairness and reports.
#pragma once

#include <chrono>

namespace helio {

inline double now_s() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

}  // namespace helio
