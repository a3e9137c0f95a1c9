// The layers of a material at a hit (LobeModel::stack): textures looked up, directions turned into the local frame.
#pragma once

#include "renderer/trace/scene/surface.h"

namespace helio {

// Thickest film in nm: interference is long gone, and larger numbers would overflow.
inline constexpr float kThickestFilm = 1e6f;

// The local frame of scattering: z along the shading normal, on the viewer's side except where a volume tells its sides
// apart.
Frame shading_frame(const Surface& surface);

// A direction of tangent space (`turn`, along texture coordinates `uv_set`) in `frame`. Without tangents any is as
// good: the frame's own.
V2f anisotropy_direction(const SceneData& scene, const Hit& hit, const Surface& surface, const Frame& frame, int uv_set,
                         const V2f& turn);

// `wo`: unit, world space, towards the viewer; `footprint` as in evaluate_material(); `frame` is the local frame of the
// scattering: its normal is the shading normal, on the side that the caller chose.
LayerParams evaluate_layers(const SceneData& scene, const Hit& hit, const V3f& wo, float footprint,
                            const Surface& surface, const Frame& frame);

}  // namespace helio
