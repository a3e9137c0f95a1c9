// The scattering of one surface as two directions see it, which reprojection compares.
#pragma once

#include "renderer/trace/bsdf/bsdf.h"

namespace helio {

// Bsdf::evaluate() along two wo, to the bit, and Bsdf::matte(), but for rounding, for many wi. What depends on a wi
// alone is worked out once for both, for the models that have but one interface.
class BsdfViews {
 public:
  // `first` is the Bsdf of `params` along one wo, and outlives this; second: the other wo, local, unit.
  BsdfViews(const Bsdf& first, const SurfaceParams& params, const V3f& second);

  struct Values {
    Rgb first, second;              // f(wo, wi) |cos wi|, deltas excluded
    Rgb first_matte, second_matte;  // of that, matte()
  };
  Values f_cos(const V3f& wi) const;
  Rgb second_f_cos(const V3f& wi) const { return second_.evaluate(wi).f_cos; }  // Values::second alone

  const Bsdf& first() const { return first_; }
  const Bsdf& second() const { return second_; }

 private:
  const Bsdf& first_;
  const Bsdf second_;
};

}  // namespace helio
