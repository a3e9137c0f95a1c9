// Temporal upsampling, in place of the network of Mrad 2022, section 4.3, from the same inputs: colours whose samples are
// jittered, and motion.
//
// Yang, Liu, Salvi 2020, "A Survey of Temporal Antialiasing Techniques", section 5.1: of the new colour a pixel takes
// alpha beta, beta the nearer to 1 the nearer the sample is; the history is kept within the colours around (section 4).
#pragma once

#include <vector>

#include "renderer/base/math.h"
#include "renderer/preview/paper/retention.h"

namespace helio {

// A picture at the render resolution.
struct UpscalingInput {
  const std::vector<Rgb>& colors;
  const std::vector<V2f>& motion;  // to where the pixel was, its pixels
  int width = 0, height = 0;
  PixelRect region;
  double scale_x = 1, scale_y = 1;  // its pixels over the film's
  // Pixels whose centres are so near to a point are samples at the jitter; others have been anti-aliased.
  SubpixelJitter jitter = {};
  double x = 0, y = 0, jittered_radius = 0;
};

// Pixels of a window of the film's region. history: of the film before; null: none. Thread safe for different windows.
void upscale(const UpscalingInput& in, const PixelRect& window, const PixelRect& film_region, int film_width,
             const std::vector<Rgb>* history, std::vector<Rgb>& to);

}  // namespace helio
