// Latencies that do not depend on what else a machine does: they are counted in processor time of this process, so that
// other programs may take the cores away without failing a test. Wall time is measured by `helio_bench cancel` and
// `helio_bench latency`, on idle machines.
#pragma once

#include <algorithm>
#include <vector>

#include "renderer/base/cpu_time.h"  // process_cpu_s()

namespace helio {

// What nine of ten of the values do not exceed. Not the largest: a machine may keep the thread that asks from the core
// between its reading of the clock and its request, while the workers, rightly, go on.
inline double percentile_90(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return values[(values.size() - 1) * 9 / 10];
}

// What `workers` busy threads may burn between a request and its effect, where one may take 20 ms of an idle machine.
// What is asked is asked of code that the thread sanitizer does not slow down, five to fifteen times.
inline double allowed_work_s(int workers) {
  double each = 0.020;
#ifdef __SANITIZE_THREAD__
  each *= 15;
#endif
  return workers * each;
}

}  // namespace helio
