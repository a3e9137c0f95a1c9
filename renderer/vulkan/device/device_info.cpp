#include "renderer/vulkan/device/device_info.h"

namespace helio::vulkan {

std::string_view level_name(Level level) {
  switch (level) {
    case Level::none:
      return "";
    case Level::compute:
      return "compute";
    case Level::rt:
      return "rt";
  }
  return "";
}

Result<Level> read_level(std::string_view name) {
  for (const Level level : {Level::none, Level::compute, Level::rt}) {
    if (name == level_name(level)) return level;
  }
  return Error{ErrorCode::invalid_argument, "'" + std::string(name) + "'; allowed: compute, rt", {}};
}

}  // namespace helio::vulkan
