// Tests that need a Vulkan device of some level.
#pragma once

#include <gtest/gtest.h>

#include <cstdlib>
#include <map>
#include <memory>
#include <string>

#include "renderer/vulkan/path_device.h"

namespace helio::test {

// The running test is skipped, and the skip says what is missing. Where HELIOGRAPH_REQUIRE_VULKAN is "compute" or "rt",
// tests of that level and below it fail instead. To be called as the last thing of SetUp().
inline void miss_level(vulkan::Level level, const std::string& why) {
  const char* required = std::getenv("HELIOGRAPH_REQUIRE_VULKAN");
  const Result<vulkan::Level> least = vulkan::read_level(required ? required : "");
  ASSERT_TRUE(least.ok()) << "HELIOGRAPH_REQUIRE_VULKAN: " << least.error().to_string();
  ASSERT_LT(*least, level) << why;
  GTEST_SKIP() << "needs path tracing by " << vulkan::level_name(level) << ": " << why;
}

// The first device, opened for just this level, once a process. Null, with miss_level(), where there is none.
inline std::shared_ptr<vulkan::PathDevice> device_of(vulkan::Level level) {
  static std::map<vulkan::Level, Result<std::shared_ptr<vulkan::PathDevice>>> opened;
  auto found = opened.find(level);
  if (found == opened.end()) found = opened.emplace(level, vulkan::PathDevice::open(0, level)).first;
  const Result<std::shared_ptr<vulkan::PathDevice>>& device = found->second;
  if (device.ok() && (*device)->level() == level) return *device;
  miss_level(level,
             device.ok() ? (*device)->info().name + ": " + (*device)->info().reason : device.error().to_string());
  return nullptr;
}

}  // namespace helio::test
