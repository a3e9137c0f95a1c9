#include "renderer/vulkan/device/buffer.h"

#include <utility>

#include "renderer/vulkan/device/vulkan_error.h"
#include "renderer/vulkan/device/vulkan_struct.h"

namespace helio::vulkan {

namespace {

int choose_memory_type(const Device& device, std::uint32_t types, Memory memory) {
  constexpr VkMemoryPropertyFlags kLocal = VK_MEMORY_PROPERTY_DEVICE_LOCAL_BIT,
                                  kHost = VK_MEMORY_PROPERTY_HOST_VISIBLE_BIT | VK_MEMORY_PROPERTY_HOST_COHERENT_BIT,
                                  kCached = VK_MEMORY_PROPERTY_HOST_CACHED_BIT;
  if (memory == Memory::host) {
    const int cached = device.memory_type(types, kHost | kCached);
    return cached >= 0 ? cached : device.memory_type(types, kHost);
  }
  if (device.host_visible()) {
    if (const int direct = device.memory_type(types, kLocal | kHost); direct >= 0) return direct;
  }
  return device.memory_type(types, kLocal);
}

}  // namespace

Result<Buffer> Buffer::create(std::shared_ptr<Device> device, std::uint64_t bytes, Memory memory,
                              const std::string& what, VkBufferUsageFlags usage) {
  HELIO_CHECK(bytes > 0);
  if (device->lost()) return device->lost_error();
  // Before the driver is asked, because some take the size modulo 2^32.
  if (const std::uint64_t most = device->info().limits.max_allocation_bytes; bytes > most) {
    if (Status refused = device->count_allocation(bytes, what); !refused) return std::move(refused).error();
  }
  const VolkDeviceTable& api = device->api();
  Buffer buffer;
  buffer.device_ = device;
  auto create = vulkan_struct<VkBufferCreateInfo>(VK_STRUCTURE_TYPE_BUFFER_CREATE_INFO);
  create.size = bytes;
  create.usage = usage | VK_BUFFER_USAGE_TRANSFER_SRC_BIT | VK_BUFFER_USAGE_TRANSFER_DST_BIT |
                 VK_BUFFER_USAGE_STORAGE_BUFFER_BIT | VK_BUFFER_USAGE_SHADER_DEVICE_ADDRESS_BIT;
  const std::string size = std::to_string(bytes) + " bytes for " + what;
  if (const VkResult result = api.vkCreateBuffer(device->handle(), &create, nullptr, &buffer.buffer_);
      result != VK_SUCCESS) {
    return vulkan_error(*device, result, "vkCreateBuffer of " + size);
  }
  VkMemoryRequirements needed;
  api.vkGetBufferMemoryRequirements(device->handle(), buffer.buffer_, &needed);
  const int type = choose_memory_type(*device, needed.memoryTypeBits, memory);
  if (type < 0) return Error{ErrorCode::unavailable, device->info().name + " has no memory type for " + what, {}};
  if (device->counts_against_heap(type)) {
    if (Status counted = device->count_allocation(needed.size, what); !counted) return std::move(counted).error();
    buffer.counted_ = needed.size;
  }
  auto flags = vulkan_struct<VkMemoryAllocateFlagsInfo>(VK_STRUCTURE_TYPE_MEMORY_ALLOCATE_FLAGS_INFO);
  flags.flags = VK_MEMORY_ALLOCATE_DEVICE_ADDRESS_BIT;
  VkMemoryAllocateInfo allocate{VK_STRUCTURE_TYPE_MEMORY_ALLOCATE_INFO, &flags, needed.size,
                                static_cast<std::uint32_t>(type)};
  if (const VkResult result = api.vkAllocateMemory(device->handle(), &allocate, nullptr, &buffer.memory_);
      result != VK_SUCCESS) {
    return vulkan_error(*device, result, "vkAllocateMemory of " + size);
  }
  if (const VkResult result = api.vkBindBufferMemory(device->handle(), buffer.buffer_, buffer.memory_, 0);
      result != VK_SUCCESS) {
    return vulkan_error(*device, result, "vkBindBufferMemory of " + size);
  }
  if (memory == Memory::host || device->host_visible()) {
    void* mapped = nullptr;
    if (const VkResult result = api.vkMapMemory(device->handle(), buffer.memory_, 0, VK_WHOLE_SIZE, 0, &mapped);
        result != VK_SUCCESS) {
      return vulkan_error(*device, result, "vkMapMemory of " + size);
    }
    buffer.mapped_ = static_cast<std::byte*>(mapped);
  }
  VkBufferDeviceAddressInfo address{VK_STRUCTURE_TYPE_BUFFER_DEVICE_ADDRESS_INFO, nullptr, buffer.buffer_};
  buffer.address_ = api.vkGetBufferDeviceAddress(device->handle(), &address);
  buffer.bytes_ = bytes;
  return buffer;
}

Buffer::Buffer(Buffer&& other) noexcept {
  *this = std::move(other);
}

Buffer& Buffer::operator=(Buffer&& other) noexcept {
  if (this == &other) return *this;
  destroy();
  device_ = std::move(other.device_);
  buffer_ = std::exchange(other.buffer_, VK_NULL_HANDLE);
  memory_ = std::exchange(other.memory_, VK_NULL_HANDLE);
  address_ = std::exchange(other.address_, 0);
  bytes_ = std::exchange(other.bytes_, 0);
  counted_ = std::exchange(other.counted_, 0);
  mapped_ = std::exchange(other.mapped_, nullptr);
  return *this;
}

Buffer::~Buffer() {
  destroy();
}

void Buffer::destroy() {
  if (!device_ || device_->lost()) return;  // work of a lost device may still use it
  device_->api().vkDestroyBuffer(device_->handle(), buffer_, nullptr);
  device_->api().vkFreeMemory(device_->handle(), memory_, nullptr);
  device_->release_allocation(counted_);
  device_.reset();
}

}  // namespace helio::vulkan
