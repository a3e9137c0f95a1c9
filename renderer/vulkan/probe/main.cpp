// heliograph-vulkan-probe: lists Vulkan devices and tests them, for probe_devices(). By lines of JSON:
//
//   says   {"devices": [...]} or {"error": "why there are none"}
//   reads  {"test": [[INDEX, "compute" or "rt"], ...]}
//   says   for each test {"begin": [INDEX, LEVEL]} and {"outcome": "" or why it failed}, then {"done": true}
//
// A crash between `begin` and `outcome` is that test's.
#include <signal.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <iostream>
#include <string>

#include "renderer/vulkan/device/describe_device.h"
#include "renderer/vulkan/device/instance.h"
#include "renderer/vulkan/device/self_test/self_test.h"
#include "renderer/vulkan/probe/device_json.h"

namespace helio::vulkan {
namespace {

using nlohmann::json;

void say(const json& message) {
  const std::string line = message.dump(-1, ' ', true, json::error_handler_t::replace) + "\n";
  std::fwrite(line.data(), 1, line.size(), stdout);
  std::fflush(stdout);
}

std::string test(int index, Level level) {
  DeviceOptions options;
  options.index = index;
  options.level = level;
  auto device = Device::open(options);
  if (!device) return std::move(device).error().to_string();
  if ((*device)->level() != level) return "the device has no level " + std::string(level_name(level));
  const Status passed = level == Level::rt ? test_rays(*device) : test_compute(*device);
  return passed ? "" : passed.error().to_string();
}

int answer() {
  auto instance = open_instance();
  auto devices = instance ? describe_devices(*instance) : std::move(instance).error();
  if (!devices) {
    say({{"error", devices.error().to_string()}});
    return 0;
  }
  json list = json::array();
  for (const DescribedDevice& device : *devices) list.push_back(to_json(device.info));
  say({{"devices", list}});

  std::string line;
  if (!std::getline(std::cin, line)) return 0;
  const json request = json::parse(line, nullptr, false);
  if (!request.is_object() || !request.contains("test") || !request["test"].is_array()) return 2;
  for (const json& wanted : request["test"]) {
    if (!wanted.is_array() || wanted.size() != 2 || !wanted[0].is_number_unsigned() || !wanted[1].is_string()) return 2;
    const auto level = read_level(wanted[1].get<std::string>());
    if (!level) return 2;
    say({{"begin", wanted}});
    say({{"outcome", test(wanted[0].get<int>(), *level)}});
  }
  say({{"done", true}});
  return 0;
}

}  // namespace
}  // namespace helio::vulkan

int main() {
  if (isatty(STDIN_FILENO)) {
    std::puts("heliograph-vulkan-probe is run by heliograph and heliographd; heliograph info lists the devices");
    return 2;
  }
  prctl(PR_SET_PDEATHSIG, SIGKILL);  // whoever asks may be killed
  const rlimit no_core{0, 0};
  setrlimit(RLIMIT_CORE, &no_core);
  const int code = helio::vulkan::answer();
  std::fflush(stdout);
  std::_Exit(code);  // without the drivers' own clean-up, which may crash when all is said
}
