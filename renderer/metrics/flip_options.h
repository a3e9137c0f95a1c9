// How FLIP looks at pictures.
#pragma once

#include "renderer/base/cancel.h"

namespace helio {

// A display of 3840 pixels and 0.7 m across, seen from 0.7 m: distance x pixels / width x pi / 180 (Andersson et al.
// 2020). 67.02.
inline constexpr double kFlipPixelsPerDegree = 0.7 * (3840 / 0.7) * 3.14159265358979323846 / 180;

// Tone mappers of HDR-FLIP, on linear RGB.
enum class FlipToneMapper {
  aces,      // Narkowicz' fit with its exposure of 0.6, per channel
  hable,     // the filmic curve of Uncharted 2, white at 11.2, per channel
  reinhard,  // colour / (1 + luminance)
};

struct FlipOptions {
  double pixels_per_degree = kFlipPixelsPerDegree;    // [1, 1000]
  FlipToneMapper tone_mapper = FlipToneMapper::aces;  // of hdr_flip
  int threads = 1;                      // that exposures are shared out to, [1, 64]: the result is the same
  const CancelToken* cancel = nullptr;  // polled at every row; null: nobody cancels
};

}  // namespace helio
