// What a physical device is and has, as its driver reports it.
#pragma once

#include <volk.h>

#include <memory>
#include <string>
#include <vector>

#include "renderer/vulkan/device/device_info.h"

namespace helio::vulkan {

// The structures that features are asked for and enabled by. They point to one another, so they stay in place.
struct DeviceFeatures {
  DeviceFeatures();
  DeviceFeatures(const DeviceFeatures&) = delete;
  void link_ray_tracing();  // asks for and enables the two structures of ray tracing as well

  VkPhysicalDeviceFeatures2 core{};
  VkPhysicalDeviceVulkan12Features vulkan12{};
  VkPhysicalDeviceAccelerationStructureFeaturesKHR acceleration{};
  VkPhysicalDeviceRayTracingPipelineFeaturesKHR ray_tracing{};
};

struct DescribedDevice {
  VkPhysicalDevice physical = VK_NULL_HANDLE;
  DeviceInfo info;
  int queue_family = -1;  // that computes; -1: none
};

// All devices, in the order of DeviceInfo::index. Calls the drivers in this process; probe_devices() does not.
Result<std::vector<DescribedDevice>> describe_devices(VkInstance instance);

// Switches on what `level` needs, and nothing else.
void enable_features(DeviceFeatures& features, Level level);
// The device extensions that `level` needs.
const std::vector<const char*>& device_extensions(Level level);

}  // namespace helio::vulkan
