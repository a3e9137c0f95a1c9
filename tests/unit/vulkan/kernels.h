// The kernel sum_numbers.comp.
#pragma once

#include <cstdint>
#include <memory>
#include <span>

#include "renderer/vulkan/device/buffer.h"
#include "renderer/vulkan/device/compute_pipeline.h"

namespace helio::test {

// The sum that the device makes of `count` numbers at an address: at most 65,535, because loops of Debian 12's software
// device end then (self_test/loop_limit.h).
Result<std::uint64_t> sum_on_device(const std::shared_ptr<vulkan::Device>& device, std::uint64_t numbers,
                                    std::uint32_t count);

// Keeps a software device busy for about a second of processor time, but waits only until the limit.
Status spin_on_device(const std::shared_ptr<vulkan::Device>& device, std::chrono::milliseconds limit);

}  // namespace helio::test
