// A diffuse base under a thin film: what the interface with its film lets through, channel by channel.
//
// As over other bases (bsdf_layered.h) the base is weighted by T(wo) T(wi) / T_mean, where T(w) must not exceed what is
// not reflected towards w. The film's reflectance is sampled over the cosine at the facet and weighed by
// CosineWeights (microfacet_albedo.h), with which its albedo is as exact as that of a plain interface:
//   T = 1 - E - q^2 (1 - a - b),
// where the last term is light that a second facet would receive: of what it sends back, the largest share q, nothing
// enters, so that T is 0 below a perfect reflector.
#pragma once

#include "renderer/trace/bsdf/microfacet_albedo.h"
#include "renderer/trace/bsdf/thin_film.h"

namespace helio {

class FilmedBase {
 public:
  // Over a dielectric that reflects bare_f0 + (f90 - bare_f0) (1 - cos)^5 where the film does not cover it; f90 is its
  // KHR_materials_specular weight.
  FilmedBase(const ThinFilm& film, float bare_f0, float f90, MicrofacetDistribution distribution, float alpha);

  // The same; the thread remembers the last few, for one takes microseconds to make.
  static FilmedBase recent(const ThinFilm& film, float bare_f0, float f90, MicrofacetDistribution distribution,
                           float alpha);

  // T(w), of the cosine mu in [0, 1]. In [0, 1].
  Rgb entering(float mu) const;
  // T(wi) / T_mean: 0 where nothing enters.
  Rgb leaving(float mu) const;

 private:
  Rgb entering(const AlbedoTerms& terms, const CosineWeights& weights) const;

  AlbedoRow row_;
  float f90_;
  std::array<Rgb, CosineWeights::kNodes> q_;
  Rgb largest_{0, 0, 0};
  Rgb per_mean_{0, 0, 0};  // 1 / T_mean
};

}  // namespace helio
