// Whether a device computes what it promises: a few known numbers, before a picture depends on it.
#pragma once

#include <memory>

#include "renderer/vulkan/device/device.h"

namespace helio::vulkan {

// Changes with what the tests demand, so that older answers in the cache no longer count.
inline constexpr int kSelfTestVersion = 1;

// Runs a compute shader: 64-bit integers and floats, addresses, scalar layout, 64 invocations. The error says what was
// found and what was expected.
Status test_compute(const std::shared_ptr<Device>& device);

// Runs a ray-tracing pipeline: 64 rays at four triangles, one of which the any-hit shader ignores; closest hits and
// occlusion. Precondition: the device is opened for Level::rt.
Status test_rays(const std::shared_ptr<Device>& device);

}  // namespace helio::vulkan
