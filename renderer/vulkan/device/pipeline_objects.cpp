#include "renderer/vulkan/device/pipeline_objects.h"

#include <string>
#include <utility>

#include "renderer/vulkan/device/vulkan_error.h"
#include "renderer/vulkan/device/vulkan_struct.h"

namespace helio::vulkan {

PipelineObjects::PipelineObjects(std::shared_ptr<Device> its_device, std::uint32_t bytes, VkShaderStageFlags seen_by)
    : device(std::move(its_device)), push_bytes(bytes), stages(seen_by) {}

Result<std::shared_ptr<PipelineObjects>> PipelineObjects::create(std::shared_ptr<Device> device,
                                                                 std::uint32_t push_bytes, VkShaderStageFlags stages) {
  const DeviceInfo& info = device->info();
  if (const std::uint32_t most = info.limits.max_push_constant_bytes; push_bytes > most) {
    return Error{
        ErrorCode::resource_exhausted,
        std::to_string(push_bytes) + " bytes of push constants; " + info.name + " has " + std::to_string(most),
        {}};
  }
  auto objects = std::make_shared<PipelineObjects>(std::move(device), push_bytes, stages);
  const VkPushConstantRange range{stages, 0, push_bytes};
  auto create = vulkan_struct<VkPipelineLayoutCreateInfo>(VK_STRUCTURE_TYPE_PIPELINE_LAYOUT_CREATE_INFO);
  create.pushConstantRangeCount = push_bytes > 0 ? 1 : 0;
  create.pPushConstantRanges = &range;
  Device& made_by = *objects->device;
  if (const VkResult result =
          made_by.api().vkCreatePipelineLayout(made_by.handle(), &create, nullptr, &objects->layout);
      result != VK_SUCCESS) {
    return vulkan_error(made_by, result, "vkCreatePipelineLayout");
  }
  return objects;
}

PipelineObjects::~PipelineObjects() {
  if (device->lost()) return;  // its work may still use them
  device->api().vkDestroyPipeline(device->handle(), pipeline, nullptr);
  device->api().vkDestroyPipelineLayout(device->handle(), layout, nullptr);
}

void PipelineObjects::bind(VkCommandBuffer commands, VkPipelineBindPoint point, std::span<const std::byte> push) const {
  HELIO_CHECK(push.size() == push_bytes);
  const VolkDeviceTable& api = device->api();
  api.vkCmdBindPipeline(commands, point, pipeline);
  if (push_bytes > 0) api.vkCmdPushConstants(commands, layout, stages, 0, push_bytes, push.data());
}

}  // namespace helio::vulkan
