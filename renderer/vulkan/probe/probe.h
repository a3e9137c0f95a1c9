// Finds this machine's Vulkan devices and tests what they can do. A driver that crashes must not end the caller, so
// devices are listed and tested by a program of its own, heliograph-vulkan-probe. A program rather than the caller's
// own executable again: it is linked to nothing but the loader, starts in milliseconds, and serves tests and programs
// that use the daemon as a library, whose main() is not ours.
#pragma once

#include <chrono>
#include <filesystem>
#include <future>

#include "renderer/vulkan/device/device_info.h"

namespace helio::vulkan {

struct ProbeOptions {
  std::filesystem::path program;               // the probe; empty: beside this executable, or in ../libexec/heliograph
  std::filesystem::path cache_folder;          // empty: $XDG_CACHE_HOME/heliograph, or ~/.cache/heliograph
  std::chrono::milliseconds time_limit{2000};  // for all devices together; then the probe is killed
};

// Blocks until the probe has answered, at most for the time limit. Devices are always listed anew, which takes the time
// that the drivers need to start; results of self-tests are cached by device, driver and the times of the drivers'
// files. Never fails: what went wrong is the list's reason, or a device's. Thread safe.
DeviceList probe_devices(const ProbeOptions& options = {});

// Probes on a thread of its own, from its construction on; its destructor waits for the thread.
class DeviceProbe {
 public:
  explicit DeviceProbe(const ProbeOptions& options = {})
      : list_(std::async(std::launch::async, [options] { return probe_devices(options); }).share()) {}

  // Waits for the probe. Thread safe.
  const DeviceList& devices() const { return list_.get(); }
  bool finished() const { return list_.wait_for(std::chrono::seconds(0)) == std::future_status::ready; }

 private:
  std::shared_future<DeviceList> list_;
};

}  // namespace helio::vulkan
