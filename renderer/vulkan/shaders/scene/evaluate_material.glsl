// A material's parameters with textures and vertex colours applied: evaluate_material() of trace/scene/surface.cpp.
// Loops take the place of its calls one by one, because compilers of shaders inline every call.
#ifndef EVALUATE_MATERIAL_GLSL
#define EVALUATE_MATERIAL_GLSL

#include "scene/surface.glsl"
#include "scene/surface_blend.glsl"
#include "scene/surface_map.glsl"
#include "scene/surface_numbers.glsl"

vec3 vertex_color(Hit hit, Surface s) {
  const PartTable part = part_at(s.part);
  if (is_sphere(part) || part.colors == 0) return vec3(1);
  return interpolate_vec4(part.colors, part, hit.primitive, s.barycentric).rgb;
}

void apply_textures(Hit hit, Surface s, inout LobeParams p) {
  const uint flags = material_of(s.material).flags;
  const uint64_t slots = scene.materials + uint64_t(s.material) * kMaterialTableSize + kMaterialTexturesOffset;
  float along = 1, across = 1;
  [[dont_unroll]] for (uint left = material_of(s.material).present; left != 0; left &= left - 1) {
    const uint i = findLSB(left);
    const vec4 texel = surface_texel(hit, s, load_texture_slot(slots, i));
    const float number = number_factor(texel);
    switch (i) {
      case kTextureBaseColor:
        p.base_color *= texel.rgb;
        break;
      case kTextureMetallicRoughness:
        p.alpha = sqr(material_of(s.material).roughness * texel.y);
        p.metallic *= texel.z;
        break;
      case kTextureSpecular:
        p.specular *= texel.w;
        break;
      case kTextureSpecularColor:
        p.specular_color *= texel.rgb;
        break;
      case kTextureTransmission:
        p.transmission *= texel.x;
        break;
      case kTextureSpecularGlossiness:
        p.f0 *= texel.rgb;
        p.alpha = sqr(1 - material_of(s.material).glossiness * texel.w);
        break;
      case kNumberRoughness:
        along = number;
        break;
      case kNumberRoughnessAcross:
        across = number;
        break;
      case kNumberMetallic:
        p.metallic *= number;
        break;
      case kNumberTransmission:
        p.transmission *= number;
        break;
      case kNumberAnisotropic:
        p.principled.anisotropic *= number;
        break;
      case kNumberSpecTint:
        p.principled.spec_tint *= number;
        break;
      case kNumberSheen:
        p.principled.sheen *= number;
        break;
      case kNumberSheenTint:
        p.principled.sheen_tint *= number;
        break;
      case kNumberFlatness:
        p.principled.flatness *= number;
        break;
      case kNumberClearcoat:
        p.principled.clearcoat *= number;
        break;
      case kNumberClearcoatGloss:
        p.principled.clearcoat_gloss *= number;
        break;
    }
  }
  if ((flags & kMaterialNumbersTextured) != 0) apply_roughness_numbers(s.material, along, across, p);
}

// The lobes of s.material; of a blend only its own map.
LobeParams evaluate_lobe_params(Hit hit, vec3 wo, Surface s) {
  LobeParams p = load_lobe_params(scene.materials, s.material);
  if (has_feature(kFeatureScatterMaps) && (material_of(s.material).flags & kMaterialScattersMapped) != 0)
    set_mapped_normal(hit, wo, s, p);
  if (p.model == kLobeBlend) return p;
  if (has_feature(kFeatureTextures)) {
    p.base_color *= vertex_color(hit, s);
    apply_textures(hit, s, p);
  }
  if (is_anisotropic(p.distribution)) p.along = tangent_direction(hit, s, scattering_frame(s, p));
  return p;
}

// The material at a hit; `wo` is the unit direction to the viewer in world space.
SurfaceParams evaluate_material(Hit hit, vec3 wo, Surface s) {
  if (!has_model(kLobeBlend)) return surface_params(evaluate_lobe_params(hit, wo, s));
  SurfaceParams params;
  const uint first = material_of(s.material).blend_first, second = material_of(s.material).blend_second;
  const int passes = first == kNone ? 1 : 3;  // the material itself, then the parts of a blend
  [[dont_unroll]] for (int pass = 0; pass < passes; ++pass) {
    Surface own = s;
    if (pass > 0) own.material = pass == 1 ? first : second;
    LobeParams lobes = evaluate_lobe_params(hit, wo, own);
    if (pass == 0) {
      params = surface_params(lobes);
      continue;
    }
    // A one-sided part is black from behind, though the frame may have been turned to the viewer.
    if ((material_of(own.material).flags & kMaterialOneSided) != 0 && !s.front) lobes.model = kLobeNone;
    if (pass == 1) params.first = lobes;
    else params.second = lobes;
  }
  if (passes > 1) params.weight = blend_weight(hit, s);
  return params;
}

#endif
