// Radiance of the environment in a direction: EnvironmentMap of scene/images/environment_map.cpp. Include after
// scene.glsl.
#ifndef ENVIRONMENT_GLSL
#define ENVIRONMENT_GLSL

#include "base/arc_tangent.glsl"
#include "base/base.glsl"
#include "lights/light_features.glsl"
#include "tables/lights.h"
#include "scene/textures.glsl"

// (u, v), both in [0, 1), of a direction in map space, which may have any length but 0.
vec2 environment_uv(vec3 d) {
  float u = arc_tangent(d.x, -d.z) * (0.5 * kInvPi);
  if (u < 0) u += 1;
  const float v = arc_tangent(sqrt(d.x * d.x + d.z * d.z), d.y) * kInvPi;
  return vec2(min(u, kOneMinusEpsilon), min(v, kOneMinusEpsilon));
}

// (u, v) of a world direction.
vec2 environment_map_uv(vec3 direction) {
  return environment_uv(vec3(dot(direction, scene.lights.environment.axes[0]),
                             dot(direction, scene.lights.environment.axes[1]),
                             dot(direction, scene.lights.environment.axes[2])));
}

vec3 environment_to_world(vec3 map) {
  return scene.lights.environment.axes[0] * map.x + scene.lights.environment.axes[1] * map.y +
         scene.lights.environment.axes[2] * map.z;
}

// LightSampler::environment_radiance: `direction` unit, from the scene outwards. Black where there is no environment.
vec3 environment_radiance(vec3 direction) {
  vec3 radiance = scene.lights.environment.scale;
  const uint slot = scene.lights.environment.slot;
  if (has_light_feature(kHasEnvironmentMap) && slot != kNone)
    radiance *= texture_lookup(load_texture_slot(scene.lights.slots, slot), environment_map_uv(direction)).rgb;
  return radiance;
}

#endif
