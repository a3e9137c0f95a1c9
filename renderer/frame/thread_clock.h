// Time that the calling thread has used, in seconds: what fairness and piece sizes go by. Processor time, because unlike
// wall time it does not charge a loop for the other programs of a busy machine; and what other devices have computed
// for the thread while it waited.
#pragma once

#include <time.h>

namespace helio {

namespace detail {
inline thread_local double device_seconds = 0;
}

inline double thread_cpu_s() {
  timespec t{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return double(t.tv_sec) + 1e-9 * double(t.tv_nsec);
}

inline double thread_used_s() {
  return thread_cpu_s() + detail::device_seconds;
}

// The thread has waited so long for a device that worked for it alone.
inline void charge_device_time(double seconds) {
  if (seconds > 0) detail::device_seconds += seconds;
}

}  // namespace helio
