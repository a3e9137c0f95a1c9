// Emissive surfaces as the render scene gathers them.
#pragma once

#include <cstdint>

#include "renderer/base/math.h"
#include "renderer/scene/scene_description.h"

namespace helio {

// An emissive triangle or sphere, in rebased scene coordinates.
struct AreaEmitter {
  enum class Shape : std::uint8_t { triangle, sphere };
  Shape shape = Shape::triangle;
  bool two_sided = false;
  V3f p0, e1, e2;       // triangle: corner and edges; sphere: p0 is the centre, e1.x the radius
  V3f normal;           // triangle: unit, front side (emission leaves along it)
  Rgb radiance;         // factor; times the texture where there is one
  TextureSlot texture;  // of the emission; spheres have no texture coordinates: theirs is not read
  V2f uv[3];            // texture coordinates of the three corners, untransformed
  float power = 0;      // luminance of the emitted flux, texture included, W; 0: degenerate or black, never sampled
                        // as a light (filled by LightSampler)
};

}  // namespace helio
