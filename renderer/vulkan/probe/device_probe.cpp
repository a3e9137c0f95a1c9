#include <utility>

#include "renderer/vulkan/probe/probe.h"

namespace helio::vulkan {

DeviceProbe::DeviceProbe(const ProbeOptions& options) : thread_([this, options] { run(options); }) {}

DeviceProbe::~DeviceProbe() {
  stopping_ = true;
  thread_.join();
}

void DeviceProbe::run(ProbeOptions options) {
  options.stop = &stopping_;
  DeviceList first = probe_devices(options);
  const bool late = first.late;
  answer(std::move(first));
  if (!late || stopping_) return;
  options.time_limit = options.patience;
  answer(probe_devices(options));
}

void DeviceProbe::answer(DeviceList list) {
  {
    const std::lock_guard lock(mutex_);
    list_ = std::move(list);
  }
  answered_.notify_all();
}

DeviceList DeviceProbe::devices() const {
  std::unique_lock lock(mutex_);
  answered_.wait(lock, [&] { return list_.has_value(); });
  return *list_;
}

bool DeviceProbe::finished() const {
  const std::lock_guard lock(mutex_);
  return list_.has_value();
}

}  // namespace helio::vulkan
