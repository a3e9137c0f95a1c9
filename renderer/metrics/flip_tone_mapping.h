// Exposures and tone mapping of HDR-FLIP (Andersson et al. 2021).
#pragma once

#include "renderer/base/picture_view.h"
#include "renderer/metrics/flip.h"
#include "renderer/metrics/flip_color.h"

namespace helio {

// Linear RGB in [0, 1].
struct DisplayColor {
  float r = 0, g = 0, b = 0;
};

inline DisplayColor clamped(float r, float g, float b) {
  return {clamp_to_display(r), clamp_to_display(g), clamp_to_display(b)};
}

// (k0 x^2 + k1 x + k2) / (k3 x^2 + k4 x + k5).
struct ToneCurve {
  float k[6];

  float operator()(float x) const { return ((k[0] * x + k[1]) * x + k[2]) / ((k[3] * x + k[4]) * x + k[5]); }
};

// Of one channel or, for Reinhard's, of the luminance.
const ToneCurve& tone_curve(FlipToneMapper mapper);

// Calls `use` with a function from radiance to DisplayColor: exposed by `factor`, tone mapped.
template <class Use>
void with_tone_mapping(FlipToneMapper mapper, double factor, const Use& use) {
  // At 1e6 all curves are within 1e-5 of their limits, and squares are far from overflow.
  const auto exposed = [factor](float radiance) {
    const double value = radiance * factor;
    return float(value < 0 ? 0 : value > 1e6 ? 1e6 : value);
  };
  const ToneCurve curve = tone_curve(mapper);
  if (mapper == FlipToneMapper::reinhard) {
    use([exposed](float r, float g, float b) {
      const float er = exposed(r), eg = exposed(g), eb = exposed(b);
      const float scale = 1 / (1 + 0.2126f * er + 0.7152f * eg + 0.0722f * eb);
      return clamped(er * scale, eg * scale, eb * scale);
    });
  } else {
    use([exposed, curve](float r, float g, float b) {
      return clamped(curve(exposed(r)), curve(exposed(g)), curve(exposed(b)));
    });
  }
}

struct FlipExposures {
  double start = 0, stop = 0;  // in stops
  int count = 2;
};

// Of a reference of finite values: see hdr_flip.
FlipExposures flip_exposures(const PictureView& reference, FlipToneMapper mapper);

}  // namespace helio
