// Processor time in seconds.
#pragma once

#include <ctime>

namespace helio {

// That all threads of this process have used so far.
inline double process_cpu_s() {
  timespec t{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
  return double(t.tv_sec) + 1e-9 * double(t.tv_nsec);
}

}  // namespace helio
