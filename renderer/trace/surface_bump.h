// Normals of a surface that a texture displaces a little: bump maps (Blinn 1978, "Simulation of Wrinkled Surfaces").
#pragma once

#include "renderer/trace/surface.h"

namespace helio {

// The normal of the surface moved along `normal` (unit) by `scale` times the texture's luminance, to first order:
// n - grad h, the gradient taken in the plane of the normal. On meshes; `normal` itself where the triangle has no area
// or no texture coordinates, or the result no direction.
V3f bumped_normal(const SceneData& scene, const Hit& hit, const Surface& surface, const TextureSlot& height,
                  float scale, const V3f& normal);

// What shadows a mapped normal (SurfaceParams::unmapped_normal, map_alpha2): light reaches the facets that the map
// stands for as it would those of roughness alpha^2 = tan^2 / 8, at most 1, of the angle between the two normals, which
// ends it smoothly where the unmapped surface turns from the light. `frame` is that of the mapped normal.
void set_map_shadowing(const Surface& surface, const V3f& unmapped, const Frame& frame, SurfaceParams& params);

}  // namespace helio
