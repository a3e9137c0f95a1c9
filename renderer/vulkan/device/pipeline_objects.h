// A pipeline and its layout as Vulkan objects, freed together. The layout has push constants and no descriptors.
#pragma once

#include <volk.h>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>

#include "renderer/vulkan/device/device.h"

namespace helio::vulkan {

struct PipelineObjects {
  // Creates the layout alone. `stages`: those that see the push constants. Refused: more bytes than the device has.
  static Result<std::shared_ptr<PipelineObjects>> create(std::shared_ptr<Device> device, std::uint32_t push_bytes,
                                                         VkShaderStageFlags stages);
  PipelineObjects(std::shared_ptr<Device> device, std::uint32_t push_bytes, VkShaderStageFlags stages);
  PipelineObjects(const PipelineObjects&) = delete;
  PipelineObjects& operator=(const PipelineObjects&) = delete;
  ~PipelineObjects();

  // Precondition: `push` has push_bytes bytes.
  void bind(VkCommandBuffer commands, VkPipelineBindPoint point, std::span<const std::byte> push) const;

  const std::shared_ptr<Device> device;
  const std::uint32_t push_bytes;
  const VkShaderStageFlags stages;
  VkPipelineLayout layout = VK_NULL_HANDLE;
  VkPipeline pipeline = VK_NULL_HANDLE;
};

}  // namespace helio::vulkan
