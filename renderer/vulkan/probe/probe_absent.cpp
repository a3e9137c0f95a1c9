// The probe of a build without Vulkan.
#include "renderer/vulkan/probe/probe.h"

namespace helio::vulkan {

DeviceList probe_devices(const ProbeOptions&) {
  return {{}, "built without Vulkan"};
}

}  // namespace helio::vulkan
