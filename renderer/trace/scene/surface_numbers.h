// Numbers of a material that textures give (NumberTextures), and what follows from two of them: microfacet alphas along
// and across.
#pragma once

#include "renderer/trace/scene/surface.h"

namespace helio {

// Roughness along and across the tangent, alpha in [0, 1]. Of principled `across` does not count: its anisotropy
// stretches `along` (Burley 2012, aspect = sqrt(1 - 0.9 anisotropic)). Equal ones leave the distribution isotropic.
void set_alphas(const Material& material, float along, float across, SurfaceParams& params);

// Arguments as of evaluate_material(), whose parameters these are.
void apply_number_textures(const SceneData& scene, const Hit& hit, float footprint, const Surface& surface,
                           SurfaceParams& params);

}  // namespace helio
