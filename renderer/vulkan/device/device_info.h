// What Vulkan devices there are and what they can do, as plain values: needs neither Vulkan's headers nor a driver.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "renderer/base/result.h"

namespace helio::vulkan {

// How a device traces paths; each level includes those before it.
enum class Level : std::uint8_t {
  none,     // not at all
  compute,  // compute shaders with our own BVH
  rt,       // VK_KHR_ray_tracing_pipeline
};
std::string_view level_name(Level level);  // "", "compute", "rt"
Result<Level> read_level(std::string_view name);

struct DeviceLimits {
  std::uint64_t heap_bytes = 0;            // of the largest heap that is local to the device
  std::uint64_t max_allocation_bytes = 0;  // of one allocation; at most heap_bytes
  std::uint32_t max_push_constant_bytes = 0;
  std::uint32_t max_group_size[3] = {};  // invocations of a compute workgroup
  std::uint32_t max_group_invocations = 0;
  std::uint32_t max_group_count[3] = {};  // workgroups of a dispatch
  std::uint64_t max_primitives = 0;       // of a bottom-level acceleration structure; 0 below Level::rt
  std::uint64_t max_instances = 0;        // of a top-level acceleration structure; 0 below Level::rt
  std::uint64_t max_rays = 0;             // of one vkCmdTraceRaysKHR; 0 below Level::rt
};

struct DeviceInfo {
  int index = 0;  // in the order of vkEnumeratePhysicalDevices; N of `vulkan:N`
  std::string name;
  std::string driver;       // its name and version, e.g. "llvmpipe, Mesa 22.3.6 (LLVM 15.0.6)"
  std::string driver_uuid;  // 32 hexadecimal digits, as is device_uuid
  std::string device_uuid;
  std::uint32_t driver_version = 0;  // as the driver encodes it
  std::string api_version;           // of Vulkan, e.g. "1.3.230"
  std::string type;                  // "cpu", "integrated", "discrete", "virtual" or "other"
  // Found by the features that the driver reports; the probe lowers it to what a self-test confirms.
  Level level = Level::none;
  std::string reason;  // a clause why `level` is no higher; "" at Level::rt
  DeviceLimits limits;
};

// The devices of this machine. An empty list has a reason.
struct DeviceList {
  std::vector<DeviceInfo> devices;
  std::string reason;  // why there are none, e.g. "built without Vulkan"; "" where there are some
  bool late = false;   // the probe's time limit ended it: more time may find more
};

}  // namespace helio::vulkan
