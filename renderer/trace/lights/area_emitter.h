// Emissive surfaces as the render scene gathers them.
#pragma once

#include <array>
#include <cstdint>

#include "renderer/base/math.h"
#include "renderer/scene/description/scene_description.h"

namespace helio {

inline constexpr std::uint32_t kOpaqueEmitter = ~std::uint32_t(0);

// Texture coordinates of the corners of a triangle, untransformed.
using CornerUvs = std::array<V2f, 3>;
inline const CornerUvs kNoUvs = {V2f(0, 0), V2f(0, 0), V2f(0, 0)};

// Where an emitter is not there: the alpha of its material. A point of alpha a emits a times the radiance of an opaque
// one (blend), or all of it where a reaches the cutoff and nothing elsewhere (mask).
struct EmitterAlpha {
  TextureSlot texture;                      // its alpha channel; may be absent
  CornerUvs uv = kNoUvs;                    // for `texture`
  std::array<float, 3> factor = {1, 1, 1};  // triangle: at its corners, linear between them; others: the first
  bool mask = false;
  float cutoff = 0.5f;  // of a mask
};

// An emissive triangle, sphere or ellipsoid, in rebased scene coordinates.
struct AreaEmitter {
  enum class Shape : std::uint8_t { triangle, sphere, ellipsoid };
  Shape shape = Shape::triangle;
  bool two_sided = false;
  V3f p0{0, 0, 0};                       // triangle: a corner; sphere, ellipsoid: the centre
  V3f e1{0, 0, 0};                       // triangle: edge to the second corner; sphere: e1.x is the radius
  V3f e2{0, 0, 0};                       // triangle: edge to the third corner
  V3f e3{0, 0, 0};                       // ellipsoid: e1, e2, e3 are what the unit sphere's axes become
  V3f normal{0, 0, 1};                   // triangle: unit, front side (emission leaves along it)
  Rgb radiance{0, 0, 0};                 // factor; times the texture where there is one
  TextureSlot texture;                   // of the emission
  CornerUvs uv = kNoUvs;                 // for `texture`; spheres and ellipsoids are textured by sphere_uv() instead
  std::uint32_t alpha = kOpaqueEmitter;  // its EmitterAlpha
  float power = 0;  // luminance of the emitted flux, texture included, W; 0: degenerate or black, never sampled as a
                    // light (filled by LightSampler)
};

}  // namespace helio
