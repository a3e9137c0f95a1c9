#include "server/app/machine_info.h"

#include <fstream>
#include <thread>

#include "renderer/base/instruction_set.h"
#include "renderer/trace/accel/traversal_isa.h"
#include "server/base/build_info.h"

namespace helio {

namespace {

std::string processor_name() {
  std::ifstream cpuinfo("/proc/cpuinfo");
  for (std::string line; std::getline(cpuinfo, line);) {
    const std::size_t colon = line.find(": ");
    if (line.rfind("model name", 0) == 0 && colon != std::string::npos) return line.substr(colon + 2);
  }
  return {};
}

}  // namespace

MachineInfo machine_info() {
  MachineInfo info;
  info.processor = processor_name();
  info.threads = int(std::thread::hardware_concurrency());
  info.instruction_sets = processor_instruction_sets();
  info.compiled_for = build_isa();
  info.traversal = traversal_isa();
  info.libraries = build_libraries();
  for (auto& [name, version] : info.libraries) {
    if (name == "Embree") version = embree_version();
  }
  return info;
}

}  // namespace helio
