// Processor time of this process and of the whole machine, in seconds: to tell whether a measurement was disturbed.
#pragma once

#include <ctime>
#include <optional>

namespace helio {

// Of all threads of this process.
inline double process_cpu_s() {
  timespec t{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
  return double(t.tv_sec) + 1e-9 * double(t.tv_nsec);
}

// Of all processors, idle time and waiting for disks left out, time that a hypervisor took included, in steps of the
// kernel's tick (10 ms). Nothing: the kernel does not say.
std::optional<double> machine_busy_s();

}  // namespace helio
