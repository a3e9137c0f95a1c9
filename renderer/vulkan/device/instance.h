// The Vulkan loader, loaded at run time so that programs start where there is none, and the process's instance.
#pragma once

#include <volk.h>

#include "renderer/base/result.h"

namespace helio::vulkan {

// The process's instance, which the first call makes and which is kept until the process ends; there is one with
// validation and one without. Fails with a clause that says what is missing: the loader, or a driver. Thread safe.
Result<VkInstance> open_instance(bool validation = false);

}  // namespace helio::vulkan
