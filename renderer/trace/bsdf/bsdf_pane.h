// A sheet of glass, smooth and thin, both of its sides in one surface: Mitsuba's "thindielectric".
//
// All orders of reflection inside of the sheet add up: with R the Fresnel reflectance of one side and T = 1 - R,
// R + T R T + T R^3 T + ... = 2 R / (1 + R); the rest passes unbent. Both parts are deltas, chosen by their share, and
// tinted by specular_color and base_color. Reciprocal; white, it loses nothing. A single interface that passes light
// unbent is metallic-roughness with transmission instead (bsdf_layered.h).
#pragma once

#include "renderer/trace/bsdf/bsdf_values.h"
#include "renderer/trace/bsdf/surface_params.h"

namespace helio {

// Conventions: see bsdf.h.
class PaneBsdf {
 public:
  PaneBsdf(const SurfaceParams& params, bool inside);

  // wo.z > 0. Comes before all but is_pure_delta().
  void look_from(const V3f& wo);

  bool is_pure_delta() const { return true; }
  Rgb albedo() const;
  BsdfValue evaluate(const V3f&) const { return {}; }
  Rgb matte(const V3f&) const { return {0, 0, 0}; }
  BsdfSample sample(float u_lobe, const V2f& u) const;

 private:
  float ior_;
  Rgb reflection_tint_, transmission_tint_;
  V3f wo_{0, 0, 1};
  float reflected_ = 0;
};

}  // namespace helio
