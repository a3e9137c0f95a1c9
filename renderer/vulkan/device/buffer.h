// One buffer in memory of its own: what the host reads back or writes often, acceleration structures, scratch memory.
// Scene data goes into an Arena.
#pragma once

#include <volk.h>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>

#include "renderer/vulkan/device/device.h"

namespace helio::vulkan {

enum class Memory : std::uint8_t {
  device,  // the device's own; mapped only where the host sees it (Device::host_visible)
  host,    // mapped, coherent; cached where there is such memory: for reading back and for staging
};

class Buffer {
 public:
  Buffer() = default;  // empty
  // `usage`: VK_BUFFER_USAGE_* besides TRANSFER_SRC, TRANSFER_DST, STORAGE_BUFFER and SHADER_DEVICE_ADDRESS, which all
  // buffers have. `what` names the data in errors. Sizes beyond the device's limits are refused. Not initialised.
  static Result<Buffer> create(std::shared_ptr<Device> device, std::uint64_t bytes, Memory memory,
                               const std::string& what, VkBufferUsageFlags usage = 0);
  Buffer(Buffer&& other) noexcept;
  Buffer& operator=(Buffer&& other) noexcept;
  ~Buffer();

  VkBuffer handle() const { return buffer_; }
  std::uint64_t address() const { return address_; }
  std::uint64_t bytes() const { return bytes_; }
  // The mapped memory, coherent; empty where it is not mapped. Aligned for any type.
  std::span<std::byte> mapped() const { return {mapped_, mapped_ ? bytes_ : 0}; }
  // The mapped memory as an array of T; empty where it is not mapped.
  template <class T>
  std::span<T> mapped_as() const {
    return {reinterpret_cast<T*>(mapped_), mapped_ ? bytes_ / sizeof(T) : 0};
  }

 private:
  void destroy();

  std::shared_ptr<Device> device_;
  VkBuffer buffer_ = VK_NULL_HANDLE;
  VkDeviceMemory memory_ = VK_NULL_HANDLE;
  std::uint64_t address_ = 0, bytes_ = 0, counted_ = 0;
  std::byte* mapped_ = nullptr;
};

}  // namespace helio::vulkan
