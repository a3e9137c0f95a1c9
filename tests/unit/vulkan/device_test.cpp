// Devices: opening, submitting from several threads, and the time limit of a submission.
#include "renderer/vulkan/device/device.h"

#include <gtest/gtest.h>

#include <thread>
#include <vector>

#include "renderer/vulkan/device/arena.h"
#include "renderer/vulkan/device/self_test/self_test.h"
#include "tests/unit/vulkan/kernels.h"
#include "tests/unit/vulkan/test_device.h"

namespace helio::test {
namespace {

using vulkan::Arena;
using vulkan::Device;
using vulkan::DeviceInfo;
using vulkan::Level;

class DeviceCalls : public DeviceTest {};

TEST_F(DeviceCalls, SaysWhatItIs) {
  const DeviceInfo& info = device()->info();
  EXPECT_FALSE(info.name.empty());
  EXPECT_FALSE(info.driver.empty());
  EXPECT_EQ(info.driver_uuid.size(), 32u);
  EXPECT_EQ(info.device_uuid.size(), 32u);
  EXPECT_TRUE(info.type == "cpu" || info.type == "integrated" || info.type == "discrete" || info.type == "virtual");
  EXPECT_EQ(info.reason.empty(), info.level == Level::rt) << info.reason;
  EXPECT_GE(info.limits.heap_bytes, info.limits.max_allocation_bytes);
  EXPECT_GE(info.limits.max_allocation_bytes, 1u << 28);
  EXPECT_GE(info.limits.max_push_constant_bytes, 128u);
}

TEST_F(DeviceCalls, IsOpenedForTheLevelThatIsAsked) {
  vulkan::DeviceOptions options;
  options.level = Level::compute;
  const auto opened = Device::open(options);
  ASSERT_TRUE(opened.ok()) << opened.error().to_string();
  EXPECT_EQ((*opened)->level(), Level::compute);
  const Status passed = vulkan::test_compute(*opened);
  EXPECT_TRUE(passed.ok()) << passed.error().to_string();
}

TEST_F(DeviceCalls, NamesTheIndicesThatThereAre) {
  vulkan::DeviceOptions options;
  options.index = 1000;
  const auto opened = Device::open(options);
  ASSERT_FALSE(opened.ok());
  EXPECT_EQ(opened.error().code, ErrorCode::not_found);
  EXPECT_TRUE(opened.error().message.starts_with("no Vulkan device 1000; allowed: 0 to ")) << opened.error().message;
}

TEST_F(DeviceCalls, ThreadsSubmitAtOnce) {
  constexpr std::uint32_t kThreads = 4, kRuns = 25, kCount = 1000;
  std::vector<std::uint64_t> sums(kThreads, 0);
  std::vector<std::thread> threads;
  for (std::uint32_t t = 0; t < kThreads; ++t) {
    threads.emplace_back([&, t] {
      Arena arena(device());
      std::vector<std::uint32_t> numbers(kCount);
      for (std::uint32_t i = 0; i < kCount; ++i) numbers[i] = i + t;
      const auto at = arena.upload_vector(numbers, "numbers");
      for (std::uint32_t run = 0; at && run < kRuns; ++run) {
        const auto sum = sum_on_device(device(), *at, kCount);
        if (sum) sums[t] += *sum;
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  for (std::uint32_t t = 0; t < kThreads; ++t)
    EXPECT_EQ(sums[t], std::uint64_t(kRuns) * (kCount * (kCount - 1) / 2 + kCount * t)) << t;
}

TEST_F(DeviceCalls, LoopsEndAsTheyShouldOrAfterARoundThatIsKnown) {
  const auto limit = find_loop_limit(device());
  ASSERT_TRUE(limit.ok()) << limit.error().to_string();
  const bool debian12 = device()->info().driver.starts_with("llvmpipe, Mesa 22.3.");
  EXPECT_EQ(*limit, debian12 ? 65535u : 0u) << device()->info().driver;
}

// A dispatch cannot be cancelled: the device counts as lost and what it still does is left to it. The kernel ends after
// a few seconds, so that the driver's threads end with the process.
TEST_F(DeviceCalls, WithoutAnAnswerInTimeItIsLost) {
  auto slow = Device::open();
  ASSERT_TRUE(slow.ok()) << slow.error().to_string();
  Arena arena(*slow);
  const auto at = arena.upload_vector(std::vector<std::uint32_t>{1, 2, 3}, "numbers");
  ASSERT_TRUE(at.ok());
  ASSERT_TRUE(sum_on_device(*slow, *at, 3).ok());  // the code is there
  const Status late = spin_on_device(*slow, std::chrono::milliseconds(20));
  ASSERT_FALSE(late.ok());
  EXPECT_EQ(late.error().code, ErrorCode::unavailable);
  EXPECT_NE(late.error().message.find(" is lost: no answer within 20 ms"), std::string::npos) << late.error().message;
  EXPECT_TRUE((*slow)->lost());

  const auto again = sum_on_device(*slow, *at, 3);
  ASSERT_FALSE(again.ok());
  EXPECT_EQ(again.error().message, late.error().message);
  EXPECT_FALSE(arena.upload_vector(std::vector<std::uint32_t>(100'000'000), "more numbers").ok());
  EXPECT_FALSE(device()->lost()) << "another Device of the same driver";
}

class RayDeviceCalls : public DeviceTest {
 protected:
  RayDeviceCalls() : DeviceTest(Level::rt) {}
};

TEST_F(RayDeviceCalls, SelfTestPasses) {
  const Status passed = vulkan::test_rays(device());
  EXPECT_TRUE(passed.ok()) << passed.error().to_string();
}

}  // namespace
}  // namespace helio::test
