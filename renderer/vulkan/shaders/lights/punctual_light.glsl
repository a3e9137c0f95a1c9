// What arrives of point, spot and directional lights: trace/lights/punctual_light.cpp.
#ifndef PUNCTUAL_LIGHT_GLSL
#define PUNCTUAL_LIGHT_GLSL

#include "base/arc_tangent.glsl"
#include "base/base.glsl"
#include "tables/lights.h"

struct PunctualArrival {
  vec3 direction;  // unit, towards the light
  float distance;  // infinite: directional
  vec3 radiance;   // irradiance on a surface that faces the light; black: nothing arrives
};

// What KHR_lights_punctual's range leaves of the light at a distance, [0, 1].
float range_window(PunctualLightTable source, float distance) {
  return clamp(1 - sqr(sqr(distance * source.inverse_range)), 0.0, 1.0);
}

// What the cone of a spot leaves of its light at this cosine to its axis; 1 for other lights.
float cone_attenuation(PunctualLightTable source, float cosine) {
  const bool linear = source.linear_cone != 0;
  const float along = linear ? arc_cosine(clamp(cosine, -1.0, 1.0)) : cosine;
  const float cone = clamp(along * source.cone_scale + source.cone_offset, 0.0, 1.0);
  return linear ? cone : cone * cone;
}

PunctualArrival arrive(PunctualLightTable source, vec3 point) {
  if (source.kind == kPunctualDirectional) return PunctualArrival(-source.direction, kInfinity, source.intensity);
  const vec3 to_light = source.position - point;
  const float squared = length_squared(to_light);
  if (!(squared > 1e-30)) return PunctualArrival(vec3(0), 0, vec3(0));  // on the light itself: no direction
  PunctualArrival arrival;
  arrival.distance = sqrt(squared);
  arrival.direction = to_light * (1 / arrival.distance);
  const float window = range_window(source, arrival.distance);
  const float attenuation = cone_attenuation(source, -dot(arrival.direction, source.direction));
  arrival.radiance = source.intensity * (window * attenuation / squared);
  return arrival;
}

#endif
