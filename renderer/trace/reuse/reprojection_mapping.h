#pragma once

#include <cstdint>

namespace helio {

// How a new picture finds pixels of an earlier one (trace/reuse/history_view.h, trace/reuse/forward_map.h).
enum class ReprojectionMapping {
  reverse,  // each new pixel looks its centre up, between four pixels of the earlier picture
  forward,  // each pixel of the earlier picture goes to one new pixel
};

// Of forward mapping, a pixel of the film while a picture is carried over: maps of two sources, and one in the making.
inline constexpr std::uint64_t kForwardMapBytes = 24;

}  // namespace helio
