// Processor time of the calling thread, in seconds: what fairness and piece sizes go by. Unlike wall time it does not
// charge a loop for the other programs of a busy machine.
#pragma once

#include <time.h>

namespace helio {

inline double thread_cpu_s() {
  timespec t{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return double(t.tv_sec) + 1e-9 * double(t.tv_nsec);
}

}  // namespace helio
