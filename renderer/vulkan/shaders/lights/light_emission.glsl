// What leaves a point of an area light, texture and alpha included: trace/lights/light_emission.cpp. Include after
// scene.glsl.
#ifndef LIGHT_EMISSION_GLSL
#define LIGHT_EMISSION_GLSL

#include "base/base.glsl"
#include "lights/environment.glsl"
#include "lights/light_shapes.glsl"
#include "tables/lights.h"
#include "scene/textures.glsl"

layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer LightAlphas {
  LightAlphaTable at[];
};
vec4 light_texture_lookup(uint slot, vec2 uv) {
  return texture_lookup(load_texture_slot(scene.lights.slots, slot), uv);
}

// (s, t) of the point where a sample of the light's shape from `point` meets it.
vec2 light_point(AreaLightTable light, vec3 point, ShapeSample drawn) {
  if (!is_round(light)) return drawn.st;
  return environment_uv(local_direction(light, point + drawn.direction * drawn.distance));
}

// What textures make of the radiance of any light. One function for all, and one call of texture_lookup().
struct LightTexture {
  uint slot;  // kNone: none
  vec2 uv;
  uint alpha;  // of an area light: into LightTables::alphas; kNone: opaque
  vec2 st;     // for `alpha`
};

LightTexture area_light_texture(AreaLightTable light, vec2 st) {
  return LightTexture(light.slot, light.uv + light.uv_s * st.x + light.uv_t * st.y, light.alpha, st);
}

vec3 light_texture_factor(LightTexture of) {
  vec3 factor = vec3(1);
  const bool has_alpha = has_light_feature(kHasLightAlphas) && of.alpha != kNone;
  LightAlphaTable alpha;
  alpha.slot = kNone;
  float a = 1;
  if (has_alpha) {
    alpha = LightAlphas(scene.lights.alphas).at[of.alpha];
    a = alpha.factor + alpha.factor_s * of.st.x + alpha.factor_t * of.st.y;
  }
  [[dont_unroll]] for (uint k = 0; k < 2; ++k) {
    const uint slot = k == 0 ? of.slot : alpha.slot;
    if (!has_light_feature(kHasImages) || slot == kNone) continue;
    const vec2 uv = k == 0 ? of.uv : alpha.uv + alpha.uv_s * of.st.x + alpha.uv_t * of.st.y;
    const vec4 value = light_texture_lookup(slot, uv);
    if (k == 0) {
      factor = value.rgb;
    } else {
      a *= value.a;
    }
  }
  if (!has_alpha) return factor;
  if (alpha.mask != 0) return a >= alpha.cutoff ? factor : vec3(0);
  return factor * clamp(a, 0.0, 1.0);
}

#endif
