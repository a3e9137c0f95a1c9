#include "renderer/trace/lights/punctual_light.h"

#include <limits>

#include "renderer/trace/sampling/warp.h"

namespace helio {
namespace {

// Of a spot, towards a direction at this cosine to its axis; 1 for others.
float cone_attenuation(const PunctualSource& source, float cosine) {
  const float along = source.linear_cone ? std::acos(std::clamp(cosine, -1.0f, 1.0f)) : cosine;
  const float cone = std::clamp(along * source.cone_scale + source.cone_offset, 0.0f, 1.0f);
  return source.linear_cone ? cone : cone * cone;
}

}  // namespace

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
    source.one_minus_cos_outer = 2 * sqr(std::sin(light.outer_cone_angle / 2));
    // Cones that are one are a hard edge; else as KHR_lights_punctual has it.
    const bool hard = light.inner_cone_angle >= light.outer_cone_angle;
    source.cone_scale = 1 / std::max(hard ? 1e-6f : 0.001f, cos_inner - cos_outer);
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
  const float window = range_window(source, arrival.distance);
  const float attenuation = cone_attenuation(source, -dot(arrival.direction, source.direction));
  arrival.radiance = source.intensity * (window * attenuation / squared);
  return arrival;
}

PunctualDeparture depart(const PunctualSource& source, const V2f& u) {
  PunctualDeparture departure;
  const V3f local = square_to_cone(u, source.one_minus_cos_outer);
  departure.direction = Frame(source.direction).to_world(local);
  departure.intensity = source.intensity * cone_attenuation(source, local.z);
  departure.pdf_w = departure_pdf_w(source);
  return departure;
}

double departure_pdf_w(const PunctualSource& source) {
  const double solid_angle = 2 * std::numbers::pi * double(source.one_minus_cos_outer);
  return solid_angle > 0 ? 1 / solid_angle : 0.0;
}

}  // namespace helio
