// The ray-tracing pipeline of a raygen shader that includes trace_rt.glsl.
#pragma once

#include <cstdint>
#include <memory>
#include <span>

#include "renderer/base/result.h"
#include "renderer/vulkan/device/ray_pipeline.h"

namespace helio::vulkan {

// The pipeline of the raygen shader with our hit and miss shaders, recursion depth 1. `push_bytes`: of its push
// constants, which begin with the address of the SceneTables. `constants`: as in RayPipeline::create(). Precondition:
// the device is opened for Level::rt.
Result<RayPipeline> make_ray_pipeline(std::shared_ptr<Device> device, Spirv raygen, std::uint32_t push_bytes,
                                      std::span<const std::uint32_t> constants = {});

}  // namespace helio::vulkan
