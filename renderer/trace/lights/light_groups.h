// Emissive triangles as lights: pairs that make up a parallelogram become one light, so that the usual quad lamp is
// sampled without a random choice between its halves and sample points stay stratified over the whole.
#pragma once

#include <cstdint>
#include <vector>

#include "renderer/trace/lights/area_emitter.h"
#include "renderer/trace/lights/light_shapes.h"

namespace helio {

inline constexpr std::uint32_t kNoLight = ~std::uint32_t(0);

// Points of a light are numbered by (s, t): on planar lights p0 + s e1 + t e2; on spheres and ellipsoids (s, t) is the
// texture coordinate itself.

// The EmitterAlpha of a whole light.
struct LightAlpha {
  TextureSlot texture;
  V2f uv{0, 0}, uv_s{1, 0}, uv_t{0, 1};          // uv of a point is uv + s uv_s + t uv_t
  float factor = 1, factor_s = 0, factor_t = 0;  // likewise
  bool mask = false;
  float cutoff = 0.5f;
};

// One selectable area light.
struct AreaLight {
  AreaShape shape;
  Rgb radiance{0, 0, 0};
  bool textured = false;
  std::uint32_t emitter = 0;             // one of its emitters: the texture slot
  std::uint32_t alpha = kOpaqueEmitter;  // into AreaLights::alphas
  V2f uv{0, 0}, uv_s{1, 0}, uv_t{0, 1};  // uv of a point is uv + s uv_s + t uv_t
};

struct AreaLights {
  std::vector<AreaLight> lights;
  std::vector<LightAlpha> alphas;
  std::vector<std::uint32_t> light_of_emitter;  // kNoLight: degenerate or black, never sampled
};

AreaLights group_area_emitters(const std::vector<AreaEmitter>& emitters, const std::vector<EmitterAlpha>& alphas = {});

}  // namespace helio
