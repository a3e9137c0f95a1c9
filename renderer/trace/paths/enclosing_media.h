// Which volumes a ray starts in: those whose boundaries it leaves without ever having entered them.
#pragma once

#include "renderer/trace/paths/path_integrator.h"
#include "renderer/trace/scene/media.h"

namespace helio {

// Of the rays `order[0 .. count)`, at most kMostEnclosed, as intersect() takes them; `media` by ray. Rays go straight
// on through everything, through at most kMostBoundaries surfaces: what lies behind more is not found. Surfaces with
// alpha hold rays up by chance and are then passed as others are. Boundaries must be closed. Adds to `stats` the rays
// that were traced, and media_overflows: media around MediumStack::kDepth others are left out.
void find_enclosing_media(const SceneData& scene, const Ray* rays, const std::uint32_t* order, std::size_t count,
                          MediumStack* media, TraceStats& stats);

inline constexpr std::size_t kMostEnclosed = 256;
inline constexpr int kMostBoundaries = 64;

}  // namespace helio
