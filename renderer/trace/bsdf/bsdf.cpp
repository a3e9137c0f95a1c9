#include "renderer/trace/bsdf/bsdf.h"

#include "renderer/trace/bsdf/bsdf_blend.h"
#include "renderer/trace/bsdf/bsdf_conductor.h"
#include "renderer/trace/bsdf/bsdf_lambert.h"
#include "renderer/trace/bsdf/bsdf_metallic_roughness.h"
#include "renderer/trace/bsdf/bsdf_pane.h"
#include "renderer/trace/bsdf/bsdf_plastic.h"
#include "renderer/trace/bsdf/bsdf_principled.h"
#include "renderer/trace/bsdf/bsdf_stack.h"

namespace helio {

namespace {

enum class Side : std::uint8_t { outside, inside, none };

// Only a surface that bounds a volume is seen from below.
Side side_of(const SurfaceParams& params, const V3f& wo) {
  if (wo.z > 0) return Side::outside;
  return wo.z < 0 && !params.thin ? Side::inside : Side::none;
}

V3f mirrored(const V3f& w) {
  return {w.x, w.y, -w.z};
}

BsdfValue evaluate_from_above(const SurfaceParams& params, const V3f& wo, const V3f& wi, bool inside) {
  switch (params.model) {
    case LobeModel::lambert:
      return evaluate_lambert(params.base_color, wo, wi);
    case LobeModel::metallic_roughness:
      return evaluate_layered(metallic_roughness_lobes(params, inside), wo, wi);
    case LobeModel::specular_glossiness:
      return evaluate_layered(specular_glossiness_lobes(params), wo, wi);
    case LobeModel::conductor:
      return evaluate_conductor(params, wo, wi);
    case LobeModel::stack:
      return evaluate_stack(params, inside, wo, wi);
    case LobeModel::plastic:
      return evaluate_plastic(params, wo, wi);
    case LobeModel::principled:
      return evaluate_principled(params, inside, wo, wi);
    case LobeModel::pane:
    case LobeModel::blend:  // its parts know their own sides: never comes here
    case LobeModel::none:
      break;
  }
  return {};
}

Rgb matte_from_above(const SurfaceParams& params, const V3f& wo, const V3f& wi, bool inside) {
  switch (params.model) {
    case LobeModel::lambert:
      return evaluate_lambert(params.base_color, wo, wi).f_cos;
    case LobeModel::metallic_roughness:
      return matte_layered(metallic_roughness_lobes(params, inside), wo, wi);
    case LobeModel::specular_glossiness:
      return matte_layered(specular_glossiness_lobes(params), wo, wi);
    case LobeModel::stack:
      return matte_stack(params, inside, wo, wi);
    case LobeModel::plastic:
      return matte_plastic(params, wo, wi);
    case LobeModel::principled:
      return matte_principled(params, inside, wo, wi);
    case LobeModel::conductor:
    case LobeModel::pane:
    case LobeModel::blend:
    case LobeModel::none:
      break;
  }
  return {0, 0, 0};
}

BsdfSample sample_from_above(const SurfaceParams& params, const V3f& wo, float u_lobe, const V2f& u, bool inside) {
  switch (params.model) {
    case LobeModel::lambert:
      return sample_lambert(params.base_color, wo, square_to_cosine_hemisphere(u));
    case LobeModel::metallic_roughness:
      return sample_layered(metallic_roughness_lobes(params, inside), wo, u_lobe, u);
    case LobeModel::specular_glossiness:
      return sample_layered(specular_glossiness_lobes(params), wo, u_lobe, u);
    case LobeModel::conductor:
      return sample_conductor(params, wo, u);
    case LobeModel::stack:
      return sample_stack(params, inside, wo, u_lobe, u);
    case LobeModel::plastic:
      return sample_plastic(params, wo, u_lobe, u);
    case LobeModel::pane:
      return sample_pane(params, wo, u_lobe);
    case LobeModel::principled:
      return sample_principled(params, inside, wo, u_lobe, u);
    case LobeModel::blend:
    case LobeModel::none:
      break;
  }
  return {};
}

BsdfValue evaluate_in_frame(const SurfaceParams& params, const V3f& wo, const V3f& wi) {
  if (params.model == LobeModel::blend) return evaluate_blend(params, wo, wi);
  const Side side = side_of(params, wo);
  if (side == Side::none) return {};
  if (side == Side::outside) return evaluate_from_above(params, wo, wi, false);
  return evaluate_from_above(params, mirrored(wo), mirrored(wi), true);
}

Rgb matte_in_frame(const SurfaceParams& params, const V3f& wo, const V3f& wi) {
  if (params.model == LobeModel::blend) return matte_blend(params, wo, wi);
  const Side side = side_of(params, wo);
  if (side == Side::none) return {0, 0, 0};
  if (side == Side::outside) return matte_from_above(params, wo, wi, false);
  return matte_from_above(params, mirrored(wo), mirrored(wi), true);
}

BsdfSample sample_in_frame(const SurfaceParams& params, const V3f& wo, float u_lobe, const V2f& u) {
  if (params.model == LobeModel::blend) return sample_blend(params, wo, u_lobe, u);
  const Side side = side_of(params, wo);
  if (side == Side::none) return {};
  if (side == Side::outside) return sample_from_above(params, wo, u_lobe, u, false);
  BsdfSample sample = sample_from_above(params, mirrored(wo), u_lobe, u, true);
  sample.wi = mirrored(sample.wi);
  return sample;
}

// Smith's masking of wi by the facets that a normal map stands for (Conty Estevez, Lecocq and Stein 2019, "A
// Microfacet-Based Shadowing Function to Solve the Bump Terminator Problem").
float map_shadowing(const SurfaceParams& params, const V3f& wi) {
  const float cos2 = wi.z * wi.z;
  if (!(cos2 > 0)) return 0;
  return 2 / (1 + std::sqrt(1 + params.map_alpha2 * std::max(0.0f, 1 - cos2) / cos2));
}

// The unmapped and the mapped surface agree on the side that a direction lies on.
bool same_side(const V3f& unmapped, const V3f& mapped) {
  return unmapped.z * mapped.z > 0;
}

}  // namespace

BsdfValue evaluate_bsdf(const SurfaceParams& params, const V3f& wo, const V3f& wi) {
  if (!params.mapped) return evaluate_in_frame(params, wo, wi);
  const Frame frame(params.map_normal);
  const V3f own_wi = frame.to_local(wi);
  if (!same_side(wi, own_wi)) return {};
  BsdfValue value = evaluate_in_frame(params, frame.to_local(wo), own_wi);
  if (params.map_alpha2 > 0) value.f_cos *= map_shadowing(params, wi);
  return value;
}

Rgb matte_cos(const SurfaceParams& params, const V3f& wo, const V3f& wi) {
  if (!params.mapped) return matte_in_frame(params, wo, wi);
  const Frame frame(params.map_normal);
  const V3f own_wi = frame.to_local(wi);
  if (!same_side(wi, own_wi)) return {0, 0, 0};
  const Rgb f_cos = matte_in_frame(params, frame.to_local(wo), own_wi);
  return params.map_alpha2 > 0 ? f_cos * map_shadowing(params, wi) : f_cos;
}

BsdfSample sample_bsdf(const SurfaceParams& params, const V3f& wo, float u_lobe, const V2f& u) {
  if (!params.mapped) return sample_in_frame(params, wo, u_lobe, u);
  const Frame frame(params.map_normal);
  BsdfSample sample = sample_in_frame(params, frame.to_local(wo), u_lobe, u);
  if (!sample.valid()) return sample;
  const V3f own_wi = sample.wi;
  sample.wi = frame.to_world(own_wi);
  if (!same_side(sample.wi, own_wi)) return {};
  if (params.map_alpha2 > 0) sample.weight *= map_shadowing(params, sample.wi);
  return sample;
}

bool is_pure_delta(const SurfaceParams& params) {
  switch (params.model) {
    case LobeModel::lambert:
      return is_black(params.base_color);
    case LobeModel::metallic_roughness:
      return is_pure_delta(metallic_roughness_lobes(params, false));
    case LobeModel::specular_glossiness:
      return is_pure_delta(specular_glossiness_lobes(params));
    case LobeModel::conductor:
      return params.alpha < kDeltaAlpha;
    case LobeModel::stack:
      return is_pure_delta_stack(params);
    case LobeModel::plastic:
      return is_black(params.base_color) && params.alpha < kDeltaAlpha;
    case LobeModel::principled:
      return false;
    case LobeModel::blend:
      return is_pure_delta_blend(params);
    case LobeModel::pane:
    case LobeModel::none:
      break;
  }
  return true;
}

Rgb surface_albedo(const SurfaceParams& params, const V3f& wo_unmapped) {
  const V3f wo = params.mapped ? Frame(params.map_normal).to_local(wo_unmapped) : wo_unmapped;
  if (params.model == LobeModel::blend) return blend_albedo(params, wo);
  const Side side = side_of(params, wo);
  if (side == Side::none) return {0, 0, 0};
  const bool inside = side == Side::inside;
  const V3f above = inside ? mirrored(wo) : wo;
  switch (params.model) {
    case LobeModel::lambert:
      return params.base_color;
    case LobeModel::metallic_roughness:
      return layered_albedo(metallic_roughness_lobes(params, inside), above);
    case LobeModel::specular_glossiness:
      return layered_albedo(specular_glossiness_lobes(params), above);
    case LobeModel::conductor:
      return conductor_albedo(params, above);
    case LobeModel::stack:
      return stack_albedo(params, inside, above);
    case LobeModel::plastic:
      return plastic_albedo(params, above);
    case LobeModel::pane:
      return pane_albedo(params, above);
    case LobeModel::principled:
      return principled_albedo(params, inside, above);
    case LobeModel::blend:
    case LobeModel::none:
      break;
  }
  return {0, 0, 0};
}

SurfaceParams simplify(const SurfaceParams& params) {
  SurfaceParams simple = params;
  if (params.model == LobeModel::metallic_roughness && params.metallic == 0 && params.transmission == 0 &&
      params.specular == 0) {
    simple.model = LobeModel::lambert;
  }
  return simple;
}

}  // namespace helio
