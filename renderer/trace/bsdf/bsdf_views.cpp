#include "renderer/trace/bsdf/bsdf_views.h"

#include "renderer/trace/bsdf/bsdf_metallic_roughness.h"

namespace helio {
namespace {

bool has_one_interface(const SurfaceParams& params) {
  return !params.mapped &&
         (params.model == LobeModel::metallic_roughness || params.model == LobeModel::specular_glossiness);
}

LayeredLobes lobes_of(const SurfaceParams& params) {
  return params.model == LobeModel::metallic_roughness ? metallic_roughness_lobes(params, false)
                                                       : specular_glossiness_lobes(params);
}

}  // namespace

MatteBsdf::MatteBsdf(const SurfaceParams& params, const V3f& wo)
    : params_(params), wo_(wo), layered_(has_one_interface(params) && wo.z > 0) {
  if (!layered_) return;
  lobes_ = lobes_of(params);
  view_ = matte_along(lobes_, wo);
}

BsdfViews::BsdfViews(const SurfaceParams& params, const V3f& first, const V3f& second)
    : params_(params),
      first_(first),
      second_(second),
      layered_(has_one_interface(params) && first.z > 0 && second.z > 0) {
  if (!layered_) return;
  lobes_ = lobes_of(params);
  first_view_ = view_along(lobes_, first);
  second_view_ = view_along(lobes_, second);
}

BsdfViews::Values BsdfViews::f_cos(const V3f& wi) const {
  if (!layered_ || !(wi.z > 0))
    return {evaluate_bsdf(params_, first_, wi).f_cos, evaluate_bsdf(params_, second_, wi).f_cos,
            matte_cos(params_, first_, wi), matte_cos(params_, second_, wi)};
  const LayeredArrival arrival = arrival_along(lobes_, wi);
  return {evaluate_reflected(lobes_, first_view_, arrival).f_cos,
          evaluate_reflected(lobes_, second_view_, arrival).f_cos, matte_reflected(lobes_, first_view_, arrival),
          matte_reflected(lobes_, second_view_, arrival)};
}

Rgb BsdfViews::second_f_cos(const V3f& wi) const {
  if (!layered_ || !(wi.z > 0)) return evaluate_bsdf(params_, second_, wi).f_cos;
  return evaluate_reflected(lobes_, second_view_, arrival_along(lobes_, wi)).f_cos;
}

}  // namespace helio
