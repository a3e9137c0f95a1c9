// A Vulkan device for tests, opened once a process.
#pragma once

#include <gtest/gtest.h>

#include <memory>
#include <string>

#include "renderer/vulkan/device/device.h"
#include "tests/support/vulkan_level.h"

namespace helio::test {

// Skipped, or failed, by miss_level() where the device has not this level.
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
    miss_level(level_, why);
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
