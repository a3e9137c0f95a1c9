// The sRGB transfer function (IEC 61966-2-1), for pictures that are shown. Rendering is linear.
#pragma once

#include <algorithm>
#include <cmath>

namespace helio {

// Linear value, clamped to [0, 1] (NaN: 0), to the encoded one in [0, 1].
inline float encode_srgb(float linear) {
  const float x = std::min(std::max(0.0f, linear), 1.0f);  // max returns its first argument for NaN
  return x <= 0.0031308f ? 12.92f * x : 1.055f * std::pow(x, 1.0f / 2.4f) - 0.055f;
}

}  // namespace helio
