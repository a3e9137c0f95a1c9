// The microfacets of an evaluated material.
#pragma once

#include "renderer/trace/bsdf/microfacet.h"
#include "renderer/trace/bsdf/surface_params.h"

namespace helio {

inline bool is_anisotropic(MicrofacetDistribution distribution) {
  return distribution == MicrofacetDistribution::ggx_anisotropic ||
         distribution == MicrofacetDistribution::beckmann_anisotropic;
}

// alpha 0: none, a mirror.
inline Microfacet microfacet_of(const SurfaceParams& params) {
  Microfacet microfacet{params.distribution, params.alpha < kDeltaAlpha ? 0.0f : params.alpha};
  if (!is_anisotropic(params.distribution)) return microfacet;
  microfacet.alpha_along = std::max(params.alpha_along, kDeltaAlpha);
  microfacet.alpha_across = std::max(params.alpha_across, kDeltaAlpha);
  microfacet.along = params.along;
  return microfacet;
}

}  // namespace helio
