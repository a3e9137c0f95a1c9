#pragma once

namespace helio {

// How a new picture finds pixels of an earlier one (trace/source_view.h, trace/forward_map.h).
enum class ReprojectionMapping {
  reverse,  // each new pixel looks its centre up, between four pixels of the earlier picture
  forward,  // each pixel of the earlier picture goes to one new pixel
};

}  // namespace helio
