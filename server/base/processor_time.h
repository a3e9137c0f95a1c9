// Processor time of this process and of the whole machine, in seconds: to tell whether a measurement was disturbed.
#pragma once

#include <optional>

#include "renderer/base/cpu_time.h"  // process_cpu_s()

namespace helio {

// The time that all processors were busy, without waiting for disks and with the time that a hypervisor took, in steps
// of the kernel's tick (10 ms). Nothing: the kernel does not say.
std::optional<double> machine_busy_s();

}  // namespace helio
