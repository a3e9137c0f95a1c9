// One material's scattering, a blend aside: the switches over the model of trace/bsdf/bsdf.cpp.
#ifndef BSDF_LOBES_GLSL
#define BSDF_LOBES_GLSL

#include "bsdf/bsdf_conductor.glsl"
#include "bsdf/bsdf_lambert.glsl"
#include "bsdf/bsdf_metallic_roughness.glsl"
#include "bsdf/bsdf_pane.glsl"
#include "bsdf/bsdf_plastic.glsl"
#include "bsdf/bsdf_principled.glsl"
#include "base/frame.glsl"

// Smith's masking of wi by the facets that a normal map stands for (Conty Estevez, Lecocq and Stein 2019).
float map_shadowing(float map_alpha2, vec3 wi) {
  const float cos2 = wi.z * wi.z;
  if (!(cos2 > 0)) return 0;
  return 2 / (1 + sqrt(1 + map_alpha2 * max(0.0, 1 - cos2) / cos2));
}

// Turns wo and wi into `frame`, that of a mapped normal. `shadowing`: the share of light from wi that the map's facets
// let pass. False where the mapped normal and the surface's disagree on the side of wi: nothing is scattered then.
bool enter_map(Frame frame, float map_alpha2, inout vec3 wo, inout vec3 wi, out float shadowing) {
  shadowing = map_alpha2 > 0 ? map_shadowing(map_alpha2, wi) : 1.0;
  const float unmapped_z = wi.z;
  wo = to_local(frame, wo);
  wi = to_local(frame, wi);
  return unmapped_z * wi.z > 0;
}

// Turns a valid sample in `frame`, that of a mapped normal, into the frame of the surface.
BsdfSample leave_map(Frame frame, float map_alpha2, BsdfSample chosen) {
  const float own_z = chosen.wi.z;
  chosen.wi = to_world(frame, chosen.wi);
  if (!(chosen.wi.z * own_z > 0)) return no_sample();
  if (map_alpha2 > 0) chosen.weight *= map_shadowing(map_alpha2, chosen.wi);
  return chosen;
}

// Only parts of blends have maps of their own.
bool is_mapped(LobeParams params) {
  return has_feature(kFeatureScatterMaps) && has_model(kLobeBlend) && params.mapped != 0;
}

// Only a surface that bounds a volume is seen from below.
bool is_seen(LobeParams params, vec3 wo) {
  return wo.z > 0 || (wo.z < 0 && params.thin == 0);
}

vec3 mirrored(vec3 w) {
  return vec3(w.x, w.y, -w.z);
}

bool has_layered() {
  return has_model(kLobeMetallicRoughness) || has_model(kLobeSpecularGlossiness);
}

LayeredLobes layered_lobes(LobeParams params, bool inside) {
  if (has_model(kLobeSpecularGlossiness) && params.model == kLobeSpecularGlossiness)
    return specular_glossiness_lobes(params);
  return metallic_roughness_lobes(params, inside);
}

BsdfValue evaluate_from_above(LobeParams params, vec3 wo, vec3 wi, bool inside) {
  switch (params.model) {
    case kLobeLambert:
      if (!has_model(kLobeLambert)) break;
      return evaluate_lambert(params.base_color, wo, wi);
    case kLobeMetallicRoughness:
    case kLobeSpecularGlossiness:
      if (!has_layered()) break;
      return evaluate_layered(layered_lobes(params, inside), wo, wi);
    case kLobeConductor:
      if (!has_model(kLobeConductor)) break;
      return evaluate_conductor(params, wo, wi);
    case kLobePlastic:
      if (!has_model(kLobePlastic)) break;
      return evaluate_plastic(params, wo, wi);
    case kLobePrincipled:
      if (!has_model(kLobePrincipled)) break;
      return evaluate_principled(params, inside, wo, wi);
  }
  return no_value();
}

