#include "server/base/processor_time.h"

#include <unistd.h>

#include <cinttypes>
#include <cstdint>
#include <cstdio>

namespace helio {

std::optional<double> machine_busy_s() {
  std::FILE* file = std::fopen("/proc/stat", "r");
  if (!file) return std::nullopt;
  // proc(5): user, nice, system, idle, iowait, irq, softirq, steal; guests' time is in user and nice.
  std::uint64_t user = 0, nice = 0, system = 0, irq = 0, softirq = 0, steal = 0;
  const int read = std::fscanf(file, "cpu %" SCNu64 " %" SCNu64 " %" SCNu64 " %*u %*u %" SCNu64 " %" SCNu64 " %" SCNu64,
                               &user, &nice, &system, &irq, &softirq, &steal);
  std::fclose(file);
  const long ticks = sysconf(_SC_CLK_TCK);
  if (read != 6 || ticks <= 0) return std::nullopt;
  return double(user + nice + system + irq + softirq + steal) / double(ticks);
}

std::optional<double> waited_for_processor_s(std::span<const int> threads) {
  double seconds = 0;
  for (const int thread : threads) {
    char path[64];
    std::snprintf(path, sizeof path, "/proc/self/task/%d/schedstat", thread);
    std::FILE* file = std::fopen(path, "r");
    if (!file) return std::nullopt;
    std::uint64_t nanoseconds = 0;
    const int read = std::fscanf(file, "%*u %" SCNu64, &nanoseconds);
    std::fclose(file);
    if (read != 1) return std::nullopt;
    seconds += 1e-9 * double(nanoseconds);
  }
  return seconds;
}

}  // namespace helio
