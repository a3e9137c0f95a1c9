// Materials as the shaders read them: MaterialRecord (trace/scene/scene_data.h) with the fields of Material that a hit
// needs. Made by scene/material_tables.cpp; SceneTables::materials is the address of one MaterialTable a material.
#ifndef HELIO_VULKAN_TABLES_MATERIALS_H
#define HELIO_VULKAN_TABLES_MATERIALS_H

#include "base.h"

#ifdef __cplusplus
#include <cstddef>

namespace helio::vulkan {
#endif

// Values of LobeModel, in its order. kLobeStack is refused before a scene is uploaded (scene/supported.h).
HELIO_CONSTANT kLobeLambert = 0u;
HELIO_CONSTANT kLobeMetallicRoughness = 1u;
HELIO_CONSTANT kLobeSpecularGlossiness = 2u;
HELIO_CONSTANT kLobeConductor = 3u;
HELIO_CONSTANT kLobeStack = 4u;
HELIO_CONSTANT kLobePlastic = 5u;
HELIO_CONSTANT kLobePane = 6u;
HELIO_CONSTANT kLobePrincipled = 7u;
HELIO_CONSTANT kLobeBlend = 8u;
HELIO_CONSTANT kLobeNone = 9u;

// Values of MicrofacetDistribution, in its order.
HELIO_CONSTANT kGgx = 0u;
HELIO_CONSTANT kBeckmann = 1u;
HELIO_CONSTANT kGgxAnisotropic = 2u;
HELIO_CONSTANT kBeckmannAnisotropic = 3u;

// Values of MapRule, in its order.
HELIO_CONSTANT kMapBend = 0u;
HELIO_CONSTANT kMapOwnFrame = 1u;
HELIO_CONSTANT kMapOwnFrameUnflipped = 2u;

// Values of AlphaMode, in its order.
HELIO_CONSTANT kAlphaOpaque = 0u;
HELIO_CONSTANT kAlphaMask = 1u;
HELIO_CONSTANT kAlphaBlend = 2u;

// What some material of a scene has: bit kLobe... for a model, and these. Shaders are specialised by them
// (kMaterialFeatures in surface_params.glsl).
HELIO_CONSTANT kFeatureTextures = 1u << 16;      // textures that evaluate_material.glsl reads, or vertex colours
HELIO_CONSTANT kFeatureNormalMaps = 1u << 17;    // kMaterialNormalMapped
HELIO_CONSTANT kFeatureScatterMaps = 1u << 18;   // kMaterialScattersMapped
HELIO_CONSTANT kFeatureEmissionMaps = 1u << 19;  // emission_texture, or vertex colours of unlit materials
HELIO_CONSTANT kFeatureAnisotropy = 1u << 20;
HELIO_CONSTANT kFeatureBeckmann = 1u << 21;
HELIO_CONSTANT kFeatureTransmission = 1u << 22;

// Bits of MaterialTable::flags: the flags of MaterialRecord and, from kMaterialMapShadowing on, of Material.
HELIO_CONSTANT kMaterialNumbersTextured = 1u;
HELIO_CONSTANT kMaterialNormalMapped = 2u;
HELIO_CONSTANT kMaterialScattersMapped = 4u;
HELIO_CONSTANT kMaterialSpecular = 8u;
HELIO_CONSTANT kMaterialEmissive = 16u;
HELIO_CONSTANT kMaterialDoubleSided = 32u;
HELIO_CONSTANT kMaterialOneSided = 64u;
HELIO_CONSTANT kMaterialVolume = 128u;
HELIO_CONSTANT kMaterialUnlit = 256u;
HELIO_CONSTANT kMaterialPureDelta = 512u;
HELIO_CONSTANT kMaterialMapShadowing = 1024u;
HELIO_CONSTANT kMaterialMapMirrored = 2048u;
HELIO_CONSTANT kMaterialBlendBySide = 4096u;

// A PrincipledMaterial as shaders read it.
struct PrincipledTable {
  float anisotropic, spec_tint, sheen, sheen_tint, flatness, clearcoat, clearcoat_gloss;
};

// SurfaceParams of one material: all of them but the layers and the parts of a blend. Members lie in
// groups of 16 bytes, which surface_params.glsl loads as a whole.
struct LobeParams {
  uint64_t albedo;   // AlbedoTable of the distribution
  uint64_t plastic;  // PlasticTable; 0 where the model is another
  uint model;        // kLobe...
  uint distribution;
  uint thin, tinted_reflection;  // 0 or 1
  vec3 base_color;
  float alpha;
  vec3 specular_color;
  float specular;
  vec3 f0;
  float ior;
  vec3 eta;
  float metallic;
  vec3 k;
  float transmission;
  float alpha_along, alpha_across;
  vec2 along;
  PrincipledTable principled;
  uint mapped;  // 0 or 1
  vec3 map_normal;
  float map_alpha2;
};

// A PlasticInterface as shaders read it.
HELIO_CONSTANT kPlasticNodes = 64u;
struct PlasticTable {
  float eta, internal_reflectance;
  uint nonlinear, smooth_interface;  // 0 or 1
  float transmittance[kPlasticNodes];
};

// The tables of trace/bsdf/microfacet_albedo.cpp: rows of kAlbedoMuNodes over the cosine, one a node of alpha.
// AlbedoTerms as a, b, s, loss.
HELIO_CONSTANT kAlbedoMuNodes = 80u;
HELIO_CONSTANT kAlbedoAlphaNodes = 48u;
struct AlbedoTable {
  vec4 directional[kAlbedoAlphaNodes * kAlbedoMuNodes];
  vec4 mean[kAlbedoAlphaNodes];
  float lost_below[kAlbedoAlphaNodes * kAlbedoMuNodes];
};

// Indices into MaterialTable::textures, which evaluate_material.glsl reads, by their fields in Material and
// NumberTextures.
HELIO_CONSTANT kTextureBaseColor = 0u;
HELIO_CONSTANT kTextureMetallicRoughness = 1u;
HELIO_CONSTANT kTextureSpecular = 2u;
HELIO_CONSTANT kTextureSpecularColor = 3u;
HELIO_CONSTANT kTextureTransmission = 4u;
HELIO_CONSTANT kTextureSpecularGlossiness = 5u;
HELIO_CONSTANT kNumberRoughness = 6u;
HELIO_CONSTANT kNumberRoughnessAcross = 7u;
HELIO_CONSTANT kNumberMetallic = 8u;
HELIO_CONSTANT kNumberTransmission = 9u;
HELIO_CONSTANT kNumberAnisotropic = 10u;
HELIO_CONSTANT kNumberSpecTint = 11u;
HELIO_CONSTANT kNumberSheen = 12u;
HELIO_CONSTANT kNumberSheenTint = 13u;
HELIO_CONSTANT kNumberFlatness = 14u;
HELIO_CONSTANT kNumberClearcoat = 15u;
HELIO_CONSTANT kNumberClearcoatGloss = 16u;
HELIO_CONSTANT kMaterialTextures = 17u;

HELIO_CONSTANT kMaterialTableSize = 1056u;
HELIO_CONSTANT kMaterialTexturesOffset = 260u;
struct MaterialTable {
  LobeParams params;  // complete where `present` is 0
  uint flags;
  vec3 emission, absorption;  // as in MaterialRecord

