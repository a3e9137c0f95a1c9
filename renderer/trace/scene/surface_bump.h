// Normals of a surface that a texture displaces a little: bump maps (Blinn 1978, "Simulation of Wrinkled Surfaces").
#pragma once

#include "renderer/trace/scene/surface.h"

namespace helio {

// The normal of the surface moved along `normal` (unit) by `scale` times the texture's luminance, to first order:
// n - grad h, the gradient taken in the plane of the normal. `normal` itself where there are no texture coordinates, or
// the result has no direction.
V3f bumped_normal(const SceneData& scene, const Hit& hit, const Surface& surface, const TextureSlot& height,
                  float scale, const V3f& normal);

}  // namespace helio
