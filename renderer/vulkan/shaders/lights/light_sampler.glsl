// Lights as the path tracer meets them: LightSampler of trace/lights/light_sampler.cpp, except for paths that start at
// lights. Include after scene.glsl.
#ifndef LIGHT_SAMPLER_GLSL
#define LIGHT_SAMPLER_GLSL

#include "sampling/alias_table.glsl"
#include "sampling/warp.glsl"
#include "base/base.glsl"
#include "base/circle.glsl"
#include "lights/environment.glsl"
#include "lights/environment_distribution.glsl"
#include "base/frame.glsl"
#include "lights/light_emission.glsl"
#include "lights/light_features.glsl"
#include "lights/light_shapes.glsl"
#include "lights/light_tree.glsl"
#include "lights/projector.glsl"
#include "lights/punctual_light.glsl"
#include "tables/lights.h"

layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer AreaLights {
  AreaLightTable at[];
};
layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer PunctualLights {
  PunctualLightTable at[];
};
layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer Emitters {
  EmitterTable at[];
};

struct LightSample {
  vec3 direction;   // unit, from the reference point to the light
  float distance;   // to the light's surface; infinite: directional and environment
  vec3 radiance;    // arriving along the direction, unoccluded, times the alpha of the light's surface there
  float pdf_w;      // selection x solid angle density; delta lights: the selection probability alone; 0: no sample
  bool delta;       // cannot be hit by a BSDF sample: MIS weight 1
  float cos_light;  // |cosine| between the direction and the light's surface normal; 1 where there is no surface
  uint light;       // number of the light
};

const LightSample kNoLightSample = LightSample(vec3(0), 0, vec3(0), 0, false, 1, kNone);

const uint kHasEnvironments = kHasConstantEnvironment | kHasEnvironmentMap;
const uint kHasAnyLight = kHasPlanarLights | kHasRoundLights | kHasPunctual | kHasEnvironments;

bool has_lights() {
  return has_light_feature(kHasAnyLight) && scene.lights.selection != kSelectionNone;
}
// Whether sample_light() reads u_select.
bool needs_selection() {
  return has_light_feature(kHasPowerSelection | kHasLightTree) && scene.lights.selection >= kSelectionPower;
}

// Whether one of several lights is selected by its power, not by the tree. Precondition: there are several lights.
bool selects_by_power(uint selection) {
  return has_light_feature(kHasPowerSelection) &&
         (!has_light_feature(kHasLightTree) || selection == kSelectionPower);
}

struct SelectedLight {
  uint light;
  float probability;
};

SelectedLight select_light(vec3 point, vec3 normal, float u) {
  const uint selection = scene.lights.selection;
  if (selection == kSelectionOne || !has_light_feature(kHasPowerSelection | kHasLightTree)) return SelectedLight(0, 1);
  if (selects_by_power(selection)) {
    const AliasChoice choice = sample_alias(scene.lights.power, scene.lights.power_count, u);
    return SelectedLight(choice.index, choice.probability);
  }
  const float infinite = scene.lights.infinite_probability;
  if (has_light_feature(kHasInfiniteSelection) && u < infinite) {
    const float rest = min(u / infinite, kOneMinusEpsilon);
    const AliasChoice choice = sample_alias(scene.lights.infinite, scene.lights.infinite_count, rest);
    return SelectedLight(scene.lights.finite_count + choice.index, choice.probability * infinite);
  }
  const float finite = 1 - infinite;
  const LightTreeChoice choice = select_from_tree(point, normal, min((u - infinite) / finite, kOneMinusEpsilon));
  return SelectedLight(choice.light, choice.probability * finite);
}

float selection_probability(vec3 point, vec3 normal, uint light) {
  const uint selection = scene.lights.selection;
  if (selection == kSelectionOne || !has_light_feature(kHasPowerSelection | kHasLightTree)) return 1;
  if (selects_by_power(selection)) return alias_probability(scene.lights.power, light);
  const uint finite_count = scene.lights.finite_count;
  const float infinite = scene.lights.infinite_probability;
  if (has_light_feature(kHasInfiniteSelection) && light >= finite_count)
    return alias_probability(scene.lights.infinite, light - finite_count) * infinite;
  return tree_probability(point, normal, light) * (1 - infinite);
}

bool environment_has_distribution() {
  return has_light_feature(kHasEnvironmentMap) &&
         (!has_light_feature(kHasConstantEnvironment) || scene.lights.environment.columns > 0);
}

// Density of directions to a constant environment: cosine-distributed above the surface, uniform over the sphere when
// both sides matter.
float constant_environment_density(vec3 normal, vec3 direction) {
  return length_squared(normal) > 0 ? max(dot(normal, direction), 0.0) * kInvPi : kInvPi / 4;
}

vec3 sample_constant_environment(vec3 normal, vec2 u) {
  if (length_squared(normal) > 0) return to_world(make_frame(normal), square_to_cosine_hemisphere(u));
  const float z = 1 - 2 * u.x;
  return vec3(safe_sqrt(1 - z * z) * unit_circle(u.y), z);
}

// A sample of one light as the light is, without what textures make of its radiance.
struct PlainLightSample {
  LightSample light;
  LightTexture look_up;
};

const LightTexture kNoLightTexture = LightTexture(kNone, vec2(0), kNone, vec2(0));