  float roughness, roughness_across;  // perceptual; roughness_across < 0: none
  float glossiness;
  uint distribution;  // Material::distribution: kGgx or kBeckmann

  uint map_rule;
  float normal_scale, bump_scale;

  uint alpha_mode;
  float alpha_cutoff, base_alpha;

  uint blend_first, blend_second;  // indices of materials; kNone where the model is another
  float blend_weight;

  uint present;  // bit i: textures[i] is there
  TextureSlotTable textures[kMaterialTextures];
  TextureSlotTable emission_texture;  // of an unlit material that of its base colour
  TextureSlotTable normal_texture, bump_texture;
  TextureSlotTable alpha_texture;  // alpha_slot() of scene/description/material_slots.h
  TextureSlotTable blend_weight_texture;
};

#ifdef __cplusplus
static_assert(sizeof(TextureSlotTable) == 36);
static_assert(sizeof(LobeParams) == 176 && sizeof(MaterialTable) == kMaterialTableSize);
static_assert(offsetof(MaterialTable, textures) == kMaterialTexturesOffset);
static_assert(offsetof(LobeParams, base_color) == 32 && offsetof(LobeParams, alpha_along) == 112 &&
              offsetof(LobeParams, principled) == 128 && offsetof(LobeParams, map_normal) == 160);
static_assert(sizeof(PlasticTable) == 16 + 4 * kPlasticNodes);
static_assert(sizeof(AlbedoTable) == (20 * kAlbedoMuNodes + 16) * kAlbedoAlphaNodes);
}  // namespace helio::vulkan
#endif

#endif
