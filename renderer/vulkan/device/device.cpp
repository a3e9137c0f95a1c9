#include "renderer/vulkan/device/device.h"

#include <algorithm>
#include <utility>
#include <vector>

#include "renderer/vulkan/device/describe_device.h"
#include "renderer/vulkan/device/instance.h"
#include "renderer/vulkan/device/vulkan_error.h"
#include "renderer/vulkan/device/vulkan_struct.h"

namespace helio::vulkan {

Result<std::shared_ptr<Device>> Device::open(const DeviceOptions& options) {
  auto instance = open_instance(options.validation);
  if (!instance) return std::move(instance).error();
  auto described = describe_devices(*instance);
  if (!described) return std::move(described).error();
  if (described->empty()) return Error{ErrorCode::not_found, "the Vulkan drivers find no device", {}};
  if (options.index < 0 || options.index >= static_cast<int>(described->size())) {
    return Error{ErrorCode::not_found,
                 "no Vulkan device " + std::to_string(options.index) + "; allowed: 0 to " +
                     std::to_string(described->size() - 1),
                 {}};
  }
  const DescribedDevice& chosen = (*described)[static_cast<std::size_t>(options.index)];
  if (chosen.info.level == Level::none || options.level == Level::none) {
    return Error{ErrorCode::failed_precondition, chosen.info.name + " cannot trace paths: " + chosen.info.reason, {}};
  }

  std::shared_ptr<Device> device(new Device);
  device->info_ = chosen.info;
  device->level_ = std::min(options.level, chosen.info.level);
  device->physical_ = chosen.physical;
  device->queue_family_ = static_cast<std::uint32_t>(chosen.queue_family);

  const float priority = 1;
  auto queue = vulkan_struct<VkDeviceQueueCreateInfo>(VK_STRUCTURE_TYPE_DEVICE_QUEUE_CREATE_INFO);
  queue.queueFamilyIndex = device->queue_family_;
  queue.queueCount = 1;
  queue.pQueuePriorities = &priority;
  DeviceFeatures features;
  enable_features(features, device->level_);
  const std::vector<const char*>& extensions = device_extensions(device->level_);
  auto create = vulkan_struct<VkDeviceCreateInfo>(VK_STRUCTURE_TYPE_DEVICE_CREATE_INFO, &features.core);
  create.queueCreateInfoCount = 1;
  create.pQueueCreateInfos = &queue;
  create.enabledExtensionCount = static_cast<std::uint32_t>(extensions.size());
  create.ppEnabledExtensionNames = extensions.data();
  if (const VkResult result = vkCreateDevice(device->physical_, &create, nullptr, &device->device_);
      result != VK_SUCCESS) {
    return vulkan_error(*device, result, "vkCreateDevice");
  }
  volkLoadDeviceTable(&device->api_, device->device_);
  device->api_.vkGetDeviceQueue(device->device_, device->queue_family_, 0, &device->queue_);

  vkGetPhysicalDeviceMemoryProperties(device->physical_, &device->memory_);
  // Small windows into a discrete device's memory do not count.
  constexpr VkMemoryPropertyFlags kDirect =
      VK_MEMORY_PROPERTY_DEVICE_LOCAL_BIT | VK_MEMORY_PROPERTY_HOST_VISIBLE_BIT | VK_MEMORY_PROPERTY_HOST_COHERENT_BIT;
  const int direct = device->memory_type(~0u, kDirect);
  device->host_visible_ = !options.staging && direct >= 0 &&
                          device->memory_.memoryHeaps[device->memory_.memoryTypes[direct].heapIndex].size >=
                              device->info_.limits.heap_bytes;
  if (device->level_ == Level::rt) {
    auto acceleration = vulkan_struct<VkPhysicalDeviceAccelerationStructurePropertiesKHR>(
        VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_ACCELERATION_STRUCTURE_PROPERTIES_KHR);
    auto rays = vulkan_struct<VkPhysicalDeviceRayTracingPipelinePropertiesKHR>(
        VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_RAY_TRACING_PIPELINE_PROPERTIES_KHR, &acceleration);
    auto properties = vulkan_struct<VkPhysicalDeviceProperties2>(VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_PROPERTIES_2, &rays);
    vkGetPhysicalDeviceProperties2(device->physical_, &properties);
    device->ray_limits_ = {rays.shaderGroupHandleSize, rays.shaderGroupHandleAlignment, rays.shaderGroupBaseAlignment,
                           acceleration.minAccelerationStructureScratchOffsetAlignment, rays.maxRayRecursionDepth};
  }
  return device;
}

Device::~Device() {
  // A lost device may still be running what it was given: destroying it could block for ever, or free what it uses.
  if (device_ && !lost()) api_.vkDestroyDevice(device_, nullptr);
}

VkResult Device::submit(const VkSubmitInfo& info, VkFence fence) {
  if (lost()) return VK_ERROR_DEVICE_LOST;
  const std::lock_guard lock(queue_mutex_);
  return api_.vkQueueSubmit(queue_, 1, &info, fence);
}

void Device::mark_lost(std::string why) {
  const std::lock_guard lock(lost_mutex_);
  if (lost_.load()) return;
  lost_reason_ = std::move(why);
  lost_.store(true, std::memory_order_release);
}

Error Device::lost_error() const {
  const std::lock_guard lock(lost_mutex_);
  return {ErrorCode::unavailable, info_.name + " is lost: " + lost_reason_, {}};
}

Status Device::count_allocation(std::uint64_t bytes, const std::string& what) {
  const DeviceLimits& limits = info_.limits;
  if (bytes > limits.max_allocation_bytes) {
    return Error{ErrorCode::resource_exhausted,
                 what + ": " + std::to_string(bytes) + " bytes; " + info_.name + " allocates at most " +
                     std::to_string(limits.max_allocation_bytes) + " bytes at once",
                 {}};
  }
  const std::uint64_t before = allocated_.fetch_add(bytes);
  if (bytes > limits.heap_bytes || before > limits.heap_bytes - bytes) {
    allocated_.fetch_sub(bytes);
    return Error{ErrorCode::resource_exhausted,
                 what + ": " + std::to_string(bytes) + " bytes besides " + std::to_string(before) + " in use; " +
                     info_.name + " has " + std::to_string(limits.heap_bytes) + " bytes of memory",
                 {}};
  }
  return ok_status();
}

int Device::memory_type(std::uint32_t types, VkMemoryPropertyFlags required) const {
  for (std::uint32_t i = 0; i < memory_.memoryTypeCount; ++i) {
    if ((types & (1u << i)) && (memory_.memoryTypes[i].propertyFlags & required) == required)
      return static_cast<int>(i);
  }
  return -1;
}

bool Device::counts_against_heap(int type) const {
  const VkMemoryHeap& heap = memory_.memoryHeaps[memory_.memoryTypes[type].heapIndex];
  return (heap.flags & VK_MEMORY_HEAP_DEVICE_LOCAL_BIT) && heap.size >= info_.limits.heap_bytes;
}

}  // namespace helio::vulkan