PlainLightSample sample_area_light(AreaLightTable light, vec3 point, vec2 u) {
  const ShapeSample drawn = sample_shape(light, point, u);
  PlainLightSample plain;
  plain.light =
      LightSample(drawn.direction, drawn.distance, light.radiance, drawn.pdf_w, false, drawn.cos_light, kNone);
  plain.look_up = has_light_feature(kHasLightTextures | kHasLightAlphas)
                      ? area_light_texture(light, light_point(light, point, drawn))
                      : kNoLightTexture;
  return plain;
}

PlainLightSample sample_punctual_light(PunctualLightTable source, vec3 point) {
  const PunctualArrival arrival = arrive(source, point);
  PlainLightSample plain = PlainLightSample(
      LightSample(arrival.direction, arrival.distance, arrival.radiance, 1, true, 1, kNone), kNoLightTexture);
  if (has_light_feature(kHasProjectors) && source.kind == kPunctualProjector) {
    const PictureHit hit = hit_picture(source.projector, -arrival.direction);
    plain.light.radiance *= hit.spread;
    plain.look_up.slot = hit.slot;
    plain.look_up.uv = hit.uv;
  }
  if (is_black(plain.light.radiance)) plain.light.pdf_w = 0;
  return plain;
}

PlainLightSample sample_environment(vec3 normal, vec2 u) {
  PlainLightSample plain = PlainLightSample(kNoLightSample, kNoLightTexture);
  plain.light.distance = kInfinity;
  plain.light.radiance = scene.lights.environment.scale;
  if (environment_has_distribution()) {
    plain.light.direction = sample_environment_map(u);
    plain.look_up.slot = scene.lights.environment.slot;
    plain.look_up.uv = environment_map_uv(plain.light.direction);
    plain.light.pdf_w = environment_map_pdf_w(plain.look_up.uv);
  } else {
    plain.light.direction = sample_constant_environment(normal, u);
    plain.light.pdf_w = constant_environment_density(normal, plain.light.direction);
  }
  return plain;
}

// One light sample for a shading point. `normal` is the unit geometric normal on the viewer's side, or zero when both
// sides matter (transmission). u_select and u in [0, 1). Directions below the surface may be returned.
LightSample sample_light(vec3 point, vec3 normal, float u_select, vec2 u) {
  if (!has_lights()) return kNoLightSample;
  const SelectedLight selected = select_light(point, normal, u_select);
  if (!(selected.probability > 0)) return kNoLightSample;
  const uint area_count = scene.lights.area_count;
  PlainLightSample plain = PlainLightSample(kNoLightSample, kNoLightTexture);
  if (has_light_feature(kHasPlanarLights | kHasRoundLights) && selected.light < area_count) {
    plain = sample_area_light(AreaLights(scene.lights.areas).at[selected.light], point, u);
  } else if (has_light_feature(kHasPunctual) && selected.light < area_count + scene.lights.punctual_count) {
    plain = sample_punctual_light(PunctualLights(scene.lights.punctual).at[selected.light - area_count], point);
  } else if (has_light_feature(kHasEnvironments)) {
    plain = sample_environment(normal, u);
  }
  LightSample light = plain.light;
  const uint textured = kHasLightTextures | kHasLightAlphas | kHasProjectors | kHasEnvironmentMap;
  if (has_light_feature(textured) && light.pdf_w > 0) light.radiance *= light_texture_factor(plain.look_up);
  if (light.delta && is_black(light.radiance)) light.pdf_w = 0;
  light.pdf_w *= selected.probability;
  light.light = selected.light;
  return light;
}

// Density (selection x solid angle) with which sample_light() at `point` would have returned the unit direction that
// hit area emitter `emitter` at distance `distance`, light surface cosine `cos_light` (front: > 0).
float light_pdf_w_area(vec3 point, vec3 normal, vec3 direction, uint emitter, float distance, float cos_light) {
  if (!has_light_feature(kHasPlanarLights | kHasRoundLights)) return 0;
  const uint light = Emitters(scene.lights.emitters).at[emitter].light;
  if (light == kNone) return 0;
  const float pdf_w = shape_pdf_w(AreaLights(scene.lights.areas).at[light], point, direction, distance, cos_light);
  if (!(pdf_w > 0)) return 0;
  return pdf_w * selection_probability(point, normal, light);
}

// Density (selection x solid angle) with which sample_light() at `point` would have returned the environment along a
// unit direction that left the scene.
float light_pdf_w_environment(vec3 point, vec3 normal, vec3 direction) {
  if (!has_light_feature(kHasEnvironments) || scene.lights.environment_light == 0) return 0;
  const float density = environment_has_distribution()
                            ? environment_map_pdf_w(environment_map_uv(direction))
                            : constant_environment_density(normal, direction);
  const uint light = scene.lights.area_count + scene.lights.punctual_count;
  return density * selection_probability(point, normal, light);
}

// Radiance emitted by an opaque point of an area emitter towards a viewer on the side given by cos_light; uv for
// textured emission.
vec3 emitted(uint emitter, vec2 uv, float cos_light) {
  const EmitterTable e = Emitters(scene.lights.emitters).at[emitter];
  if (!(cos_light > 0) && !(e.two_sided != 0 && cos_light < 0)) return vec3(0);
  return e.slot != kNone ? e.radiance * light_texture_lookup(e.slot, uv).rgb : e.radiance;
}

#endif
