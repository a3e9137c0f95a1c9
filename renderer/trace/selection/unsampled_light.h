// What an integrator does not sample in a scene: said with every picture (FrameBegin::unsampled), for light that is
// missing looks like shadow.
#pragma once

#include <string>
#include <vector>

#include "renderer/scene/load/scene_features.h"
#include "renderer/trace/paths/integrator.h"

namespace helio {

// What is missing from pictures of such a scene however many samples they take, then what is found by chance alone, and
// how pictures are off otherwise: a sentence each, for people to read. Empty: all light is sampled. Features tell what
// may be there, not whether the camera meets it.
std::vector<std::string> unsampled_light(Integrator integrator, const SceneFeatures& features);

}  // namespace helio
