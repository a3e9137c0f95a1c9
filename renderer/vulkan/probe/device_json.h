// Devices as JSON, between the probe and its caller.
#pragma once

#include <nlohmann/json.hpp>

#include <optional>

#include "renderer/vulkan/device/device_info.h"

namespace helio::vulkan {

nlohmann::json to_json(const DeviceInfo& device);
// Absent: this is no device as to_json() writes it.
std::optional<DeviceInfo> device_from_json(const nlohmann::json& json);

}  // namespace helio::vulkan
