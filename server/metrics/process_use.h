// What the system says of this process.
#pragma once

#include <cstdint>

namespace helio {

// 0 where the system does not say.
struct ProcessUse {
  double cpu_seconds = 0;
  std::uint64_t resident_bytes = 0, virtual_bytes = 0;
  std::uint64_t open_files = 0, most_open_files = 0;
};
ProcessUse process_use();

}  // namespace helio
