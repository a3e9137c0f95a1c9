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
  ComputePipeline made;
  made.device_ = device;
  made.push_bytes_ = push_bytes;
  auto layout = create_push_layout(*device, push_bytes, VK_SHADER_STAGE_COMPUTE_BIT);
  if (!layout) return std::move(layout).error();
  made.layout_ = *layout;
  const Specialization specialization(constants);
  auto create = vulkan_struct<VkComputePipelineCreateInfo>(VK_STRUCTURE_TYPE_COMPUTE_PIPELINE_CREATE_INFO);
  create.stage.sType = VK_STRUCTURE_TYPE_PIPELINE_SHADER_STAGE_CREATE_INFO;
  create.stage.stage = VK_SHADER_STAGE_COMPUTE_BIT;
  create.stage.module = shader->handle();
  create.stage.pName = "main";
  create.stage.pSpecializationInfo = specialization.info();
  create.layout = made.layout_;
  if (const VkResult result = device->api().vkCreateComputePipelines(device->handle(), VK_NULL_HANDLE, 1, &create,
                                                                     nullptr, &made.pipeline_);
      result != VK_SUCCESS) {
    return vulkan_error(*device, result, "vkCreateComputePipelines");
  }
  return made;
}

ComputePipeline::ComputePipeline(ComputePipeline&& other) noexcept {
  *this = std::move(other);
}

ComputePipeline& ComputePipeline::operator=(ComputePipeline&& other) noexcept {
  if (this == &other) return *this;
  destroy();
  device_ = std::move(other.device_);
  layout_ = std::exchange(other.layout_, VK_NULL_HANDLE);
  pipeline_ = std::exchange(other.pipeline_, VK_NULL_HANDLE);
  push_bytes_ = other.push_bytes_;
  return *this;
}

ComputePipeline::~ComputePipeline() {
  destroy();
}

void ComputePipeline::destroy() {
  if (!device_ || device_->lost()) return;
  device_->api().vkDestroyPipeline(device_->handle(), pipeline_, nullptr);
  device_->api().vkDestroyPipelineLayout(device_->handle(), layout_, nullptr);
  device_.reset();
}

void ComputePipeline::dispatch(VkCommandBuffer commands, std::span<const std::byte> push, Groups groups) const {
  HELIO_CHECK(push.size() == push_bytes_);
  const VolkDeviceTable& api = device_->api();
  api.vkCmdBindPipeline(commands, VK_PIPELINE_BIND_POINT_COMPUTE, pipeline_);
  if (push_bytes_ > 0)
    api.vkCmdPushConstants(commands, layout_, VK_SHADER_STAGE_COMPUTE_BIT, 0, push_bytes_, push.data());
  api.vkCmdDispatch(commands, groups.x, groups.y, groups.z);
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
