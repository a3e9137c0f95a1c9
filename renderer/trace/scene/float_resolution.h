// Finds cameras that look at what single precision cannot tell apart.
#pragma once

#include <string>
#include <vector>

#include "renderer/trace/scene/scene_data.h"

namespace helio {

// A sentence for each camera of the scene most of whose view is closer to it than a hundred times the distance by which
// rays leave the surfaces seen (surface.h): light within that distance is lost or comes from the wrong side, visibly
// so. The distance grows with the extent of the part that was hit. Looks along 64 rays from each of the first 16
// cameras. Where none of them meets anything and there is no environment, it says that. Precondition: the scene is
// complete.
std::vector<std::string> find_unresolved_views(const SceneData& scene);

}  // namespace helio
