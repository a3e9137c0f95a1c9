// A Vulkan device for tests, opened once a process.
#pragma once

#include <gtest/gtest.h>

#include <cstdlib>
#include <memory>
#include <string>

#include "renderer/vulkan/device/device.h"

namespace helio::test {

// Tests that need a device of some level are skipped where there is none, and the skip says what is missing. Where
// HELIOGRAPH_REQUIRE_VULKAN is "compute" or "rt", tests of that level and below it fail instead.
class DeviceTest : public ::testing::Test {
 protected:
  explicit DeviceTest(vulkan::Level level = vulkan::Level::compute) : level_(level) {}

  void SetUp() override {
    const Result<std::shared_ptr<vulkan::Device>>& opened = open();
    if (opened && (*opened)->level() >= level_) {
      device_ = *opened;
      return;
    }
    const std::string why =
        opened ? (*opened)->info().name + ": " + (*opened)->info().reason : opened.error().to_string();
    const char* required = std::getenv("HELIOGRAPH_REQUIRE_VULKAN");
    const Result<vulkan::Level> least = vulkan::read_level(required ? required : "");
    ASSERT_TRUE(least.ok()) << "HELIOGRAPH_REQUIRE_VULKAN: " << least.error().to_string();
    ASSERT_LT(*least, level_) << why;
    GTEST_SKIP() << "needs path tracing by " << level_name(level_) << ": " << why;
  }

  // Null in SetUp() of derived classes where the test does not run.
  const std::shared_ptr<vulkan::Device>& device() const { return device_; }

 private:
  static const Result<std::shared_ptr<vulkan::Device>>& open() {
    static const Result<std::shared_ptr<vulkan::Device>> device = vulkan::Device::open();
    return device;
  }

  vulkan::Level level_;
  std::shared_ptr<vulkan::Device> device_;
};

}  // namespace helio::test
