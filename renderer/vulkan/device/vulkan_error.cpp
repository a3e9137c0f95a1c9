#include "renderer/vulkan/device/vulkan_error.h"

#include "renderer/vulkan/device/device.h"

namespace helio::vulkan {

std::string result_name(VkResult result) {
  switch (result) {
#define HELIO_NAME(name) \
  case name:             \
    return #name
    HELIO_NAME(VK_SUCCESS);
    HELIO_NAME(VK_NOT_READY);
    HELIO_NAME(VK_TIMEOUT);
    HELIO_NAME(VK_INCOMPLETE);
    HELIO_NAME(VK_ERROR_OUT_OF_HOST_MEMORY);
    HELIO_NAME(VK_ERROR_OUT_OF_DEVICE_MEMORY);
    HELIO_NAME(VK_ERROR_INITIALIZATION_FAILED);
    HELIO_NAME(VK_ERROR_DEVICE_LOST);
    HELIO_NAME(VK_ERROR_MEMORY_MAP_FAILED);
    HELIO_NAME(VK_ERROR_LAYER_NOT_PRESENT);
    HELIO_NAME(VK_ERROR_EXTENSION_NOT_PRESENT);
    HELIO_NAME(VK_ERROR_FEATURE_NOT_PRESENT);
    HELIO_NAME(VK_ERROR_INCOMPATIBLE_DRIVER);
    HELIO_NAME(VK_ERROR_TOO_MANY_OBJECTS);
    HELIO_NAME(VK_ERROR_FRAGMENTED_POOL);
    HELIO_NAME(VK_ERROR_OUT_OF_POOL_MEMORY);
    HELIO_NAME(VK_ERROR_INVALID_OPAQUE_CAPTURE_ADDRESS);
    HELIO_NAME(VK_ERROR_INVALID_SHADER_NV);
    HELIO_NAME(VK_ERROR_UNKNOWN);
#undef HELIO_NAME
    default:
      return "VkResult " + std::to_string(static_cast<int>(result));
  }
}

Error vulkan_error(Device& device, VkResult result, const std::string& doing) {
  if (result == VK_ERROR_DEVICE_LOST) {
    device.mark_lost(doing + " failed with VK_ERROR_DEVICE_LOST");
    return device.lost_error();
  }
  const bool memory = result == VK_ERROR_OUT_OF_DEVICE_MEMORY || result == VK_ERROR_OUT_OF_HOST_MEMORY ||
                      result == VK_ERROR_OUT_OF_POOL_MEMORY || result == VK_ERROR_FRAGMENTED_POOL;
  return {memory ? ErrorCode::resource_exhausted : ErrorCode::unavailable,
          device.info().name + ": " + doing + " failed with " + result_name(result),
          {}};
}

}  // namespace helio::vulkan
