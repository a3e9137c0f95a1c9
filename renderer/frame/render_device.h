// What traces the paths of a picture: the processor, or a Vulkan device.
#pragma once

#include <charconv>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace helio {

struct RenderDevice {
  enum class Kind : std::uint8_t { cpu, vulkan };
  static constexpr int kAny = -1;  // the first that can

  Kind kind = Kind::cpu;
  int index = kAny;  // of Vulkan's devices, [0, 99]

  bool operator==(const RenderDevice&) const = default;
};

inline constexpr const char* kRenderDevices = "cpu, vulkan (the first that can), vulkan:N with N in [0, 99]";

// By its name: "cpu", "vulkan", "vulkan:N". Absent: it is none of them.
inline std::optional<RenderDevice> parse_render_device(std::string_view name) {
  if (name == "cpu") return RenderDevice{};
  RenderDevice device{RenderDevice::Kind::vulkan, RenderDevice::kAny};
  if (name == "vulkan") return device;
  constexpr std::string_view kPrefix = "vulkan:";
  if (!name.starts_with(kPrefix) || name.size() > kPrefix.size() + 2) return std::nullopt;
  const char *first = name.data() + kPrefix.size(), *last = name.data() + name.size();
  const auto [end, error] = std::from_chars(first, last, device.index);
  if (error != std::errc() || end != last || device.index < 0) return std::nullopt;
  return device;
}

inline std::string to_string(const RenderDevice& device) {
  if (device.kind == RenderDevice::Kind::cpu) return "cpu";
  return device.index == RenderDevice::kAny ? "vulkan" : "vulkan:" + std::to_string(device.index);
}

}  // namespace helio
