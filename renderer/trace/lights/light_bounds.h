// Bounds of what one light, or a cluster of lights, can send where: position, directions, intensity.
#pragma once

#include <limits>

#include "renderer/base/math.h"

namespace helio {

struct LightBounds {
  Box3f box;                // of the emitting points
  V3f axis{0, 0, 1};        // unit; normals (for a spot: its axis) lie within theta_o of it
  float theta_o = 0;        // [0, pi]; pi: all directions
  float theta_e = kPi / 2;  // emission reaches this far from the normals; [0, pi / 2]
  bool two_sided = false;   // emits about -axis as well
  double intensity = 0;     // > 0: largest radiant intensity, luminance, W / sr
  float range = std::numeric_limits<float>::infinity();  // nothing arrives from farther away
};

// Bounds of both.
LightBounds merge(const LightBounds& a, const LightBounds& b);

// Cost of a cluster in the surface area orientation heuristic (Conty Estevez and Kulla 2018, section 4.3): intensity
// times the measure of its directions times its extent, here the squared diagonal, which keeps clusters on a line
// comparable.
double cluster_cost(const LightBounds& bounds);

}  // namespace helio
