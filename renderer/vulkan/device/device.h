// A Vulkan device, opened for one level of path tracing.
#pragma once

#include <volk.h>

#include <atomic>
#include <cstdint>
#include <memory>
#include <mutex>
#include <string>

#include "renderer/base/result.h"
#include "renderer/vulkan/device/device_info.h"

namespace helio::vulkan {

struct DeviceOptions {
  int index = 0;            // DeviceInfo::index
  Level level = Level::rt;  // the highest level to open; a device that has less is opened for what it has
  bool validation = false;  // with VK_LAYER_KHRONOS_validation; see validation_message_count()
  // For tests: data goes through staging buffers even where the host sees the device's memory.
  bool staging = false;
};

struct RayPipelineLimits {
  std::uint32_t handle_size = 0, handle_alignment = 0, base_alignment = 0, scratch_alignment = 0, max_recursion = 0;
};

// Owns instance, device and queue. Thread safe, except for what api() is called with: Vulkan's rules say what must be
// synchronised. A device that was lost, or did not answer in time, is never used again: every call that would submit
// work fails with lost_error(), and nothing that its work may still touch is freed.
class Device {
 public:
  // Fails where there is no loader, no driver, no such device, or where the device has no level; the message says
  // which feature is missing.
  static Result<std::shared_ptr<Device>> open(const DeviceOptions& options = {});
  ~Device();
  Device(const Device&) = delete;

  const DeviceInfo& info() const { return info_; }
  Level level() const { return level_; }                               // what it was opened for
  const RayPipelineLimits& ray_limits() const { return ray_limits_; }  // zeros below Level::rt

  VkDevice handle() const { return device_; }
  VkPhysicalDevice physical() const { return physical_; }
  std::uint32_t queue_family() const { return queue_family_; }
  const VolkDeviceTable& api() const { return api_; }

  // Submits to the device's one queue; calls of several threads take turns.
  VkResult submit(const VkSubmitInfo& info, VkFence fence);

  bool lost() const { return lost_.load(std::memory_order_acquire); }
  void mark_lost(std::string why);  // the first reason counts
  Error lost_error() const;

  // Memory of the device that buffers hold at present. An allocation counts itself first, and is refused with
  // limits and sizes in the message where one allocation or all of them would be too large. `what`: names the data.
  Status count_allocation(std::uint64_t bytes, const std::string& what);
  void release_allocation(std::uint64_t bytes) { allocated_.fetch_sub(bytes); }
  std::uint64_t allocated_bytes() const { return allocated_.load(); }

  // The index of a memory type that has all of `required` and is among `types`, or -1.
  int memory_type(std::uint32_t types, VkMemoryPropertyFlags required) const;
  bool counts_against_heap(int type) const;  // whether memory of this type is of the heap of DeviceLimits::heap_bytes
  // Whether the host writes the device's own memory directly: integrated and software devices, resizable BAR.
  bool host_visible() const { return host_visible_; }

 private:
  Device() = default;

  DeviceInfo info_;
  Level level_ = Level::none;
  RayPipelineLimits ray_limits_;
  VkPhysicalDevice physical_ = VK_NULL_HANDLE;
  VkDevice device_ = VK_NULL_HANDLE;
  VkQueue queue_ = VK_NULL_HANDLE;
  std::uint32_t queue_family_ = 0;
  VolkDeviceTable api_{};
  VkPhysicalDeviceMemoryProperties memory_{};
  bool host_visible_ = false;
  std::mutex queue_mutex_;
  std::atomic<bool> lost_{false};
  mutable std::mutex lost_mutex_;
  std::string lost_reason_;
  std::atomic<std::uint64_t> allocated_{0};
};

// How many messages the validation layer has given in this process, and the first of them; for tests.
int validation_message_count();
std::string first_validation_message();

}  // namespace helio::vulkan
