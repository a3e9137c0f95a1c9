// Scattering at a surface point: trace/bsdf/bsdf.h, which says what the directions are.
#ifndef BSDF_GLSL
#define BSDF_GLSL

#include "bsdf/bsdf_blend.glsl"

// Whether the surface scatters about another normal than its frame's.
bool is_mapped(SurfaceParams params) {
  return has_feature(kFeatureScatterMaps) && params.mapped;
}

BsdfValue evaluate_bsdf(SurfaceParams params, vec3 wo, vec3 wi) {
  float shadowing = 1;
  if (is_mapped(params) && !enter_map(make_frame(params.map_normal), params.map_alpha2, wo, wi, shadowing))
    return no_value();
  BsdfValue value = evaluate_blend(params, wo, wi);
  value.f_cos *= shadowing;
  return value;
}

// u_lobe and u in [0, 1). An invalid sample (pdf_w == 0) ends the path.
BsdfSample sample_bsdf(SurfaceParams params, vec3 wo, float u_lobe, vec2 u) {
  Frame frame = Frame(vec3(0), vec3(0), vec3(0));
  if (is_mapped(params)) {
    frame = make_frame(params.map_normal);
    wo = to_local(frame, wo);
  }
  BsdfSample chosen = sample_blend(params, wo, u_lobe, u);
  if (!is_mapped(params) || !(chosen.pdf_w > 0)) return chosen;
  return leave_map(frame, params.map_alpha2, chosen);
}

// True when every lobe is a delta: next-event estimation cannot contribute.
bool is_pure_delta(SurfaceParams params) {
  return is_pure_delta_blend(params);
}

// Approximate hemispherical-directional reflectance + transmittance, [0, 1].
vec3 surface_albedo(SurfaceParams params, vec3 wo) {
  return blend_albedo(params, is_mapped(params) ? to_local(make_frame(params.map_normal), wo) : wo);
}

#endif
