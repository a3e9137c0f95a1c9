// How long loops of shaders may be.
#pragma once

#include <cstdint>
#include <memory>

#include "renderer/vulkan/device/device.h"

namespace helio::vulkan {

// The rounds after which all loops of an invocation end although their conditions hold, or 0: there is no such limit.
// Mesa's software device of Debian 12 (22.3.6) counts 65,535 rounds of all loops together, of the eight invocations
// that it runs side by side, and says nothing: whoever may need more has to count. Runs a kernel.
Result<std::uint32_t> find_loop_limit(const std::shared_ptr<Device>& device);

}  // namespace helio::vulkan
