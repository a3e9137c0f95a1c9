#include "renderer/vulkan/device/compute_pipeline.h"

#include <utility>

#include "renderer/vulkan/device/shader_module.h"
#include "renderer/vulkan/device/vulkan_error.h"
#include "renderer/vulkan/device/vulkan_struct.h"

namespace helio::vulkan {

Result<ComputePipeline> ComputePipeline::create(std::shared_ptr<Device> device, std::span<const std::uint32_t> spirv,
                                                std::uint32_t push_bytes, std::span<const std::uint32_t> constants) {
  if (device->lost()) return device->lost_error();
  const auto shader = ShaderModule::create(device, spirv);
  if (!shader) return shader.error();
  auto objects = PipelineObjects::create(device, push_bytes, VK_SHADER_STAGE_COMPUTE_BIT);
  if (!objects) return std::move(objects).error();
  const Specialization specialization(constants);
  auto create = vulkan_struct<VkComputePipelineCreateInfo>(VK_STRUCTURE_TYPE_COMPUTE_PIPELINE_CREATE_INFO);
  create.stage.sType = VK_STRUCTURE_TYPE_PIPELINE_SHADER_STAGE_CREATE_INFO;
  create.stage.stage = VK_SHADER_STAGE_COMPUTE_BIT;
  create.stage.module = shader->handle();
  create.stage.pName = "main";
  create.stage.pSpecializationInfo = specialization.info();
  create.layout = (*objects)->layout;
  if (const VkResult result = device->api().vkCreateComputePipelines(device->handle(), VK_NULL_HANDLE, 1, &create,
                                                                     nullptr, &(*objects)->pipeline);
      result != VK_SUCCESS) {
    return vulkan_error(*device, result, "vkCreateComputePipelines");
  }
  ComputePipeline made;
  made.objects_ = std::move(*objects);
  return made;
}

void ComputePipeline::dispatch(VkCommandBuffer commands, std::span<const std::byte> push, Groups groups) const {
  objects_->bind(commands, VK_PIPELINE_BIND_POINT_COMPUTE, push);
  objects_->device->api().vkCmdDispatch(commands, groups.x, groups.y, groups.z);
}

Status run_compute(const std::shared_ptr<Device>& device, std::span<const std::uint32_t> spirv,
                   std::span<const std::byte> push, Groups groups, std::chrono::milliseconds limit,
                   std::span<const std::uint32_t> constants) {
  auto pipeline = ComputePipeline::create(device, spirv, static_cast<std::uint32_t>(push.size()), constants);
  if (!pipeline) return std::move(pipeline).error();
  auto slot = CommandSlot::create(device);
  if (!slot) return std::move(slot).error();
  return slot->run(
      [&](const VolkDeviceTable&, VkCommandBuffer commands) { pipeline->dispatch(commands, push, groups); }, limit);
}

}  // namespace helio::vulkan
