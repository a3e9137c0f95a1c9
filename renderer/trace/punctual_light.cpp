#include "renderer/trace/punctual_light.h"

#include <limits>

namespace helio {

PunctualSource make_punctual_source(const PunctualLight& light) {
  PunctualSource source;
  source.kind = light.kind;
  source.position = V3f(light.position);
  source.direction = V3f(light.direction);
  source.intensity = light.intensity;
  if (light.kind != PunctualKind::directional && std::isfinite(light.range) && light.range > 0) {
    source.inverse_range = 1 / light.range;
  }
  if (light.kind == PunctualKind::spot) {
    const float cos_inner = std::cos(light.inner_cone_angle), cos_outer = std::cos(light.outer_cone_angle);
    source.cone_scale = 1 / std::max(0.001f, cos_inner - cos_outer);
    source.cone_offset = -cos_outer * source.cone_scale;
    source.linear_cone = light.falloff == SpotFalloff::linear_in_angle;
    if (source.linear_cone) {
      source.cone_scale = -1 / std::max(1e-6f, light.outer_cone_angle - light.inner_cone_angle);
      source.cone_offset = -light.outer_cone_angle * source.cone_scale;
    }
  }
  return source;
}

PunctualArrival arrive(const PunctualSource& source, const V3f& point) {
  PunctualArrival arrival;
  if (source.kind == PunctualKind::directional) {
    arrival.direction = -source.direction;
    arrival.distance = std::numeric_limits<float>::infinity();
    arrival.radiance = source.intensity;
    return arrival;
  }
  const V3f to_light = source.position - point;
  const float squared = length_squared(to_light);
  if (!(squared > 1e-30f)) return arrival;  // on the light itself: no direction, irradiance without bound
  arrival.distance = std::sqrt(squared);
  arrival.direction = to_light * (1 / arrival.distance);
  const float window = std::clamp(1 - sqr(sqr(arrival.distance * source.inverse_range)), 0.0f, 1.0f);
  const float cosine = -dot(arrival.direction, source.direction);
  const float along = source.linear_cone ? std::acos(std::clamp(cosine, -1.0f, 1.0f)) : cosine;
  const float cone = std::clamp(along * source.cone_scale + source.cone_offset, 0.0f, 1.0f);
  const float attenuation = source.linear_cone ? cone : cone * cone;
  arrival.radiance = source.intensity * (window * attenuation / squared);
  return arrival;
}

}  // namespace helio
