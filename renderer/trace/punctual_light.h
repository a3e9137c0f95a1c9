// Point, spot and directional lights: what arrives at a point, as KHR_lights_punctual recommends or, where
// PunctualLight::falloff says so, as Mitsuba has it. Projectors: as a point light; projector.h has the rest.
#pragma once

#include "renderer/base/math.h"
#include "renderer/scene/scene_description.h"

namespace helio {

// A PunctualLight with its constants worked out, in rebased coordinates.
struct PunctualSource {
  PunctualKind kind = PunctualKind::point;
  V3f position{0, 0, 0};
  V3f direction{0, 0, -1};  // unit, the way light travels
  Rgb intensity{0, 0, 0};
  float inverse_range = 0;                // 1 / range; 0: no windowing
  float cone_scale = 0, cone_offset = 1;  // spot: attenuation = clamp(cos * scale + offset)^2
  bool linear_cone = false;               // spot: attenuation = clamp(angle * scale + offset)
  std::uint32_t projector = 0;            // projector: which one of the sampler's
};

PunctualSource make_punctual_source(const PunctualLight& light);

struct PunctualArrival {
  V3f direction{0, 0, 0};  // unit, towards the light
  float distance = 0;      // +inf: directional
  // Irradiance on a surface that faces the light; black: nothing arrives. Infinite where the point is nearer to the
  // light than a float can say: the film counts such a sample as invalid.
  Rgb radiance{0, 0, 0};
};

// Within 1e-15 of the light there is no direction to it, and nothing arrives.
PunctualArrival arrive(const PunctualSource& source, const V3f& point);

}  // namespace helio
