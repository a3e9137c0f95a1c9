// Exposures and tone mapping of HDR-FLIP (Andersson et al. 2021, "Visualizing Errors in Rendered High Dynamic Range
// Images", "Computing Start and Stop Exposures").
#pragma once

#include <functional>
#include <optional>

#include "renderer/base/picture_view.h"
#include "renderer/metrics/flip_options.h"

namespace helio {

// (k0 x^2 + k1 x + k2) / (k3 x^2 + k4 x + k5), the rational polynomial of Andersson et al. 2021.
struct ToneCurve {
  float k[6];

  float operator()(float x) const { return ((k[0] * x + k[1]) * x + k[2]) / ((k[3] * x + k[4]) * x + k[5]); }
};

// Of one channel or, for Reinhard's, of the luminance.
const ToneCurve& tone_curve(FlipToneMapper mapper);

// How radiance becomes the linear RGB in [0, 1] that the display shows.
struct FlipDisplay {
  std::optional<FlipToneMapper> tone_mapper;  // none: values are clamped (LDR-FLIP)
  double factor = 1;                          // that radiance is multiplied with before tone mapping
};

// Writes row y as it is displayed to three arrays of as many values as the picture is wide.
using FlipRows = std::function<void(int y, float* const* color)>;
FlipRows displayed_rows(const PictureView& picture, const FlipDisplay& display);

struct FlipExposures {
  double start = 0, stop = 0;  // in stops
  int count = 2;

  // Exposures that differ: one where start and stop are the same.
  int different() const { return stop > start ? count : 1; }
  double factor(int exposure) const;  // of the exposure-th, [0, count)
};

// Of a reference of finite values: see hdr_flip.
FlipExposures flip_exposures(const PictureView& reference, FlipToneMapper mapper);

}  // namespace helio
