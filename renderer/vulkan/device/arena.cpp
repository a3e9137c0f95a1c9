#include "renderer/vulkan/device/arena.h"

#include <algorithm>
#include <cstring>
#include <utility>

namespace helio::vulkan {

namespace {

constexpr std::uint64_t kSmallestBlock = 16u << 20, kLargestGrowth = 256u << 20, kStaging = 16u << 20;  // bytes

std::uint64_t align_up(std::uint64_t value, std::uint64_t alignment) {
  return (value + alignment - 1) & ~(alignment - 1);
}

}  // namespace

Result<std::uint64_t> Arena::upload(std::span<const std::byte> data, std::uint64_t alignment, const std::string& what) {
  if (data.empty()) return std::uint64_t{0};
  auto placed = place(data.size(), alignment, what);
  if (!placed) return std::move(placed).error();
  if (Status copied = copy(*placed, data); !copied) return std::move(copied).error();
  return placed->block->address() + placed->offset;
}

Result<std::uint64_t> Arena::allocate(std::uint64_t bytes, std::uint64_t alignment, const std::string& what) {
  if (bytes == 0) return std::uint64_t{0};
  auto placed = place(bytes, alignment, what);
  if (!placed) return std::move(placed).error();
  return placed->block->address() + placed->offset;
}

Status Arena::reserve(std::uint64_t bytes) {
  const std::uint64_t most = device_->info().limits.max_allocation_bytes;
  while (bytes > 0) {
    const std::uint64_t block = std::min(bytes, most);
    if (Status added = add_block(block, "scene data"); !added) return added;
    bytes -= block;
  }
  return ok_status();
}

Result<Arena::Place> Arena::place(std::uint64_t bytes, std::uint64_t alignment, const std::string& what) {
  HELIO_CHECK(alignment > 0 && (alignment & (alignment - 1)) == 0);
  for (int attempt = 0;; ++attempt) {
    for (std::size_t i = 0; i < blocks_.size(); ++i) {
      const std::uint64_t base = blocks_[i].address();
      const std::uint64_t offset = align_up(base + ends_[i], alignment) - base;
      if (offset > blocks_[i].bytes() || bytes > blocks_[i].bytes() - offset) continue;
      used_ += offset + bytes - ends_[i];
      ends_[i] = offset + bytes;
      return Place{&blocks_[i], offset};
    }
    HELIO_CHECK(attempt == 0);
    const std::uint64_t padded = bytes + alignment - 1;
    const std::uint64_t growth = std::clamp(allocated_, kSmallestBlock, kLargestGrowth);
    if (padded < growth && add_block(growth, what)) continue;
    if (Status added = add_block(padded, what); !added) return std::move(added).error();
  }
}

Status Arena::add_block(std::uint64_t bytes, const std::string& what) {
  VkBufferUsageFlags usage = 0;
  if (device_->level() == Level::rt) usage |= VK_BUFFER_USAGE_ACCELERATION_STRUCTURE_BUILD_INPUT_READ_ONLY_BIT_KHR;
  auto block = Buffer::create(device_, bytes, Memory::device, what, usage);
  if (!block) return std::move(block).error();
  allocated_ += bytes;
  blocks_.push_back(std::move(block).value());
  ends_.push_back(0);
  return ok_status();
}

Status Arena::copy(const Place& place, std::span<const std::byte> data) {
  if (!place.block->mapped().empty()) {
    std::memcpy(place.block->mapped().data() + place.offset, data.data(), data.size());
    return ok_status();
  }
  if (!slot_) {
    auto slot = CommandSlot::create(device_);
    if (!slot) return std::move(slot).error();
    auto staging = Buffer::create(device_, kStaging, Memory::host, "a staging buffer");
    if (!staging) return std::move(staging).error();
    staging_ = std::move(staging).value();
    slot_ = std::move(slot).value();
  }
  for (std::uint64_t done = 0; done < data.size();) {
    const std::uint64_t part = std::min<std::uint64_t>(kStaging, data.size() - done);
    std::memcpy(staging_.mapped().data(), data.data() + done, part);
    const VkBufferCopy region{0, place.offset + done, part};
    const Status copied = slot_->run([&](const VolkDeviceTable& api, VkCommandBuffer commands) {
      api.vkCmdCopyBuffer(commands, staging_.handle(), place.block->handle(), 1, &region);
    });
    if (!copied) return copied;
    done += part;
  }
  return ok_status();
}

}  // namespace helio::vulkan
