#include "renderer/vulkan/device/commands.h"

#include <string>
#include <utility>

#include "renderer/vulkan/device/vulkan_error.h"
#include "renderer/vulkan/device/vulkan_struct.h"

namespace helio::vulkan {

Result<CommandSlot> CommandSlot::create(std::shared_ptr<Device> device) {
  if (device->lost()) return device->lost_error();
  const VolkDeviceTable& api = device->api();
  CommandSlot slot;
  slot.device_ = device;
  VkCommandPoolCreateInfo pool{VK_STRUCTURE_TYPE_COMMAND_POOL_CREATE_INFO, nullptr,
                               VK_COMMAND_POOL_CREATE_TRANSIENT_BIT, device->queue_family()};
  if (const VkResult result = api.vkCreateCommandPool(device->handle(), &pool, nullptr, &slot.pool_);
      result != VK_SUCCESS) {
    return vulkan_error(*device, result, "vkCreateCommandPool");
  }
  VkCommandBufferAllocateInfo buffer{VK_STRUCTURE_TYPE_COMMAND_BUFFER_ALLOCATE_INFO, nullptr, slot.pool_,
                                     VK_COMMAND_BUFFER_LEVEL_PRIMARY, 1};
  if (const VkResult result = api.vkAllocateCommandBuffers(device->handle(), &buffer, &slot.buffer_);
      result != VK_SUCCESS) {
    return vulkan_error(*device, result, "vkAllocateCommandBuffers");
  }
  auto fence = vulkan_struct<VkFenceCreateInfo>(VK_STRUCTURE_TYPE_FENCE_CREATE_INFO);
  if (const VkResult result = api.vkCreateFence(device->handle(), &fence, nullptr, &slot.fence_);
      result != VK_SUCCESS) {
    return vulkan_error(*device, result, "vkCreateFence");
  }
  return slot;
}

CommandSlot::CommandSlot(CommandSlot&& other) noexcept {
  *this = std::move(other);
}

CommandSlot& CommandSlot::operator=(CommandSlot&& other) noexcept {
  if (this == &other) return *this;
  destroy();
  device_ = std::move(other.device_);
  pool_ = std::exchange(other.pool_, VK_NULL_HANDLE);
  buffer_ = std::exchange(other.buffer_, VK_NULL_HANDLE);
  fence_ = std::exchange(other.fence_, VK_NULL_HANDLE);
  in_flight_ = std::exchange(other.in_flight_, false);
  return *this;
}

CommandSlot::~CommandSlot() {
  destroy();
}

void CommandSlot::destroy() {
  if (!device_) return;
  if (in_flight_) (void)wait();
  if (device_->lost()) return;  // its work may still run
  device_->api().vkDestroyFence(device_->handle(), fence_, nullptr);
  device_->api().vkDestroyCommandPool(device_->handle(), pool_, nullptr);
  device_.reset();
}

Status CommandSlot::submit(const Recording& record) {
  HELIO_CHECK(!in_flight_);
  if (device_->lost()) return device_->lost_error();
  const VolkDeviceTable& api = device_->api();
  if (const VkResult result = api.vkResetCommandPool(device_->handle(), pool_, 0); result != VK_SUCCESS)
    return vulkan_error(*device_, result, "vkResetCommandPool");
  VkCommandBufferBeginInfo begin{VK_STRUCTURE_TYPE_COMMAND_BUFFER_BEGIN_INFO, nullptr,
                                 VK_COMMAND_BUFFER_USAGE_ONE_TIME_SUBMIT_BIT, nullptr};
  if (const VkResult result = api.vkBeginCommandBuffer(buffer_, &begin); result != VK_SUCCESS)
    return vulkan_error(*device_, result, "vkBeginCommandBuffer");
  // Submissions of other slots are only ordered by barriers: this one sees all that began before it.
  memory_barrier(api, buffer_);
  record(api, buffer_);
  VkMemoryBarrier to_host{VK_STRUCTURE_TYPE_MEMORY_BARRIER, nullptr, VK_ACCESS_MEMORY_WRITE_BIT,
                          VK_ACCESS_HOST_READ_BIT};
  api.vkCmdPipelineBarrier(buffer_, VK_PIPELINE_STAGE_ALL_COMMANDS_BIT, VK_PIPELINE_STAGE_HOST_BIT, 0, 1, &to_host, 0,
                           nullptr, 0, nullptr);
  if (const VkResult result = api.vkEndCommandBuffer(buffer_); result != VK_SUCCESS)
    return vulkan_error(*device_, result, "vkEndCommandBuffer");
  if (const VkResult result = api.vkResetFences(device_->handle(), 1, &fence_); result != VK_SUCCESS)
    return vulkan_error(*device_, result, "vkResetFences");
  auto info = vulkan_struct<VkSubmitInfo>(VK_STRUCTURE_TYPE_SUBMIT_INFO);
  info.commandBufferCount = 1;
  info.pCommandBuffers = &buffer_;
  if (const VkResult result = device_->submit(info, fence_); result != VK_SUCCESS)
    return vulkan_error(*device_, result, "vkQueueSubmit");
  in_flight_ = true;
  return ok_status();
}

Status CommandSlot::wait(std::chrono::milliseconds limit) {
  if (!in_flight_) return ok_status();
  if (device_->lost()) return device_->lost_error();
  const auto nanoseconds = std::chrono::duration_cast<std::chrono::nanoseconds>(limit).count();
  const VkResult result =
      device_->api().vkWaitForFences(device_->handle(), 1, &fence_, VK_TRUE, static_cast<std::uint64_t>(nanoseconds));
  if (result == VK_TIMEOUT) {
    device_->mark_lost("no answer within " + std::to_string(limit.count()) + " ms");
    return device_->lost_error();
  }
  if (result != VK_SUCCESS) return vulkan_error(*device_, result, "vkWaitForFences");
  in_flight_ = false;
  return ok_status();
}

Status CommandSlot::run(const Recording& record, std::chrono::milliseconds limit) {
  if (Status submitted = submit(record); !submitted) return submitted;
  return wait(limit);
}

void memory_barrier(const VolkDeviceTable& api, VkCommandBuffer commands) {
  VkMemoryBarrier barrier{VK_STRUCTURE_TYPE_MEMORY_BARRIER, nullptr, VK_ACCESS_MEMORY_WRITE_BIT,
                          VK_ACCESS_MEMORY_READ_BIT | VK_ACCESS_MEMORY_WRITE_BIT};
  api.vkCmdPipelineBarrier(commands, VK_PIPELINE_STAGE_ALL_COMMANDS_BIT, VK_PIPELINE_STAGE_ALL_COMMANDS_BIT, 0, 1,
                           &barrier, 0, nullptr, 0, nullptr);
}

}  // namespace helio::vulkan
