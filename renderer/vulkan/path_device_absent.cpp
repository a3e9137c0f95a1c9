// A build without Vulkan.
#include "renderer/vulkan/path_device.h"

namespace helio::vulkan {

Result<std::shared_ptr<PathDevice>> PathDevice::open(int, Level) {
  return Error{ErrorCode::unavailable, "this program was built without Vulkan", {}};
}

}  // namespace helio::vulkan
