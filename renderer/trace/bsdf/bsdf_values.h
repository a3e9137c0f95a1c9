// What a BSDF answers: a value with its density, and a sampled direction.
#pragma once

#include <algorithm>
#include <cmath>

#include "renderer/base/math.h"

namespace helio {

struct BsdfSample {
  V3f wi{0, 0, 0};
  Rgb weight{0, 0, 0};  // f |cos| / pdf for the chosen technique: the path's throughput factor
  float pdf_w = 0;      // solid angle density of the whole non-delta mixture at wi; probability of the lobe for deltas
  float eta = 1;        // 1, or the relative ior crossed (for throughput in roulette)
  bool delta = false;
  bool transmitted = false;  // went to the other side of the surface

  bool valid() const { return pdf_w > 0; }
};

struct BsdfValue {
  Rgb f_cos{0, 0, 0};  // f(wo, wi) |cos wi|, deltas excluded
  float pdf_w = 0;     // density with which sampling picks wi given that it may pick any lobe, deltas excluded
};

// The values for a pair of directions: `there` for (wo, wi), `back` for (wi, wo).
struct BsdfBothWays {
  BsdfValue there, back;
};

// The sample that a direction makes whose value and density are known; none where the density is 0 or not finite.
inline BsdfSample sample_of(const V3f& wi, const BsdfValue& value) {
  BsdfSample sample;
  if (!(value.pdf_w > 0) || !std::isfinite(value.pdf_w)) return sample;
  sample.wi = wi;
  sample.weight = value.f_cos / value.pdf_w;
  sample.pdf_w = value.pdf_w;
  return sample;
}

// The view-dependent share of the luminance of f_cos, [0, 1], given its diffuse part `matte`.
inline float varying_share(const Rgb& f_cos, const Rgb& matte) {
  const float all = luminance(f_cos);
  return all > 0 ? std::clamp(1 - luminance(matte) / all, 0.0f, 1.0f) : 1.0f;
}

}  // namespace helio
