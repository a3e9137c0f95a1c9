// Finds this machine's Vulkan devices and tests what they can do. A driver that crashes must not end the caller, so
// devices are listed and tested by a program of its own, heliograph-vulkan-probe. A program rather than the caller's
// own executable again: it is linked to nothing but the loader, starts in milliseconds, and serves tests and programs
// that use the daemon as a library, whose main() is not ours.
#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <filesystem>
#include <mutex>
#include <optional>
#include <thread>

#include "renderer/vulkan/device/device_info.h"

namespace helio::vulkan {

struct ProbeOptions {
  std::filesystem::path program;               // the probe; empty: beside this executable, or in ../libexec/heliograph
  std::filesystem::path cache_folder;          // empty: $XDG_CACHE_HOME/heliograph, or ~/.cache/heliograph
  std::chrono::milliseconds time_limit{2000};  // for all devices together; then the probe is killed
  std::chrono::milliseconds patience{30000};   // DeviceProbe: the second time limit, where the first was too short
  const std::atomic<bool>* stop = nullptr;     // ends the probe early once it is true
};

// Blocks until the probe has answered, at most for the time limit. Devices are always listed anew, which takes the time
// that the drivers need to start; results of self-tests are cached by device, driver and the times of the drivers'
// files. Never fails: what went wrong is the list's reason, or a device's. Thread safe.
DeviceList probe_devices(const ProbeOptions& options = {});

// Probes on a thread of its own, from its construction on. Where drivers gave no answer in time, which may be for
// nothing but a busy machine, it probes once more with patience; its second answer takes the place of the first. Thread
// safe.
class DeviceProbe {
 public:
  explicit DeviceProbe(const ProbeOptions& options = {});
  ~DeviceProbe();  // ends the probe

  // The newest answer; waits for the first.
  DeviceList devices() const;
  bool finished() const;  // devices() does not wait

 private:
  void run(ProbeOptions options);
  void answer(DeviceList list);

  std::atomic<bool> stopping_{false};
  mutable std::mutex mutex_;
  mutable std::condition_variable answered_;
  std::optional<DeviceList> list_;
  std::thread thread_;
};

}  // namespace helio::vulkan
