// Records a command buffer, submits it and waits for it, with a time limit.
#pragma once

#include <volk.h>

#include <chrono>
#include <functional>
#include <memory>

#include "renderer/vulkan/device/device.h"

namespace helio::vulkan {

// A device that takes longer for one submission counts as lost.
inline constexpr std::chrono::milliseconds kSubmissionLimit{10000};

using Recording = std::function<void(const VolkDeviceTable&, VkCommandBuffer)>;

// A command pool with one command buffer and a fence: one submission in flight. Each worker has its own; a slot itself
// is not thread safe.
class CommandSlot {
 public:
  static Result<CommandSlot> create(std::shared_ptr<Device> device);
  CommandSlot(CommandSlot&& other) noexcept;
  CommandSlot& operator=(CommandSlot&& other) noexcept;
  ~CommandSlot();  // waits for what is in flight

  const std::shared_ptr<Device>& device() const { return device_; }

  // Records and submits. Precondition: nothing is in flight. What the commands write to memory is visible to the host
  // after wait().
  Status submit(const Recording& record);
  // Waits for the submission; fails where the device is lost or the limit passes, and the device then counts as lost.
  Status wait(std::chrono::milliseconds limit = kSubmissionLimit);
  // Submits as submit() does and waits as wait() does.
  Status run(const Recording& record, std::chrono::milliseconds limit = kSubmissionLimit);

 private:
  CommandSlot() = default;
  void destroy();

  std::shared_ptr<Device> device_;
  VkCommandPool pool_ = VK_NULL_HANDLE;
  VkCommandBuffer buffer_ = VK_NULL_HANDLE;
  VkFence fence_ = VK_NULL_HANDLE;
  bool in_flight_ = false;
};

// A barrier that makes what earlier commands wrote to memory visible to all later ones of the same queue.
void memory_barrier(const VolkDeviceTable& api, VkCommandBuffer commands);

}  // namespace helio::vulkan
