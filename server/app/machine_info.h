// This machine and the way that this build renders on it.
#pragma once

#include <string>
#include <utility>
#include <vector>

namespace helio {

struct MachineInfo {
  std::string processor;                      // its own name; empty: it does not tell
  int threads = 0;                            // that this process may run on
  std::vector<std::string> instruction_sets;  // of the processor, by the names of renderer/base/instruction_set.h
  std::string compiled_for;                   // what the kernels use
  std::string traversal;                      // what Embree uses
  std::vector<std::pair<std::string, std::string>> libraries;  // names and versions; Embree's is that of the one loaded
};
MachineInfo machine_info();

}  // namespace helio
