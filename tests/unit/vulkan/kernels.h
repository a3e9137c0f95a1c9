// Kernels that try what devices do.
#pragma once

#include <cstdint>
#include <memory>
#include <span>

#include "renderer/vulkan/device/buffer.h"
#include "renderer/vulkan/device/compute_pipeline.h"

namespace helio::test {

// The rounds after which all loops of an invocation end although their conditions hold, or 0: there is no such limit.
// Mesa's software device of Debian 12 (22.3.6) counts 65,535 rounds of all loops together, of the eight invocations
// that it runs side by side, and says nothing: whoever may need more has to count.
Result<std::uint32_t> find_loop_limit(const std::shared_ptr<vulkan::Device>& device);

// The sum that the device makes of `count` numbers at an address: at most 65,535, see find_loop_limit().
Result<std::uint64_t> sum_on_device(const std::shared_ptr<vulkan::Device>& device, std::uint64_t numbers,
                                    std::uint32_t count);

// Keeps a software device busy for about a second of processor time, but waits only until the limit.
Status spin_on_device(const std::shared_ptr<vulkan::Device>& device, std::chrono::milliseconds limit);

}  // namespace helio::test
