// Processor time of this process and of the whole machine, in seconds: to tell whether a measurement was disturbed.
#pragma once

#include <optional>
#include <span>

#include "renderer/base/cpu_time.h"  // process_cpu_s()

namespace helio {

// The time that all processors were busy, without waiting for disks and with the time that a hypervisor took, in steps
// of the kernel's tick (10 ms). Nothing: the kernel does not say.
std::optional<double> machine_busy_s();

// For how long these threads of this process, by the system's ids, were ready and had no processor, all together, as
// the scheduler counts it in nanoseconds (the second number of /proc/self/task/ID/schedstat). Nothing: the kernel does
// not say it of one of them.
std::optional<double> waited_for_processor_s(std::span<const int> threads);

}  // namespace helio
