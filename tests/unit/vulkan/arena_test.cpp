// The memory of a scene: addresses, contents, and what is refused.
#include "renderer/vulkan/device/arena.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>
#include <vector>

#include "tests/unit/vulkan/kernels.h"
#include "tests/unit/vulkan/test_device.h"

namespace helio::test {
namespace {

using vulkan::Arena;
using vulkan::Device;

class VulkanArena : public DeviceTest {};

void expect_sums(const std::shared_ptr<Device>& device, std::initializer_list<std::uint32_t> counts) {
  Arena arena(device);
  std::vector<std::uint64_t> addresses;
  for (const std::uint32_t count : counts) {
    std::vector<std::uint32_t> numbers(count);
    std::iota(numbers.begin(), numbers.end(), count);
    const auto at = arena.upload_vector(numbers, "numbers");
    ASSERT_TRUE(at.ok()) << at.error().to_string();
    EXPECT_EQ(*at % 16, 0u);
    addresses.push_back(*at);
  }
  std::size_t i = 0;
  for (const std::uint64_t count : counts) {
    const std::uint64_t last = std::min<std::uint64_t>(count, 1000), first = 2 * count - last;
    const auto sum = sum_on_device(device, addresses[i++] + 4 * (count - last), std::uint32_t(last));
    ASSERT_TRUE(sum.ok()) << sum.error().to_string();
    EXPECT_EQ(*sum, last * first + last * (last - 1) / 2) << count;
  }
}

// 12,000,000 numbers are more than one block, and than one staging buffer.
TEST_F(VulkanArena, HoldsWhatWasUploaded) {
  expect_sums(device(), {1, 3, 1000, 12'000'000, 7});
}

TEST_F(VulkanArena, HoldsWhatWentThroughStagingBuffers) {
  vulkan::DeviceOptions options;
  options.staging = true;
  const auto staged = Device::open(options);
  ASSERT_TRUE(staged.ok()) << staged.error().to_string();
  EXPECT_FALSE((*staged)->host_visible());
  expect_sums(*staged, {1, 3, 1000, 12'000'000, 7});
}

TEST_F(VulkanArena, AlignsAndCounts) {
  Arena arena(device());
  EXPECT_EQ(*arena.upload({}, 8, "nothing"), 0u);
  EXPECT_EQ(arena.bytes(), 0u);
  EXPECT_EQ(arena.allocated_bytes(), 0u);
  const std::uint64_t before = device()->allocated_bytes();
  const std::vector<std::byte> bytes(13);
  const auto first = arena.upload(bytes, 1, "bytes"), second = arena.upload(bytes, 256, "bytes");
  ASSERT_TRUE(first.ok() && second.ok());
  EXPECT_GE(*second, *first + 13);
  EXPECT_EQ(*second % 256, 0u);
  EXPECT_EQ(arena.bytes(), *second + 13 - *first);
  EXPECT_GE(arena.allocated_bytes(), arena.bytes());
  EXPECT_GE(device()->allocated_bytes(), before + arena.allocated_bytes());
}

TEST_F(VulkanArena, ReservedMemoryIsUsedAndFreed) {
  const std::uint64_t before = device()->allocated_bytes();
  {
    Arena arena(device());
    ASSERT_TRUE(arena.reserve(100'000'000).ok());
    EXPECT_EQ(arena.allocated_bytes(), 100'000'000u);
    ASSERT_TRUE(arena.allocate(60'000'000, 16, "texels").ok());
    ASSERT_TRUE(arena.allocate(39'000'000, 16, "texels").ok());
    EXPECT_EQ(arena.allocated_bytes(), 100'000'000u);
  }
  EXPECT_EQ(device()->allocated_bytes(), before);
}

TEST_F(VulkanArena, RefusesMoreThanOneAllocationHolds) {
  Arena arena(device());
  const std::uint64_t most = device()->info().limits.max_allocation_bytes;
  const auto refused = arena.allocate(most + 4, 4, "texels of 'sky.exr'");
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().code, ErrorCode::resource_exhausted);
  EXPECT_NE(refused.error().message.find("texels of 'sky.exr': "), std::string::npos) << refused.error().message;
  EXPECT_NE(refused.error().message.find(" allocates at most " + std::to_string(most) + " bytes at once"),
            std::string::npos)
      << refused.error().message;
  EXPECT_EQ(arena.allocated_bytes(), 0u);
}

TEST_F(VulkanArena, RefusesMoreThanTheDeviceHolds) {
  const auto full = Device::open();
  ASSERT_TRUE(full.ok()) << full.error().to_string();
  const auto& limits = (*full)->info().limits;
  std::uint64_t counted = 0;
  for (std::uint64_t left = limits.heap_bytes - (1 << 20); left > 0;) {
    const std::uint64_t part = std::min(left, limits.max_allocation_bytes);
    ASSERT_TRUE((*full)->count_allocation(part, "other data").ok());
    counted += part;
    left -= part;
  }
  Arena arena(*full);
  ASSERT_TRUE(arena.allocate(500'000, 16, "nodes").ok());
  const auto refused = arena.allocate(1'000'000, 16, "vertices");
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().code, ErrorCode::resource_exhausted);
  EXPECT_NE(refused.error().message.find(" has " + std::to_string(limits.heap_bytes) + " bytes of memory"),
            std::string::npos)
      << refused.error().message;
  (*full)->release_allocation(counted);
  EXPECT_TRUE(arena.allocate(1'000'000, 16, "vertices").ok());
}

}  // namespace
}  // namespace helio::test
