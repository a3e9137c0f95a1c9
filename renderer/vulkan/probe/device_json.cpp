#include "renderer/vulkan/probe/device_json.h"

#include <string>

namespace helio::vulkan {

namespace {

using nlohmann::json;

template <class Text>
std::string printable(const Text& text) {  // drivers may name devices in any bytes
  std::string copy(text);
  for (char& c : copy) {
    if (static_cast<unsigned char>(c) < 0x20 || static_cast<unsigned char>(c) > 0x7e) c = '?';
  }
  return copy;
}

template <class Number>
bool read(const json& from, const char* key, Number& number) {
  const auto found = from.find(key);
  if (found == from.end() || !found->is_number_unsigned()) return false;
  number = found->template get<Number>();
  return true;
}

bool read(const json& from, const char* key, std::string& text) {
  const auto found = from.find(key);
  if (found == from.end() || !found->is_string()) return false;
  text = found->get<std::string>();
  return true;
}

bool read(const json& from, const char* key, std::uint32_t (&numbers)[3]) {
  const auto found = from.find(key);
  if (found == from.end() || !found->is_array() || found->size() != 3) return false;
  for (std::size_t k = 0; k < 3; ++k) {
    if (!(*found)[k].is_number_unsigned()) return false;
    numbers[k] = (*found)[k].get<std::uint32_t>();
  }
  return true;
}

}  // namespace

json to_json(const DeviceInfo& device) {
  const DeviceLimits& limits = device.limits;
  return {{"index", static_cast<unsigned>(device.index)},
          {"name", printable(device.name)},
          {"driver", printable(device.driver)},
          {"driver_uuid", device.driver_uuid},
          {"device_uuid", device.device_uuid},
          {"driver_version", device.driver_version},
          {"api_version", device.api_version},
          {"type", device.type},
          {"level", level_name(device.level)},
          {"reason", printable(device.reason)},
          {"heap_bytes", limits.heap_bytes},
          {"max_allocation_bytes", limits.max_allocation_bytes},
          {"max_push_constant_bytes", limits.max_push_constant_bytes},
          {"max_group_size", limits.max_group_size},
          {"max_group_invocations", limits.max_group_invocations},
          {"max_group_count", limits.max_group_count},
          {"max_primitives", limits.max_primitives},
          {"max_instances", limits.max_instances},
          {"max_rays", limits.max_rays}};
}

std::optional<DeviceInfo> device_from_json(const json& from) {
  if (!from.is_object()) return std::nullopt;
  DeviceInfo device;
  DeviceLimits& limits = device.limits;
  std::string level;
  if (!read(from, "index", device.index) || device.index < 0 || !read(from, "name", device.name) ||
      !read(from, "driver", device.driver) || !read(from, "driver_uuid", device.driver_uuid) ||
      !read(from, "device_uuid", device.device_uuid) || !read(from, "driver_version", device.driver_version) ||
      !read(from, "api_version", device.api_version) || !read(from, "type", device.type) ||
      !read(from, "level", level) || !read(from, "reason", device.reason) ||
      !read(from, "heap_bytes", limits.heap_bytes) ||
      !read(from, "max_allocation_bytes", limits.max_allocation_bytes) ||
      !read(from, "max_push_constant_bytes", limits.max_push_constant_bytes) ||
      !read(from, "max_group_size", limits.max_group_size) ||
      !read(from, "max_group_invocations", limits.max_group_invocations) ||
      !read(from, "max_group_count", limits.max_group_count) || !read(from, "max_primitives", limits.max_primitives) ||
      !read(from, "max_instances", limits.max_instances) || !read(from, "max_rays", limits.max_rays)) {
    return std::nullopt;
  }
  const auto known = read_level(level);
  if (!known) return std::nullopt;
  device.level = *known;
  return device;
}

}  // namespace helio::vulkan
