#include "renderer/frame/paper/view_error.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "renderer/trace/bsdf/bsdf.h"

namespace helio {
namespace {

float smallest_alpha(const SurfaceParams& params) {
  const bool anisotropic = params.distribution == MicrofacetDistribution::ggx_anisotropic ||
                           params.distribution == MicrofacetDistribution::beckmann_anisotropic;
  return anisotropic ? std::min(params.alpha_along, params.alpha_across) : params.alpha;
}

}  // namespace

bool is_specular_or_refractive(const SurfaceParams& params) {
  const bool sharp = smallest_alpha(params) < kSpecularAlpha;
  switch (params.model) {
    case LobeModel::lambert:
    case LobeModel::none:
      return false;
    case LobeModel::pane:
      return true;
    case LobeModel::conductor:
    case LobeModel::metallic_roughness:
    case LobeModel::specular_glossiness:
      return sharp || lets_light_through(params);
    case LobeModel::stack:
      return sharp || lets_light_through(params) ||
             (params.layers->clearcoat > 0 && params.layers->clearcoat_alpha < kSpecularAlpha);
    case LobeModel::plastic:
      return sharp || params.plastic->smooth;
    case LobeModel::principled: {
      // Burley 2012: gloss goes from an alpha of 0.1 to one of 0.001.
      const float coat_alpha = 0.1f + (0.001f - 0.1f) * params.principled.clearcoat_gloss;
      return sharp || lets_light_through(params) || (params.principled.clearcoat > 0 && coat_alpha < kSpecularAlpha);
    }
    case LobeModel::blend:
      return (params.blend->weight < 1 && is_specular_or_refractive(params.blend->first)) ||
             (params.blend->weight > 0 && is_specular_or_refractive(params.blend->second));
  }
  return true;
}

float view_error(const SurfaceParams& params, const V3f& now, const V3f& before, const V3f& towards,
                 const Rgb& irradiance) {
  constexpr float kUnknown = std::numeric_limits<float>::infinity();
  if (!(now.z * before.z > 0)) return kUnknown;
  const Rgb here = Bsdf(params, now).evaluate(towards).f_cos, there = Bsdf(params, before).evaluate(towards).f_cos;
  float largest = 0;
  for (int c = 0; c < 3; ++c) {
    const float difference = std::fabs(here[c] - there[c]);
    if (difference == 0 && std::isfinite(irradiance[c])) continue;
    const float error = difference / std::fabs(towards.z) * std::fabs(irradiance[c]);
    if (!std::isfinite(error)) return kUnknown;
    largest = std::max(largest, error);
  }
  return largest;
}

}  // namespace helio
