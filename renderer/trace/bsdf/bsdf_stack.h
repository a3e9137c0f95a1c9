// Clearcoat over sheen over a metallic-roughness base that may be anisotropic, iridescent and diffusely transmissive:
// KHR_materials_clearcoat, _sheen, _anisotropy, _iridescence, _diffuse_transmission.
//
//   f = c f_coat + t_c s f_sheen + t f_base
//
// Layers are combined by albedo scaling as the sheen extension does: with T(w) = 1 - albedo of the layers above, t is
// min(T(wo), T(wi)), which is reciprocal and lets no more through than was not reflected. The clearcoat extension
// scales by the viewer's direction alone, which is not reciprocal. A ray that crosses the boundary of a volume passes
// the layers on the outside once; inside there are none. A thin surface has them on both sides.
//
//   coat          GGX, ior 1.5 (Schlick, f0 0.04), its own normal, no diffuse base
//   sheen         bsdf_sheen.h
//   anisotropy    alpha along the direction: mix(alpha, 1, strength^2), across: alpha
//   iridescence   thin_film.h in place of the Fresnel term of reflection, thin_film_base.h over diffuse bases
//   diffuse transmission: the base's diffuse part goes to the far side by this share: colour / pi, under the same
//                 interface (bsdf_layered.h) on both sides
//
// What a white furnace gets back is in scenes/README.md, printed by the test BsdfStack.LossesAreAsDocumented.
#pragma once

#include "renderer/trace/bsdf/bsdf.h"

namespace helio {

// params.layers is set; wo.z > 0; inside: wo was inside the volume and has been mirrored.
BsdfValue evaluate_stack(const SurfaceParams& params, bool inside, const V3f& wo, const V3f& wi);
// Of its f_cos, what matte_layered() is of the base, and diffuse transmission.
Rgb matte_stack(const SurfaceParams& params, bool inside, const V3f& wo, const V3f& wi);
BsdfSample sample_stack(const SurfaceParams& params, bool inside, const V3f& wo, float u_lobe, const V2f& u);
bool is_pure_delta_stack(const SurfaceParams& params);
Rgb stack_albedo(const SurfaceParams& params, bool inside, const V3f& wo);

}  // namespace helio
