// The share of the second material of a blend at a hit: trace/scene/surface_blend.cpp. Its parts are evaluated by
// evaluate_material.glsl.
#ifndef SURFACE_BLEND_GLSL
#define SURFACE_BLEND_GLSL

#include "scene/surface.glsl"

float blend_weight(Hit hit, Surface s) {
  if ((material_of(s.material).flags & kMaterialBlendBySide) != 0) return s.front ? 0.0 : 1.0;
  const float weight = material_of(s.material).blend_weight;
  const TextureSlotTable slot = material_of(s.material).blend_weight_texture;
  if (!texture_present(slot)) return weight;
  const float textured = weight * luminance(surface_texel(hit, s, slot).rgb);
  return textured >= 0 ? min(textured, 1.0) : 0.0;
}

#endif