BsdfSample sample_from_above(LobeParams params, vec3 wo, float u_lobe, vec2 u, bool inside) {
  switch (params.model) {
    case kLobeLambert:
      if (!has_model(kLobeLambert)) break;
      return sample_lambert(params.base_color, wo, u);
    case kLobeMetallicRoughness:
    case kLobeSpecularGlossiness:
      if (!has_layered()) break;
      return sample_layered(layered_lobes(params, inside), wo, u_lobe, u);
    case kLobeConductor:
      if (!has_model(kLobeConductor)) break;
      return sample_conductor(params, wo, u);
    case kLobePlastic:
      if (!has_model(kLobePlastic)) break;
      return sample_plastic(params, wo, u_lobe, u);
    case kLobePane:
      if (!has_model(kLobePane)) break;
      return sample_pane(params, wo, u_lobe);
    case kLobePrincipled:
      if (!has_model(kLobePrincipled)) break;
      return sample_principled(params, inside, wo, u_lobe, u);
  }
  return no_sample();
}

BsdfValue evaluate_lobes(LobeParams params, vec3 wo, vec3 wi) {
  float shadowing = 1;
  if (is_mapped(params) && !enter_map(make_frame(params.map_normal), params.map_alpha2, wo, wi, shadowing))
    return no_value();
  if (!is_seen(params, wo)) return no_value();
  const bool inside = wo.z < 0;
  BsdfValue value = evaluate_from_above(params, inside ? mirrored(wo) : wo, inside ? mirrored(wi) : wi, inside);
  value.f_cos *= shadowing;
  return value;
}

BsdfSample sample_lobes(LobeParams params, vec3 wo, float u_lobe, vec2 u) {
  const bool mapped = is_mapped(params);
  Frame frame;
  if (mapped) {
    frame = make_frame(params.map_normal);
    wo = to_local(frame, wo);
  }
  if (!is_seen(params, wo)) return no_sample();
  const bool inside = wo.z < 0;
  BsdfSample chosen = sample_from_above(params, inside ? mirrored(wo) : wo, u_lobe, u, inside);
  if (inside) chosen.wi = mirrored(chosen.wi);
  if (!mapped || !(chosen.pdf_w > 0)) return chosen;
  return leave_map(frame, params.map_alpha2, chosen);
}

bool is_pure_delta(LobeParams params) {
  switch (params.model) {
    case kLobeLambert:
      if (!has_model(kLobeLambert)) break;
      return is_black(params.base_color);
    case kLobeMetallicRoughness:
    case kLobeSpecularGlossiness:
      if (!has_layered()) break;
      return is_pure_delta(layered_lobes(params, false));
    case kLobeConductor:
      if (!has_model(kLobeConductor)) break;
      return params.alpha < kDeltaAlpha;
    case kLobePlastic:
      if (!has_model(kLobePlastic)) break;
      return is_black(params.base_color) && params.alpha < kDeltaAlpha;
    case kLobePrincipled:
      if (!has_model(kLobePrincipled)) break;
      return false;
  }
  return true;
}

vec3 lobes_albedo(LobeParams params, vec3 wo) {
  if (is_mapped(params)) wo = to_local(make_frame(params.map_normal), wo);
  if (!is_seen(params, wo)) return vec3(0);
  const bool inside = wo.z < 0;
  const vec3 above = inside ? mirrored(wo) : wo;
  switch (params.model) {
    case kLobeLambert:
      if (!has_model(kLobeLambert)) break;
      return params.base_color;
    case kLobeMetallicRoughness:
    case kLobeSpecularGlossiness:
      if (!has_layered()) break;
      return layered_albedo(layered_lobes(params, inside), above);
    case kLobeConductor:
      if (!has_model(kLobeConductor)) break;
      return conductor_albedo(params, above);
    case kLobePlastic:
      if (!has_model(kLobePlastic)) break;
      return plastic_albedo(params, above);
    case kLobePane:
      if (!has_model(kLobePane)) break;
      return pane_albedo(params, above);
    case kLobePrincipled:
      if (!has_model(kLobePrincipled)) break;
      return principled_albedo(params, inside, above);
  }
  return vec3(0);
}

#endif
