// Point, spot and directional lights: what arrives at a point, as KHR_lights_punctual recommends or, where
// PunctualLight::falloff says so, as Mitsuba has it. Projectors: as a point light; projector.h has the rest.
#pragma once

#include "renderer/base/math.h"
#include "renderer/scene/description/scene_description.h"

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
  float one_minus_cos_outer = 2;          // spot: of the cone's half angle; others: the whole sphere
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

// What KHR_lights_punctual's range leaves of the light at a distance, [0, 1].
inline float range_window(const PunctualSource& source, float distance) {
  return std::clamp(1 - sqr(sqr(distance * source.inverse_range)), 0.0f, 1.0f);
}

struct PunctualDeparture {
  V3f direction{0, 0, 0};  // unit, the way the light travels
  Rgb intensity{0, 0, 0};  // W / sr, before the range's window
  double pdf_w = 0;        // solid angle density, that of departure_pdf_w(); 0: none, a spot without an opening
};

// Point lights: a direction uniform over the sphere; spots: over the cone outside of which they are dark. u in [0,
// 1)^2.
PunctualDeparture depart(const PunctualSource& source, const V2f& u);
// For any direction within the spot's cone.
double departure_pdf_w(const PunctualSource& source);

}  // namespace helio
