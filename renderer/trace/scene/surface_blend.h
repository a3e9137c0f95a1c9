// The two materials of a blend at a hit (LobeModel::blend).
#pragma once

#include "renderer/trace/bsdf/bsdf_blend.h"
#include "renderer/trace/scene/surface.h"

namespace helio {

// Blends within blends, all in all, that one material may hold: loaders refuse more.
inline constexpr int kMostBlends = 8;

// Arguments as in evaluate_material(). Lives until this thread evaluates its next hit on a blend.
const BlendParams* evaluate_blend_parts(const SceneData& scene, const Hit& hit, const V3f& wo, float footprint,
                                        const Surface& surface);

}  // namespace helio
