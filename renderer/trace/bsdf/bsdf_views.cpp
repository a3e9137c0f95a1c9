#include "renderer/trace/bsdf/bsdf_views.h"

namespace helio {

BsdfViews::BsdfViews(const Bsdf& first, const SurfaceParams& params, const V3f& second)
    : first_(first), second_(params, second) {}

BsdfViews::Values BsdfViews::f_cos(const V3f& wi) const {
  const LayeredBsdf *one = first_.layered(), *other = second_.layered();
  if (!one || !other || !(wi.z > 0))
    return {first_.evaluate(wi).f_cos, second_.evaluate(wi).f_cos, first_.matte(wi), second_.matte(wi)};
  const LayeredLobes& lobes = one->lobes();  // the other's, too
  const LayeredArrival arrival = arrival_along(lobes, wi);
  return {evaluate_reflected(lobes, one->view(), arrival).f_cos,
          evaluate_reflected(lobes, other->view(), arrival).f_cos, matte_reflected(lobes, one->view(), arrival),
          matte_reflected(lobes, other->view(), arrival)};
}

}  // namespace helio
