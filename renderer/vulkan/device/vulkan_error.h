// Vulkan's result codes as errors for a person.
#pragma once

#include <volk.h>

#include <string>

#include "renderer/base/result.h"

namespace helio::vulkan {

class Device;

std::string result_name(VkResult result);  // e.g. "VK_ERROR_DEVICE_LOST"

// What failed in `doing`, e.g. "vkAllocateMemory of 3000000 bytes". VK_ERROR_OUT_OF_*_MEMORY: resource_exhausted;
// otherwise unavailable. VK_ERROR_DEVICE_LOST also marks the device as lost.
Error vulkan_error(Device& device, VkResult result, const std::string& doing);

}  // namespace helio::vulkan
