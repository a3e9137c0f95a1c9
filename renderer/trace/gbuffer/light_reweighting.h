// How a pixel's light compares between two views of its surface, by a few directions that the light came from.
//
// What the pixel shows is F = M + G: M what diffuse bases send, which look alike from everywhere, G what lobes send
// that depend on the view. The directions k were picked in proportion to what they count, q_k = g_k + kMatte m_k of the
// earlier view, and of all of F what counts is Q = counting(share) (DirectionReservoir), so that
//   F_new / F_old = (1 - share) M_new / M_old + share + Q mean_k (g_k,new - g_k,old) / q_k,old,
// with M_new / M_old = sum_k m_k,new / q_k,old over sum_k m_k,old / q_k,old, exact where m is a function of wo times
// one of wi. So directions scatter only what lobes do, and where the view changes nothing the ratio is 1 to the bit.
// Lobes alone would leave kMatte out, and divide by what is next to nothing where a lobe is yet to come.
#pragma once

#include <algorithm>
#include <cstddef>

#include "renderer/base/math.h"
#include "renderer/trace/gbuffer/view_reweighting.h"
#include "renderer/trace/gbuffer/weighed_directions.h"

namespace helio {

// What a surface sends of light from one direction, f |cos|, and what of that diffuse bases do.
struct SeenLight {
  Rgb all, matte;

  Rgb lobes() const {
    const Rgb rest = all - matte;  // but for rounding not below 0
    return {std::max(rest.x, 0.0f), std::max(rest.y, 0.0f), std::max(rest.z, 0.0f)};
  }
};

class LightReweighting {
 public:
  // light: luminance of what the directions stand for, > 0 where they weigh anything.
  explicit LightReweighting(double light) : light_(light) {}

  // A direction of that weight (WeighedDirection), and how both views see it; what sends more than kMostRatio times
  // what it did to the earlier one counts as that. Returns what it counts now, over what it did; negative: the earlier
  // view sees nothing of it, it tells nothing, as of add_unknown(). At most kMostWeighed.
  float add(float weight, const SeenLight& before, const SeenLight& now);
  void add_unknown(float weight) { unknown_ += light_ > 0 ? double(weight) / light_ : 0.0; }

  // Sets lit, directions, change, off, scatter and unknown.
  void tell(ViewEvidence& evidence) const;

 private:
  struct Known {
    double part, off;
  };

  double light_;
  // All over the light.
  double known_ = 0, unknown_ = 0, off_ = 0;
  V3d lobes_now_{0, 0, 0}, lobes_before_{0, 0, 0}, matte_now_{0, 0, 0}, matte_before_{0, 0, 0};
  Known each_[kMostWeighed];
  std::size_t count_ = 0;
};

}  // namespace helio
