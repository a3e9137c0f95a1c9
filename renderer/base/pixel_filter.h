// Reconstruction filters: of what part of the picture plane a pixel is the weighted mean.
#pragma once

#include <cstdint>

namespace helio {

enum class PixelFilterKind : std::uint8_t {
  box,       // the pixel's square
  tent,      // 1 - |x| / scale along either axis
  gaussian,  // standard deviation `scale` along either axis, cut off at four of it and lowered to end there at 0
};

struct PixelFilter {
  PixelFilterKind kind = PixelFilterKind::box;
  double scale = 1;  // pixels, (0, kMaxPixelFilterScale]; the box has none

  bool operator==(const PixelFilter&) const = default;
};

inline constexpr double kMaxPixelFilterScale = 16;

// As Mitsuba 3 has them (plugins tent and gaussian).
constexpr double default_pixel_filter_scale(PixelFilterKind kind) {
  return kind == PixelFilterKind::gaussian ? 0.5 : 1;
}

}  // namespace helio
