// Devices as JSON, between the probe and its caller.
#pragma once

#include <nlohmann/json.hpp>

#include <optional>

#include "renderer/vulkan/device/device_info.h"

namespace helio::vulkan {

nlohmann::json to_json(const DeviceInfo& device);
// The device that to_json() has written; absent where this is none.
std::optional<DeviceInfo> device_from_json(const nlohmann::json& json);

}  // namespace helio::vulkan
