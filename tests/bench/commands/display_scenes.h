// What `display` and `denoisers` measure when no scene is named, and what they hold pictures against.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace helio::bench {

// Samples of references that are made here. Their noise is taken off.
inline constexpr std::uint32_t kDisplayReference = 1024;

inline const std::vector<std::string>& display_scenes() {
  static const std::vector<std::string> names = {
      "cornell",        "covered",   "glass",           "cornell-glossy-boxes",
      "cornell-teapot", "veach-mis", "sponza-dabrovic", "breakfast-room"};
  return names;
}

}  // namespace helio::bench
