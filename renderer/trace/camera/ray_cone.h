// How wide a path is: the cone around a ray whose cross section at a hit is what one sample stands for. It chooses the
// level of mip-mapped textures; with bilinear textures nobody keeps one.
//
// Akenine-Moeller et al. 2019, "Texture Level of Detail Strategies for Real-Time Ray Tracing" (Ray Tracing Gems,
// chapter 20), and 2021, "Improved Shader and Texture Level of Detail Using Ray Cones". Surfaces are taken as flat: a
// curved mirror widens the cone by less than it should, which blurs less.
#pragma once

#include <algorithm>
#include <cmath>

namespace helio {

struct RayCone {
  float width = 0;   // where the ray starts, in scene units
  float spread = 0;  // growth of the width per unit of distance

  void advance(float distance) { width += spread * distance; }

  // A direction that was sampled with density pdf_w > 0 (per steradian) stands for a solid angle of its order, 1 /
  // pdf_w; the cone grows by a quarter of that angle's side, so that it stays well inside the lobe it was drawn from.
  void scatter(float pdf_w) { spread += kShare / std::sqrt(pdf_w); }

  // Longer side of its footprint on a surface that it meets at this cosine, in scene units.
  float footprint(float cosine) const { return width / std::max(std::fabs(cosine), kLeastCosine); }

 private:
  static constexpr float kShare = 0.25f;
  static constexpr float kLeastCosine = 0.05f;
};

}  // namespace helio
