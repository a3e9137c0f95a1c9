// A material with its textures looked up at a hit, and the tables that it needs: SurfaceParams of trace/bsdf/bsdf.h.
#ifndef SURFACE_PARAMS_GLSL
#define SURFACE_PARAMS_GLSL

#include "base/base.glsl"
#include "tables/materials.h"

layout(buffer_reference, scalar, buffer_reference_align = 8) readonly buffer Materials {
  MaterialTable at[];
};
// LobeParams as they lie in a MaterialTable, in few loads.
layout(buffer_reference, scalar, buffer_reference_align = 8) readonly buffer LobeGroups {
  u64vec2 tables;
  uvec4 kinds;
  vec4 base_color, specular_color, f0, eta, k, alphas, principled, principled_rest;
};
layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer AlbedoBuffer {
  AlbedoTable table;
};
layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer PlasticBuffer {
  PlasticTable table;
};

// What materials of the scene may have: material_features() of scene/material_tables.h. Compilers leave out the code
// for the rest.
layout(constant_id = 1) const uint kMaterialFeatures = 0xffffffffu;
bool has_feature(uint feature) {
  return (kMaterialFeatures & feature) != 0;
}
bool has_model(uint model) {
  return has_feature(1u << model);
}

// The MaterialTable of a material; scene.glsl names `scene`.
#define material_of(index) Materials(scene.materials).at[index]

// Loads MaterialTable::params of the materials at this address, without a map, which a hit gives.
LobeParams load_lobe_params(uint64_t materials, uint index) {
  LobeGroups groups = LobeGroups(materials + uint64_t(index) * kMaterialTableSize);
  const u64vec2 tables = groups.tables;
  const uvec4 kinds = groups.kinds;
  const vec4 base_color = groups.base_color, specular_color = groups.specular_color, f0 = groups.f0, eta = groups.eta;
  const vec4 k = groups.k, alphas = groups.alphas;
  LobeParams p;
  p.albedo = tables.x;
  p.plastic = tables.y;
  p.model = kinds.x;
  p.distribution = kinds.y;
  p.thin = kinds.z;
  p.tinted_reflection = kinds.w;
  p.base_color = base_color.rgb;
  p.alpha = base_color.w;
  p.specular_color = specular_color.rgb;
  p.specular = specular_color.w;
  p.f0 = f0.rgb;
  p.ior = f0.w;
  p.eta = eta.rgb;
  p.metallic = eta.w;
  p.k = k.rgb;
  p.transmission = k.w;
  p.alpha_along = alphas.x;
  p.alpha_across = alphas.y;
  p.along = alphas.zw;
  p.principled = PrincipledTable(0, 0, 0, 0, 0, 0, 0);
  if (has_model(kLobePrincipled) && p.model == kLobePrincipled) {
    const vec4 own = groups.principled, rest = groups.principled_rest;
    p.principled = PrincipledTable(own.x, own.y, own.z, own.w, rest.x, rest.y, rest.z);
  }
  p.mapped = 0;
  p.map_normal = vec3(0, 0, 1);
  p.map_alpha2 = 0;
  return p;
}

// bsdf.h's SurfaceParams without pointers. The map is that of the material itself, applied to what it consists of;
// the two parts of a blend have their own in `mapped` of their LobeParams, which `first` of another model has not.
struct SurfaceParams {
  uint model;          // kLobe...; kLobeBlend: (1 - weight) first + weight second; another: `first` alone
  float transmission;
  bool mapped;         // scatters about map_normal: unit, local frame
  vec3 map_normal;
  float map_alpha2;    // alpha^2 of the map's shadowing; 0: none
  float weight;        // [0, 1]; 0 where the model is not kLobeBlend
  LobeParams first, second;
};

// Whether light may come out on the far side of the surface.
bool lets_light_through(SurfaceParams params) {
  return params.transmission > 0;
}

// One material's lobes as a whole surface.
SurfaceParams surface_params(LobeParams lobes) {
  SurfaceParams params;
  params.model = lobes.model;
  params.transmission = lobes.transmission;
  params.mapped = lobes.mapped != 0;
  params.map_normal = lobes.map_normal;
  params.map_alpha2 = lobes.map_alpha2;
  params.weight = 0;
  params.first = lobes;
  params.first.mapped = 0;
  if (has_model(kLobeBlend)) params.second = params.first;
  return params;
}

#endif
