#include "server/metrics/process_use.h"

#include <sys/resource.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <system_error>

#include "renderer/base/cpu_time.h"

namespace helio {

ProcessUse process_use() {
  ProcessUse use;
  use.cpu_seconds = process_cpu_s();
  const long page = sysconf(_SC_PAGESIZE);
  std::uint64_t all = 0, resident = 0;
  if (std::ifstream statm("/proc/self/statm"); page > 0 && statm >> all >> resident) {  // proc(5): in pages
    use.virtual_bytes = all * std::uint64_t(page);
    use.resident_bytes = resident * std::uint64_t(page);
  }
  std::error_code error;
  std::filesystem::directory_iterator files("/proc/self/fd", error);
  for (; !error && files != std::filesystem::directory_iterator(); files.increment(error)) ++use.open_files;
  if (use.open_files > 0) --use.open_files;  // the one that they were counted by
  rlimit limit{};
  if (getrlimit(RLIMIT_NOFILE, &limit) == 0) use.most_open_files = limit.rlim_cur;
  return use;
}

}  // namespace helio
