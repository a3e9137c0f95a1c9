// glTF materials as layered lobes.
#pragma once

#include "renderer/trace/bsdf/bsdf_layered.h"
#include "renderer/trace/bsdf/surface_params.h"

namespace helio {

// |ior - 1| below which the far side of a rough volume counts as matched: light passes it unbent and unreflected,
// because the half vector of two nearly opposite directions is lost in rounding. The reflectance that this drops is at
// most 3e-7 near the normal, 1e-4 at 77 degrees and 0.02 at 87 degrees. A smooth surface is matched at ior 1 alone.
inline constexpr float kMatchedIor = 1e-3f;

// glTF 2.0 appendix B with KHR_materials_ior, _specular, _transmission and _volume:
//   mix(mix(opaque dielectric, transmissive dielectric, transmission), metal, metallic).
// Metal: Schlick with f0 = base_color, f90 = 1, and what its facets rescatter. Opaque dielectric: Schlick with f0 =
// specular min(((ior - 1) / (ior + 1))^2 specular_color, 1), f90 = specular, over the diffuse base_color. Transmissive
// dielectric: exact Fresnel equations scaled to the same f0 and f90, the light that enters tinted by base_color at
// every crossing; total internal reflection is always complete. `inside`: wo was on the far side and has been mirrored
// to z > 0.
LayeredLobes metallic_roughness_lobes(const SurfaceParams& params, bool inside);

// KHR_materials_pbrSpecularGlossiness: Schlick with f0, f90 = 1, over the diffuse base_color (1 - max f0). It does not
// say what is metal; facets rescatter by the share max f0 that has no diffuse base.
LayeredLobes specular_glossiness_lobes(const SurfaceParams& params);

// Either of the two, by the model of the parameters, as one wo sees it. Conventions: see bsdf.h.
class LayeredBsdf {
 public:
  LayeredBsdf(const SurfaceParams& params, bool inside);

  // wo.z > 0. Comes before all but is_pure_delta().
  void look_from(const V3f& wo) { view_ = view_along(lobes_, wo); }

  const LayeredLobes& lobes() const { return lobes_; }
  const LayeredView& view() const { return view_; }

  bool is_pure_delta() const { return helio::is_pure_delta(lobes_); }
  Rgb albedo() const { return layered_albedo(lobes_, view_.wo); }
  BsdfValue evaluate(const V3f& wi) const { return evaluate_layered(lobes_, view_, wi); }
  Rgb matte(const V3f& wi) const { return matte_layered(lobes_, view_, wi); }
  BsdfSample sample(float u_lobe, const V2f& u) const { return sample_layered(lobes_, view_, u_lobe, u); }

 private:
  LayeredLobes lobes_;
  LayeredView view_;
};

}  // namespace helio
