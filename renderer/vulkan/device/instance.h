// The Vulkan loader, loaded at run time so that programs start where there is none, and the process's instance.
#pragma once

#include <volk.h>

#include "renderer/base/result.h"

namespace helio::vulkan {

// Made by the first call and kept until the process ends, one with validation and one without. Fails with a clause that
// says what is missing: the loader, or a driver. Thread safe.
Result<VkInstance> open_instance(bool validation = false);

}  // namespace helio::vulkan
