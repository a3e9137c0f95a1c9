// A ray-tracing pipeline with its shader binding table. Its shaders read everything by device addresses in push
// constants, the acceleration structure too: accelerationStructureEXT(address).
#pragma once

#include <volk.h>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "renderer/vulkan/device/buffer.h"
#include "renderer/vulkan/device/commands.h"
#include "renderer/vulkan/device/pipeline_objects.h"

namespace helio::vulkan {

using Spirv = std::span<const std::uint32_t>;  // empty: no such shader

struct RayShaders {
  struct HitGroup {
    Spirv closest_hit, any_hit, intersection;
  };
  Spirv raygen;
  std::vector<Spirv> miss;           // indexed by missIndex of traceRayEXT
  std::vector<HitGroup> hit_groups;  // indexed by the instance's offset + sbtRecordOffset + geometry index * stride
};

// Thread safe once it is created.
class RayPipeline {
 public:
  // Precondition: the device is opened for Level::rt. `push_bytes`: of the push constants, which all stages see.
  // `constants`: the values of the specialisation constants 0, 1, ... of all stages. `recursion`: at least 1.
  static Result<RayPipeline> create(std::shared_ptr<Device> device, const RayShaders& shaders, std::uint32_t push_bytes,
                                    std::span<const std::uint32_t> constants = {}, std::uint32_t recursion = 1);
  // Binds the pipeline and launches the raygen shader width x height times. `push` has the size that the pipeline was
  // created with.
  void trace(VkCommandBuffer commands, std::span<const std::byte> push, std::uint32_t width,
             std::uint32_t height = 1) const;

 private:
  RayPipeline() = default;

  std::shared_ptr<const PipelineObjects> objects_;
  Buffer table_;
  VkStridedDeviceAddressRegionKHR raygen_{}, miss_{}, hit_{}, callable_{};
};

}  // namespace helio::vulkan
