// The scattering of one surface as two directions see it, which reprojection compares, and what of it looks alike from
// everywhere.
#pragma once

#include "renderer/trace/bsdf/bsdf.h"
#include "renderer/trace/bsdf/bsdf_layered.h"

namespace helio {

// evaluate_bsdf() along two wo, to the bit, and matte_cos(), but for rounding, for many wi. What depends on a wo alone
// is worked out once, and what depends on a wi alone once for both, for the models that have but one interface.
class BsdfViews {
 public:
  // wo: local, unit. The parameters outlive this.
  BsdfViews(const SurfaceParams& params, const V3f& first, const V3f& second);

  struct Values {
    Rgb first, second;              // f(wo, wi) |cos wi|, deltas excluded
    Rgb first_matte, second_matte;  // of that, matte_cos()
  };
  Values f_cos(const V3f& wi) const;
  Rgb second_f_cos(const V3f& wi) const;  // Values::second alone

 private:
  const SurfaceParams& params_;
  V3f first_, second_;
  bool layered_;
  LayeredLobes lobes_;
  LayeredView first_view_, second_view_;
};

// matte_cos() along one wo, to the bit, for a few wi.
class MatteBsdf {
 public:
  // wo: local, unit. The parameters outlive this.
  MatteBsdf(const SurfaceParams& params, const V3f& wo);

  Rgb f_cos(const V3f& wi) const { return layered_ ? matte_layered(lobes_, view_, wi) : matte_cos(params_, wo_, wi); }

 private:
  const SurfaceParams& params_;
  V3f wo_;
  bool layered_;
  LayeredLobes lobes_;
  MatteView view_;
};

}  // namespace helio
